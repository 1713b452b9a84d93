"""Reference pages made from the code: keys of scenes, verbs with their flags, exit codes."""

from __future__ import annotations

import argparse
import json
import re
from collections.abc import Iterator
from importlib import import_module
from typing import Any

from pydantic import BaseModel

from trackbed.command import VERBS, build_parser
from trackbed.errors import EXIT_CODES
from trackbed.scene_files import find_model
from trackbed.scene_files.units import read_notes, split_note

PACKAGES = ("trackbed", "adapters", "qdem_fem", "rigid_lcp", "track_line")
SCENES = {
    "A bed: `trackbed run`": "adapters.scene.Scene",
    "A deck of your own: `trackbed run`": "adapters.decks.scene.DeckScene",
    "Bodies or a track: `trackbed qdem`": "qdem_fem.track.enter.TrackScene",
    "Hard grains: `trackbed rigid`": "rigid_lcp.scene.types.SceneTables",
    "A line: `trackbed line`": "track_line.scene.file.SceneTables",
    "A stone: the file of `sample.form`": "adapters.bed.stones.toml.Stone",
}
KEY_HEAD = "key | type and range | unit | default | what it is"
TYPES = {"object": "table", "string": "text", "integer": "whole number", "boolean": "true or false"}
BOUNDS = dict(minimum="from", exclusiveMinimum="above", maximum="to", exclusiveMaximum="below")
ANY, TINY = 1e18, 1e-12
"""A bound as large as the first is none; a least value up to the second is "above 0"."""
Row = list[str]


def make_table(head: str, rows: list[Row]) -> str:
    """A table in Markdown; ``head``: names of its columns, with bars between."""

    def escape(text: str) -> str:
        text = re.sub(r"``(.+?)``", r"`\1`", " ".join(text.split()))
        parts = re.split(r"(\*\*\w+\*\*|`[^`]*`)", text)
        parts[::2] = [re.sub(r"([*<_|\[\]])", r"\\\1", part) for part in parts[::2]]
        return "".join(parts)

    lines = [head, re.sub(r"[^|]+", "---", head), *(" | ".join(map(escape, row)) for row in rows)]
    return "".join(f"| {line} |\n" for line in lines)


def describe_type(schema: dict[str, Any]) -> str:
    """Type and range of a value, from its JSON schema."""
    if several := schema.get("anyOf") or schema.get("oneOf"):
        words = [describe_type(one) for one in several if one.get("type") != "null"]
        return " or ".join(dict.fromkeys(words))
    if "enum" in schema or "const" in schema:
        return ", ".join(f"`{json.dumps(v)}`" for v in schema.get("enum", [schema.get("const")]))
    kind = schema.get("type", "object")
    if kind == "array":
        parts = [describe_type(one) for one in schema.get("prefixItems", [schema.get("items", {})])]
        ends = dict.fromkeys(str(schema[key]) for key in ("minItems", "maxItems") if key in schema)
        count = f"list of {' to '.join(ends)}" if "maxItems" in schema else "list"
        return f"{count}: {', '.join(dict.fromkeys(parts))}"
    ends = [(BOUNDS[key], schema[key]) for key in BOUNDS if abs(schema.get(key, ANY)) < ANY]
    words = [" above 0" if 0 < at <= TINY else f" {word} {at:g}" for word, at in ends]
    return TYPES.get(kind, kind) + "".join(words)


def format_default(field: Any) -> str:
    """The default of a key; empty where it may be left out and stands for no value."""
    if field.is_required():
        return "**needed**"
    value = field.get_default(call_default_factory=True)
    if isinstance(value, BaseModel) or value in (None, "", {}, [], ()):
        return ""
    return f"`{value:g}`" if isinstance(value, float) else f"`{json.dumps(value)}`"


def list_tables(
    model: type[BaseModel], name: str = "", seen: dict[type, str] | None = None
) -> Iterator[tuple[str, list[Row]]]:
    """Tables of a scene by their name in TOML, with a row for each key that is no table, of the
    columns `KEY_HEAD`.  A table whose keys stand in an earlier one says in which."""
    seen = {} if seen is None else seen
    if (earlier := seen.setdefault(model, name)) != name:
        yield name, [[f"as `{earlier}`", "", "", "", ""]]
        return
    notes, schema = read_notes(model), model.model_json_schema()["properties"]
    rows, inner = [], []
    for key, field in model.model_fields.items():
        said, kind = notes.get(key, ""), describe_type(schema[key])
        if found := find_model(field.annotation):
            named = {"additionalProperties", "patternProperties"} & schema[key].keys()
            path = f"{name.strip('[]')}.{key}{'.NAME' * bool(named)}".lstrip(".")
            inner.append((found, f"[[{path}]]" if kind.startswith("list") else f"[{path}]"))
            if kind.startswith(("list", "table")):
                continue
        unit, words = split_note(said)
        rows.append([f"`{key}`", kind, unit, format_default(field), words])
    yield name, rows
    for found, path in inner:
        yield from list_tables(found, path, seen)


def list_scenes() -> Iterator[tuple[str, str, list[Row]]]:
    """Title of each scene, name and rows of each of its tables."""
    for title, path in SCENES.items():
        module, _, name = path.rpartition(".")
        for table, rows in list_tables(getattr(import_module(module), name)):
            yield title, table, rows


def write_keys() -> str:
    """The page of all keys of all scenes."""
    parts = [
        "# Keys of scenes\n\nMade from the models that check them.  A number may have a unit, as "
        'in `"14.15 kPa"`; without one it is in the unit of its key, and `-` has none.'
    ]
    parts.append("Of `[procedure]` only `total_cycles` is needed: the rest follows from `name`.")
    for title, table, rows in list_scenes():
        parts += [f"## {title}"] * (not table)
        name = f"`{table}`" if table else "Top of the file"
        parts += [f"### {name}\n\n{make_table(KEY_HEAD, rows)}"] * bool(rows)
    return "\n\n".join(parts)


def write_verbs() -> str:
    """The page of all verbs, with their arguments, and of the exit codes."""
    parts = ["# Verbs, flags and exit codes\n\nMade from the parsers of the command."]
    for verb, (_, summary) in VERBS.items():
        actions = build_parser(verb)._actions
        verbs = next(one for one in actions if isinstance(one, argparse._SubParsersAction))
        parser = verbs.choices[verb]
        words, usage = parser._get_formatter(), parser.format_usage().removeprefix("usage: ")
        shown = [one for one in parser._actions if one.help != argparse.SUPPRESS]
        rows = [[f"`{words._format_action_invocation(o)}`", words._expand_help(o)] for o in shown]
        parts.append(f"## {verb}\n\n{summary}\n\n```text\n{usage}```")
        parts.append(make_table("argument | what it does", rows))
    codes = [[f"`{code}`", meaning] for code, meaning in EXIT_CODES.items()]
    return "\n\n".join([*parts, "## Exit codes", make_table("code | meaning", codes)])
