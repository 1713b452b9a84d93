"""Scene files: TOML to tables, with every problem at once, each with its line and key."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from functools import cached_property
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from qdem_fem.errors import QdemError, SceneError, UsageError
from qdem_fem.scene import Scene
from qdem_fem.scene_lines import key_lines
from qdem_fem.scene_types import LEAST, NAME_PATTERN

REMEDY = "correct these keys; scenes/cantilever.toml explains every key"
TRACK_REMEDY = "correct these keys; scenes/track-small.toml explains those of a track"
NAME_WORDS = "a name has 1 to 60 letters, digits and _ . + -"

BOUNDS = {
    "greater_than": ("gt", "above"),
    "greater_than_equal": ("ge", "at least"),
    "less_than": ("lt", "below"),
    "less_than_equal": ("le", "at most"),
}
"""Types of pydantic's errors: name of the bound in their context, and its words."""


@dataclass(frozen=True)
class Problem:
    """What is wrong with a key."""

    key: str
    """Dotted key; entries of a list by their number from 0, as in ``load.0.force``."""
    what: str
    """One sentence."""
    where: str = ""
    """File and line where that is not the scene file."""


@dataclass
class SceneText:
    """A scene file as read: its tables, and what is wrong with single keys."""

    path: Path
    text: str
    data: dict[str, Any]
    overrides: dict[str, str] = field(default_factory=dict)
    """Dotted key -> the override that set it."""
    tables: dict[str, Any] = field(default_factory=dict)
    """Dotted key -> each valid table of `Scene`, such as ``body.0`` and ``simulation``."""
    problems: list[Problem] = field(default_factory=list)

    @cached_property
    def places(self) -> dict[str, str]:
        """Dotted key -> where it stands."""
        places = {key: f"{self.path}:{line}" for key, line in key_lines(self.text).items()}
        for key, override in self.overrides.items():
            places = {k: place for k, place in places.items() if not f"{k}.".startswith(f"{key}.")}
            places[key] = f"--set {override}"
        return places

    def refuse(self, problems: Iterable[Problem]) -> None:
        """Raise `SceneError` with all problems, in the order of the file, if there are any."""
        unique = list(dict.fromkeys(problems))
        if not unique:
            return
        order = {place: index for index, place in enumerate(self.places.values())}
        entries = []
        for problem in unique:
            place = self._place(problem.key)
            line = f"  {problem.where or place}: {problem.key or 'scene'}: {problem.what}"
            entries.append((order.get(place, -1), line))
        head = "1 problem" if len(entries) == 1 else f"{len(entries)} problems"
        body = "\n".join([head, *(line for _, line in sorted(entries))])
        remedy = TRACK_REMEDY if "track" in self.data else REMEDY
        raise SceneError(body, where=str(self.path), remedy=remedy)

    def _place(self, key: str) -> str:
        """File and line of a key, or of the nearest table around it."""
        while key:
            if key in self.places:
                return self.places[key]
            key = key.rpartition(".")[0]
        return str(self.path)


def scene_read(
    path: Path | str,
    overrides: Sequence[str] = (),
    model_of: Callable[[Mapping[str, Any]], type[Scene]] = lambda data: Scene,
) -> SceneText:
    """Read a scene file and check every table by itself; nothing that needs a mesh.

    ``overrides`` such as ``simulation.duration=0.1``, ``load.0.force=[0, 0, -1]`` or
    ``body.beam.material.young=1e9`` replace or add keys; values in TOML, a bare word is a string.
    ``model_of`` tells the tables that a scene may have by its data.
    What is wrong with the keys is in ``problems`` of the answer, not raised: `refuse` does.

    Raises `UsageError` when the file or an override can not be read, `SceneError` for no TOML.
    """
    path = Path(path)
    text = _text(path)
    try:
        data = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise _syntax_error(path, text, error) from error
    scene = SceneText(path, text, data)
    for override in overrides:
        scene.overrides[_override(data, override)] = override
    _tables_check(scene, model_of(data).model_fields)
    return scene


def _tables_check(scene: SceneText, known: Mapping[str, Any]) -> None:
    """Check each table on its own, so that a wrong one never hides what is wrong elsewhere."""
    data = scene.data
    for name in data:
        if name not in known:
            near = did_you_mean(name, known)
            scene.problems.append(Problem(name, f"unknown key{near}"))
    for name, definition in known.items():
        model = _model_in(definition.annotation)
        if name not in data or model is None:
            if definition.is_required():
                scene.problems.append(Problem(name, "missing"))
            elif model is None and not isinstance(data.get(name, ""), str):
                scene.problems.append(Problem(name, f"must be a text, not {_shown(data[name])}"))
            continue
        value = data[name]
        if name in ("simulation", "contact", "output", "track"):
            _table_check(scene, name, model, value)
        elif not isinstance(value, list) or (not value and definition.is_required()):
            scene.problems.append(Problem(name, f"write [[{name}]] tables, not {_shown(value)}"))
        else:
            for index, entry in enumerate(value):
                _table_check(scene, f"{name}.{index}", model, entry)


def _table_check(scene: SceneText, key: str, model: type[BaseModel], value: object) -> None:
    try:
        scene.tables[key] = model.model_validate(value)
    except ValidationError as error:
        found = error.errors(include_url=False)
        scene.problems.extend(_problem(key, model, one) for one in found)


def _problem(table: str, model: type[BaseModel], error: ErrorDetails) -> Problem:
    names = [str(name) for name in error["loc"] if not str(name).startswith("#")]
    key = ".".join([table, *names])
    kind, context = error["type"], error.get("ctx", {})
    if kind == "extra_forbidden":
        return Problem(key, "unknown key" + did_you_mean(names[-1], _known_keys(model, names[:-1])))
    if kind == "missing":
        return Problem(key, "missing")
    value = f", not {_shown(error['input'])}"
    if kind == "literal_error":
        known = re.findall(r"'([^']*)'", str(context["expected"]))
        near = did_you_mean(error["input"], known) if isinstance(error["input"], str) else ""
        return Problem(key, f"must be {context['expected']}{value}{near}")
    if kind in ("model_type", "model_attributes_type"):
        return Problem(key, f"must be a table{value}")
    if kind == "greater_than_equal" and context["ge"] == LEAST:
        return Problem(key, f"must be above 0 (and at least {LEAST:g}){value}")
    if kind == "tuple_type":
        return Problem(key, f"must be a list in [...]{value}")
    if kind == "too_long":
        return Problem(key, f"must have {context['max_length']} entries{value}")
    if kind == "string_too_short":
        return Problem(key, "must not be empty")
    if kind == "string_pattern_mismatch" and context["pattern"] == NAME_PATTERN:
        return Problem(key.removesuffix(".[key]"), f"{NAME_WORDS}{value}")
    if kind in BOUNDS:
        name, words = BOUNDS[kind]
        return Problem(key, f"must be {words} {context[name]:.6g}{value}")
    return Problem(key, error["msg"].replace("Input should", "must") + value)


def _shown(value: object) -> str:
    try:
        return f"{value!r:.60}"
    except ValueError:  # an integer of too many digits
        return "this number"


def _known_keys(model: type[BaseModel], names: Sequence[str]) -> list[str]:
    """Keys that the table at ``names`` inside ``model`` knows."""
    inner: type[BaseModel] | None = model
    for name in names:
        if inner is None:
            break
        if name in inner.model_fields:
            inner = _model_in(inner.model_fields[name].annotation)
    return list(inner.model_fields) if inner else []


def _model_in(annotation: Any) -> type[BaseModel] | None:
    """The model inside a field's type, however deep; None when there is none."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    found = (_model_in(argument) for argument in get_args(annotation))
    return next((model for model in found if model), None)


def _text(path: Path) -> str:
    remedy = "give a scene file; scenes/cantilever.toml is one to copy"
    try:
        return path.read_text(encoding="utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        raise SceneError(
            f"this is not a text file (byte {error.start})", where=str(path), remedy=remedy
        ) from error
    except (OSError, ValueError) as error:  # ValueError: a null byte in the path
        reason = getattr(error, "strerror", None) or str(error)
        raise UsageError(
            f"can not read the scene ({reason})", where=str(path), remedy=remedy
        ) from error


def _syntax_error(path: Path, text: str, error: Exception) -> SceneError:
    found = re.search(r"line (\d+)", str(error))
    line = int(found[1]) if found else text.count("\n") + 1
    source = text.split("\n")[line - 1].strip()
    reason = "nested too deeply" if isinstance(error, RecursionError) else str(error)
    return SceneError(
        f"this is not TOML: {reason}\n  {source:.200}",
        where=f"{path}:{line}",
        remedy='one key = value a line, strings in "quotes"; toml.io explains the format',
    )


def _override(data: dict[str, Any], override: str) -> str:
    """Set ``key=value`` in ``data``; the dotted key."""
    key, equals, text = (part.strip() for part in override.partition("="))
    if not equals or not all(re.fullmatch(r"[\w+-]+", name) for name in key.split(".")):
        raise UsageError(
            f"can not read the override {override!r}",
            where="--set",
            remedy="write table.key=value, such as --set simulation.duration=0.1",
        )
    try:
        value = tomllib.loads(f"value = {text}")["value"]
    except (ValueError, RecursionError):
        value = text
    table: Any = data
    *steps, last = key.split(".")
    path = []
    for step in steps:
        step_in = _step(table, step, override)
        path.append(str(step_in))
        table = table.setdefault(step, {}) if isinstance(table, dict) else table[step_in]
    last_in = _step(table, last, override)
    table[last_in] = value
    return ".".join([*path, str(last_in)])


def _step(table: Any, step: str, override: str) -> str | int:
    """Key of a table; in a list, the number of the entry that has this number or name."""
    if isinstance(table, dict):
        return step
    if isinstance(table, list):
        names = [entry.get("name") if isinstance(entry, dict) else None for entry in table]
        if step in names:
            return names.index(step)
        if step.isdecimal() and int(step) < len(table):
            return int(step)
        what = f"there is no entry {step}; there are {len(table)}, counted from 0"
    else:
        what = f"{step} lies inside a value, not a table"
    raise UsageError(what, where=f"--set {override}", remedy=REMEDY)


def error_told(error: QdemError) -> str:
    """An error as a problem of a key tells it: what, and what to do."""
    return error.what + (f" ({error.remedy})" if error.remedy else "")


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """``; did you mean X?`` for the nearest of the known words, or what they are."""
    known = sorted(known)
    near = get_close_matches(word.lower(), known, n=1, cutoff=0.6)
    if near:
        return f"; did you mean {near[0]}?"
    return f"; known: {', '.join(known[:20])}" if known else ""
