"""Scene files: TOML to `Scene`, with every problem at once, each with its line and key."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from adapters.errors import SceneError, UsageError
from adapters.jump_schedule import jump_lengths
from adapters.scene import Procedure, Scene, flat_keys
from adapters.scene_checks import (
    ALTERNATIVES,
    JUMP_KEYS,
    TOLERANCE_KEY,
    Problem,
    did_you_mean,
    scene_problems,
)

REMEDY = "correct these keys; scenes/karrech.toml (trackbed new karrech DIR) explains every key"

BOUNDS = {
    "greater_than": ("gt", "above"),
    "greater_than_equal": ("ge", "at least"),
    "less_than": ("lt", "below"),
    "less_than_equal": ("le", "at most"),
}
"""Types of pydantic's errors: name of the bound in their context, and its words."""


def scene_load(path: Path | str, overrides: Sequence[str] = ()) -> Scene:
    """Read and check a scene file.

    ``overrides`` such as ``procedure.k=10`` replace or add keys, their values in TOML (a bare word
    is a string); an override of one of two alternative keys removes the other, and one of
    procedure.tolerance removes k and h.  A relative path of a load series counts from the scene
    file's folder.

    Raises `UsageError` when the file or an override can not be read, `SceneError` with all that is
    wrong: file, line, dotted key and sentence of each.
    """
    path = Path(path)
    text = _text(path)
    try:
        data = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise _syntax_error(path, text, error) from error
    places = {key: f"{path}:{line}" for key, line in key_lines(text).items()}
    for override in overrides:
        key = _override(data, override)
        for end, character in enumerate(key):
            if character == ".":
                places.setdefault(key[:end], f"--set {override}")
        places[key] = f"--set {override}"
    loading = data.get("loading")
    if isinstance(loading, dict) and isinstance(loading.get("series"), str):
        loading["series"] = str(path.parent.absolute() / loading["series"])
    problems = list(_schedule_spelled_out(data))
    try:
        scene = Scene.model_validate(data)
    except ValidationError as error:
        problems += _problems(data, error.errors(include_url=False))
    if not problems:
        return scene
    raise SceneError(_report(problems, places, path), where=str(path), remedy=REMEDY)


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        raise SceneError(
            f"this is not a text file (byte {error.start})",
            where=str(path),
            remedy="give a scene file: trackbed new karrech DIR writes one",
        ) from error
    except (OSError, ValueError) as error:  # ValueError: a null byte in the path
        reason = getattr(error, "strerror", None) or str(error)
        raise UsageError(
            f"can not read the scene ({reason})",
            where=str(path),
            remedy="give a scene file: trackbed new karrech DIR writes one",
        ) from error


def _syntax_error(path: Path, text: str, error: Exception) -> SceneError:
    found = re.search(r"line (\d+)", str(error))
    line = int(found[1]) if found else text.count("\n") + 1
    source = text.split("\n")[line - 1].strip()
    reason = "nested too deeply" if isinstance(error, RecursionError) else str(error)
    return SceneError(
        f"this is not TOML: {reason}\n  {source}",
        where=f"{path}:{line}",
        remedy='one key = value a line, strings in "quotes"; toml.io explains the format',
    )


def key_lines(text: str) -> dict[str, int]:
    """Line number of every table and key of a valid TOML text, by dotted key.

    Statement by statement through the TOML reader itself, which knows about quotes, comments,
    inline tables and values of many lines.
    """
    lines: dict[str, int] = {}
    table: tuple[str, ...] = ()
    statement: list[str] = []
    for number, line in enumerate(text.split("\n"), 1):
        statement.append(line)
        try:
            parsed = tomllib.loads("\n".join(statement))
        except ValueError:
            continue
        first = number - len(statement) + 1
        is_header = statement[0].lstrip().startswith("[")
        statement = []
        if is_header:
            *_, table = _paths(parsed)
            parsed = {}
            lines.setdefault(".".join(table), first)
        for inner in _paths(parsed):
            lines.setdefault(".".join(table + inner), first)
    return lines


def _paths(table: dict[str, Any]) -> Iterator[tuple[str, ...]]:
    for key, value in table.items():
        yield (key,)
        if isinstance(value, dict):
            yield from ((key, *inner) for inner in _paths(value))


def _override(data: dict[str, Any], override: str) -> str:
    """Set ``key=value`` in ``data``; the dotted key."""
    key, equals, text = (part.strip() for part in override.partition("="))
    if not equals or not all(re.fullmatch(r"[\w-]+", name) for name in key.split(".")):
        raise UsageError(
            f"can not read the override {override!r}",
            where="--set",
            remedy="write table.key=value, such as --set procedure.k=10",
        )
    try:
        value = tomllib.loads(f"value = {text}")["value"]
    except (ValueError, RecursionError):
        value = text
    *tables, name = key.split(".")
    table = data
    for step in tables:
        table = table.setdefault(step, {})
        if not isinstance(table, dict):
            raise UsageError(
                f"{step} is a value, not a table", where=f"--set {override}", remedy=REMEDY
            )
    table[name] = value
    for pair in ALTERNATIVES:
        if key in pair:
            table.pop(next(other for other in pair if other != key).rpartition(".")[2], None)
    if key == TOLERANCE_KEY:
        for other in JUMP_KEYS:
            table.pop(other.rpartition(".")[2], None)
    return key


def _schedule_spelled_out(data: dict[str, Any]) -> Iterator[Problem]:
    """Put the cycles of each jump in place of a procedure.h such as ``"5 growing"``.

    What can not be so is told, and stands as one jump while the other keys are looked at.
    """
    procedure = data.get("procedure")
    words = procedure.get("h") if isinstance(procedure, dict) else None
    if not isinstance(procedure, dict) or not isinstance(words, str):
        return
    procedure["h"] = [1]
    found = re.fullmatch(r"\s*([1-9]\d{0,3}) growing( jumps?)?\s*", words)
    if found is None:
        yield Problem(
            "procedure.h", f'must be cycles, a list of them, or as "5 growing", not {words!r:.60}'
        )
        return
    defaults = {"healing_cycles": Procedure.model_fields["healing_cycles"].default}
    numbers = [
        (defaults | procedure).get(key) for key in ("total_cycles", "k_i", "k", "healing_cycles")
    ]
    if any(type(number) is not int or number < 0 for number in numbers):
        return  # these keys have problems of their own
    last, k_i, window, healing = (int(number or 0) for number in numbers)
    try:
        procedure["h"] = jump_lengths(int(found[1]), last, max(k_i, 1), window, healing)
    except ValueError:
        yield Problem(
            "procedure.h",
            f"{found[1]} growing jumps from cycle {k_i + window} to {last} leave the first no "
            f"cycle beside {healing} of healing and {window} of its window: fewer, or a shorter k",
        )


def _problems(data: dict[str, Any], errors: Sequence[ErrorDetails]) -> list[Problem]:
    single = [error for error in errors if error["loc"]]
    problems = [_problem(error) for error in single]
    invalid = [problem.key for problem in problems]
    values = _defaults(Scene, data) | flat_keys(data)
    return problems + scene_problems(values, invalid)


def _problem(error: ErrorDetails) -> Problem:
    names = [str(name) for name in error["loc"] if not isinstance(name, int)]
    key = ".".join(names)
    if error["type"] == "extra_forbidden":
        return Problem(key, "unknown key" + did_you_mean(names[-1], _known_keys(names[:-1])))
    if error["type"] == "missing":
        return Problem(key, "missing")
    value = f", not {error['input']!r:.60}"
    if error["type"] == "literal_error":
        known = re.findall(r"'([^']*)'", str(error["ctx"]["expected"]))
        near = did_you_mean(error["input"], known) if isinstance(error["input"], str) else ""
        return Problem(key, f"must be {error['ctx']['expected']}{value}{near}")
    if error["type"] in ("model_type", "model_attributes_type"):
        return Problem(key, f"must be a table{value}")
    if error["type"] in BOUNDS:
        name, words = BOUNDS[error["type"]]
        return Problem(key, f"must be {words} {error['ctx'][name]:.6g}{value}")
    return Problem(key, error["msg"].replace("Input should", "must") + value)


def _table_model(model: type[BaseModel], name: str) -> type[BaseModel] | None:
    """The model of table ``name`` inside ``model``; None when that is a value."""
    annotation = model.model_fields[name].annotation
    for option in (annotation, *getattr(annotation, "__args__", ())):
        if isinstance(option, type) and issubclass(option, BaseModel):
            return option
    return None


def _known_keys(tables: Sequence[str]) -> list[str]:
    model: type[BaseModel] | None = Scene
    for name in tables:
        model = model and _table_model(model, name)
    return list(model.model_fields) if model else []


def _defaults(model: type[BaseModel], table: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """Defaults of the tables that ``table`` has, by dotted key; None counts as absent."""
    values: dict[str, Any] = {}
    for name, field in model.model_fields.items():
        inner, inner_model = table.get(name), _table_model(model, name)
        if inner_model and isinstance(inner, dict):
            values |= _defaults(inner_model, inner, f"{prefix}{name}.")
        elif not field.is_required() and field.default is not None:
            values[prefix + name] = field.default
    return values


def _report(problems: Sequence[Problem], places: dict[str, str], path: Path) -> str:
    """All problems, in the order of the file."""
    order = {place: index for index, place in enumerate(places.values())}
    entries = []
    for problem in problems:
        place = _place(problem.key, places, path)
        text = f"  {problem.where or place}: {problem.key}: {problem.what}"
        entries.append((order.get(place, -1), text))
    head = "1 problem" if len(entries) == 1 else f"{len(entries)} problems"
    return "\n".join([head, *(text for _, text in sorted(entries))])


def _place(key: str, places: dict[str, str], path: Path) -> str:
    """File and line of a key, or of the nearest table around it."""
    while key:
        if key in places:
            return places[key]
        key = key.rpartition(".")[0]
    return str(path)
