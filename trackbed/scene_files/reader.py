"""Scene files: TOML to tables, with every problem at once, each with its line and key.

A story gives its model (pydantic, with tables of `trackbed.scene_files.Table`) and a `Guide`
to its example; `read_scene` reads the text and `SceneText.check` the tables.
"""

import re
import shlex
import tomllib
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from difflib import get_close_matches
from functools import cached_property
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from trackbed.errors import SceneError, TrackbedError, UsageError
from trackbed.run_verbs import KINDS, find_kind, find_scene_kind
from trackbed.scene_files.lines import find_key_lines
from trackbed.scene_files.types import NAME_PATTERN, find_model
from trackbed.scene_files.units import convert_table
from trackbed.scenes import find_scene_verb

SAID = {
    "missing": "missing", "string_too_short": "must not be empty",
    "string_type": "must be a text{value}", "model_type": "must be a table{value}",
    "model_attributes_type": "must be a table{value}",
    "greater_than": "must be above {gt:.6g}{value}", "less_than": "must be below {lt:.6g}{value}",
    "greater_than_equal": "must be at least {ge:.6g}{value}",
    "less_than_equal": "must be at most {le:.6g}{value}",
}  # fmt: skip
"""What to say of types of pydantic's errors, with the value and the names in their context."""
HARDLY = 1e-12
"""A least value up to this stands for "above zero"."""
LONGEST = 1 << 24
"""Most bytes of a scene file."""
NO_SCENES = {
    "stl obj ply vtk vtu msh mesh inp": 'a scene names it: [[stones]] of rigid by mesh = "PATH",'
    ' [[body]] of qdem by mesh = { file = "PATH" }; trackbed stone PATH packs spheres into it',
    "csv": "trackbed fit PATH reads a series of settlement; a scene names that of a load",
    "npz dump lammpstrj vtkhdf": "trackbed relax PATH reads a state, trackbed fit a series of them",
}
"""Endings of files that are no scenes, and what to do with one."""


@dataclass(frozen=True)
class Problem:
    """What is wrong with a key."""

    key: str  # dotted key; entries of a list by their number from 0, as in ``load.0.force``
    what: str  # one sentence
    where: str = ""  # file and line where that is not the scene file


@dataclass(frozen=True)
class Guide:
    """Where a user finds what a scene of this kind may hold."""

    example: str  # name of the example scene that explains every key
    override: str  # an override that makes sense, such as ``procedure.k=10``

    @property
    def copy(self) -> str:
        """How to get the example."""
        return f"trackbed new {self.example} FOLDER writes one that explains every key"


@dataclass
class SceneText:
    """A scene file as read: its tables, and what is wrong with single keys."""

    path: Path
    text: str
    data: dict[str, Any]
    guide: Guide
    overrides: dict[str, str] = field(default_factory=dict)
    """Dotted key -> the override that set it."""
    tables: dict[str, Any] = field(default_factory=dict)
    """Dotted key -> each valid table of the model, such as ``body.0`` and ``simulation``."""
    problems: list[Problem] = field(default_factory=list)

    @cached_property
    def places(self) -> dict[str, str]:
        """Dotted key -> where it stands."""
        places = {key: f"{self.path}:{line}" for key, line in find_key_lines(self.text).items()}
        for key, override in self.overrides.items():
            places = {k: place for k, place in places.items() if not f"{k}.".startswith(f"{key}.")}
            for end in (found.start() for found in re.finditer(r"\.", key)):
                places.setdefault(key[:end], f"--set {override}")
            places[key] = f"--set {override}"
        return places

    def check(self, model: type[BaseModel]) -> None:
        """Check every table by itself: fills ``tables`` and ``problems``.

        Raises `SceneError` for a scene of another verb, known by a table that ``model`` has not.
        """
        given = find_scene_kind(self.data)
        if given and not any(
            kind.table in model.model_fields for kind in KINDS if kind.table in self.data
        ):
            own = find_scene_verb(self.guide.example)
            raise SceneError(
                f"this is a scene of the verb {given.verb}, not of {own}", where=str(self.path),
                remedy=f"trackbed {given.verb} {shlex.quote(str(self.path))}",
            )  # fmt: skip
        self.convert_numbers(model)
        for name, definition in model.model_fields.items():
            value, inner = self.data.get(name), find_model(definition.annotation)
            entries = {name: value}
            if isinstance(value, list):
                entries = {f"{name}.{index}": entry for index, entry in enumerate(value)}
            if inner is None:
                continue
            for key, entry in entries.items():
                with suppress(ValidationError):
                    self.tables[key] = inner.model_validate(entry)
        explained = {problem.key for problem in self.problems}
        try:
            model.model_validate(self.data)
        except ValidationError as error:
            for one in error.errors(include_url=False):
                short = one["type"] == "too_short"  # maybe only as its entries have faults
                problem = _explain(model, one)
                if problem.key in explained or (
                    short and len(one["input"]) >= one["ctx"]["min_length"]
                ):
                    continue
                self.problems.append(problem)

    def convert_numbers(self, model: type[BaseModel]) -> None:
        """Numbers as people write them, ``"50 Hz"`` and a count of 1e5, as the model wants them."""
        self.problems += [Problem(key, what) for key, what in convert_table(self.data, model)]

    def refuse(self, problems: Iterable[Problem]) -> None:
        """Raise `SceneError` with all problems, in the order of the file, if there are any."""
        unique = list(dict.fromkeys(problems))
        if not unique:
            return
        order = {place: index for index, place in enumerate(self.places.values())}
        entries = []
        for problem in unique:
            place = self._find_place(problem.key)
            line = f"  {problem.where or place}: {problem.key or 'scene'}: {problem.what}"
            entries.append((order.get(place, -1), line))
        head = "1 problem" if len(entries) == 1 else f"{len(entries)} problems"
        raise SceneError(
            "\n".join([head, *(line for _, line in sorted(entries))]),
            where=str(self.path),
            remedy=f"correct these keys; {self.guide.copy}",
        )

    def _find_place(self, key: str) -> str:
        """File and line of a key, or of the nearest table around it."""
        while key:
            if key in self.places:
                return self.places[key]
            key = key.rpartition(".")[0]
        return str(self.path)


def read_scene(
    path: Path | str, overrides: Sequence[str] = (), *, guide: Guide,
    after_override: Callable[[dict[str, Any], str], None] | None = None,
) -> SceneText:  # fmt: skip
    """Read a scene file; its tables are not checked yet.

    ``overrides`` such as ``simulation.duration=0.1``, ``load.0.force=[0, 0, -1]`` or
    ``body.beam.material.young=1e9`` replace or add keys; values in TOML, a bare word is a string.
    ``after_override`` is called with the tables and the dotted key that was set.

    Raises `UsageError` when the file or an override can not be read, `SceneError` for no TOML.
    """
    path = Path(path)
    text = _read_text(path, guide)
    try:
        data = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise _refuse_syntax(path, text, error) from error
    scene = SceneText(path, text, data, guide)
    for override in overrides:
        key = _set_key(data, override, guide)
        scene.overrides[key] = override
        if after_override is not None:
            after_override(data, key)
    return scene


def describe_error(error: TrackbedError) -> str:
    """An error as the problem of a key says it: what, and what to do."""
    return error.what + (f" ({error.remedy})" if error.remedy else "")


def suggest_word(word: str, known: Iterable[str]) -> str:
    """``; did you mean X?`` for the nearest of the known words, or what they are."""
    known = sorted(known)
    near = get_close_matches(word.lower(), known, n=1, cutoff=0.6)
    if near:
        return f"; did you mean {near[0]}?"
    return f"; known: {', '.join(known[:20])}" if known else ""


def _explain(model: type[BaseModel], error: ErrorDetails) -> Problem:
    """What pydantic found, as one sentence about a key of ``model``."""
    names = [str(name) for name in error["loc"] if not str(name).startswith("#")]
    key = ".".join(names)
    kind, context = error["type"], error.get("ctx", {})
    value = f", not {_show(error['input'])}"
    if kind == "extra_forbidden":
        what = "unknown key" + suggest_word(names[-1], _list_keys(model, names[:-1]))
    elif kind == "literal_error":
        known = re.findall(r"'([^']*)'", str(context["expected"]))
        near = suggest_word(error["input"], known) if isinstance(error["input"], str) else ""
        what = f"must be {context['expected']}{value}{near}"
    elif kind == "greater_than_equal" and 0 < context["ge"] <= HARDLY:
        what = f"must be above 0 (and at least {context['ge']:g}){value}"
    elif kind in ("tuple_type", "list_type", "too_short"):
        tables = len(names) == 1 and find_model(model.model_fields[names[0]].annotation)
        what = f"write [[{key}]] tables{value}" if tables else f"must be a list in [...]{value}"
        if kind == "too_short" and not tables:
            what = f"must have at least {context['min_length']} entries{value}"
    elif kind == "too_long":
        most = "" if context["field_type"] == "Tuple" else "at most "
        what = f"must have {most}{context['max_length']} entries{value}"
    elif kind == "string_pattern_mismatch" and context["pattern"] == NAME_PATTERN:
        key = key.removesuffix(".[key]")
        what = f"a name has 1 to 60 letters, digits and _ . + -{value}"
    elif kind in SAID:
        what = SAID[kind].format(value=value, **context)
    elif kind == "value_error":
        what = error["msg"].removeprefix("Value error, ")
    else:
        what = error["msg"].replace("Input should", "must") + value
    return Problem(key, what)


def _show(value: object) -> str:
    try:
        return f"{value!r:.60}"
    except ValueError:  # an integer of too many digits
        return "this number"


def _list_keys(model: type[BaseModel], names: Sequence[str]) -> list[str]:
    """Keys that the table at ``names`` inside ``model`` knows."""
    inner: type[BaseModel] | None = model
    for name in names:
        if inner is None:
            break
        if name in inner.model_fields:
            inner = find_model(inner.model_fields[name].annotation)
    return list(inner.model_fields) if inner else []


def _read_text(path: Path, guide: Guide) -> str:
    remedy = _advise_use(path, f"give a scene file; {guide.copy}")
    try:
        with path.open("rb") as stream:  # which may be a pipe, or a device without an end
            data = stream.read(LONGEST + 1)
        if len(data) > LONGEST:
            raise UsageError(
                f"can not read the scene (it is longer than {LONGEST >> 20} MiB)",
                where=str(path), remedy=remedy,
            )  # fmt: skip
        return data.decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")
    except UnicodeDecodeError as error:
        raise SceneError(
            f"this is not a text file (byte {error.start})", where=str(path), remedy=remedy
        ) from error
    except (OSError, ValueError) as error:  # ValueError: a null byte in the path
        reason = getattr(error, "strerror", None) or str(error)
        raise UsageError(
            f"can not read the scene ({reason})", where=str(path), remedy=remedy
        ) from error


def _refuse_syntax(path: Path, text: str, error: Exception) -> SceneError:
    found = re.search(r"line (\d+)", str(error))
    line = int(found[1]) if found else text.count("\n") + 1
    source = text.split("\n")[line - 1].strip()
    reason = "nested too deeply" if isinstance(error, RecursionError) else str(error)
    return SceneError(
        f"this is not TOML: {reason}\n  {source:.200}",
        where=f"{path}:{line}",
        remedy=_advise_use(path, 'one key = value a line, strings in "quotes"; see toml.io'),
    )


def _advise_use(path: Path, otherwise: str) -> str:
    """What to do with a run folder, or a file with an ending of no scene; else ``otherwise``."""
    use = "trackbed status PATH says how far this run is; its scene is in there"
    if not find_kind(path):
        end = path.suffix.lower()[1:]
        use = next((use for ends, use in NO_SCENES.items() if end in ends.split()), otherwise)
    return use.replace("PATH", shlex.quote(str(path)))


def _set_key(data: dict[str, Any], override: str, guide: Guide) -> str:
    """Set ``key=value`` in ``data``; the dotted key, entries of lists by number."""
    key, equals, text = (part.strip() for part in override.partition("="))
    if not equals or not all(re.fullmatch(r"[\w+-]+", name) for name in key.split(".")):
        raise UsageError(
            f"can not read the override {override!r}",
            where="--set",
            remedy=f"write table.key=value, such as --set {guide.override}",
        )
    try:
        value = tomllib.loads(f"value = {text}")["value"]
    except (ValueError, RecursionError):
        value = text
    table: Any = data
    *steps, last = key.split(".")
    path = []
    for step in steps:
        place = _find_entry(table, step, override, guide)
        path.append(str(place))
        table = table.setdefault(step, {}) if isinstance(table, dict) else table[place]
    place = _find_entry(table, last, override, guide)
    table[place] = value
    return ".".join([*path, str(place)])


def _find_entry(table: Any, step: str, override: str, guide: Guide) -> str | int:
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
    raise UsageError(what, where=f"--set {override}", remedy=guide.copy)
