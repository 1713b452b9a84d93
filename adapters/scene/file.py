"""Settlement scene files: TOML to `Scene`, with every problem at once."""

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from adapters.scene import checks
from adapters.scene.mechanics import DOUBTFUL
from adapters.scene.procedures import fill_procedure, schedule_jumps
from adapters.scene.tables import Procedure, Scene
from adapters.scene.values import flatten_keys
from trackbed.scene_files import Guide, Problem, find_model, read_scene

GUIDE = Guide("karrech", "procedure.k=10")


def load_scene(path: Path | str, overrides: Sequence[str] = ()) -> Scene:
    """Read and check a scene file.

    ``overrides`` such as ``procedure.k=10`` replace or add keys, their values in TOML (a bare word
    is a string); an override of one of two alternative keys removes the other, one of
    procedure.tolerance k, h and another name, one of procedure.name all but total_cycles and
    members, one of sample.state what that has by itself.  Keys that follow from the procedure's
    name are put in (`adapters.scene.procedures`).  A relative path of a load series counts from
    the scene file's folder.

    Raises `UsageError` when the file or an override can not be read, `SceneError` with all that is
    wrong: file, line, dotted key and sentence of each.
    """
    text = read_scene(path, overrides, guide=GUIDE, after_override=_drop_alternatives)
    text.convert_numbers(Scene)
    data = text.data
    tables = {name: value for name, value in data.items() if isinstance(value, dict)}
    loading, sample, engine = (tables.get(name, {}) for name in ("loading", "sample", "engine"))
    if isinstance(loading.get("series"), str):
        loading["series"] = str(text.path.parent.absolute() / loading["series"])
    if isinstance(sample.get("state"), str):
        sample["state"] = str(text.path.parent.absolute() / sample["state"])
    if str(sample.get("form")).endswith(".toml"):
        sample["form"] = str(text.path.parent.absolute() / str(sample["form"]))
    if "procedure" in tables:
        data["procedure"] = fill_procedure(tables["procedure"])
    if engine.get("rayleigh_share") == "fast":
        engine["rayleigh_share"] = DOUBTFUL.rayleigh_share
    problems = list(expand_schedule(data))
    text.check(Scene)
    if text.problems:
        problems += [problem for problem in text.problems if problem.key]
        invalid = [re.sub(r"\.\d+(?=\.|$)", "", problem.key) for problem in problems]
        problems += checks.find_problems(_list_defaults(Scene, data) | flatten_keys(data), invalid)
    text.refuse(problems)
    return Scene.model_validate(data)


def _drop_alternatives(data: dict[str, Any], key: str) -> None:
    """Remove what an override of ``key`` stands instead of."""
    if key == "procedure.name":
        kept = ("name", "total_cycles", "members")
        data["procedure"] = {k: v for k, v in data["procedure"].items() if k in kept}
    if key == checks.TOLERANCE_KEY and "name" in data["procedure"]:
        data["procedure"] = {**data["procedure"], "name": "tolerance"}
    pairs = [pair for pair in checks.ALTERNATIVES if key in pair]
    whole = {checks.TOLERANCE_KEY: checks.JUMP_KEYS, checks.STATE_KEY: checks.STATE_HAS}
    others = [other for pair in (*pairs, whole.get(key, ())) for other in pair if other != key]
    for other in others:
        *tables, name = other.split(".")
        table = data
        for step in tables:
            table = table[step]
        table.pop(name, None)


def expand_schedule(data: dict[str, Any]) -> Iterator[Problem]:
    """Put the cycles of each jump in place of a procedure.h such as ``"5 growing"``.

    What can not be so is a problem, and stands as one jump while the other keys are looked at.
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
        procedure["h"] = schedule_jumps(int(found[1]), last, max(k_i, 1), window, healing)
    except ValueError:
        yield Problem(
            "procedure.h",
            f"{found[1]} growing jumps from cycle {k_i + window} to {last} leave the first no "
            f"cycle beside {healing} of healing and {window} of its window: fewer, or a shorter k",
        )


def _list_defaults(
    model: type[BaseModel], table: dict[str, Any], prefix: str = ""
) -> dict[str, Any]:
    """Defaults of the tables that ``table`` has, by dotted key; None counts as absent."""
    values: dict[str, Any] = {}
    for name, field in model.model_fields.items():
        inner, inner_model = table.get(name), find_model(field.annotation)
        if inner_model and isinstance(inner, dict):
            values |= _list_defaults(inner_model, inner, f"{prefix}{name}.")
        elif not field.is_required() and field.default is not None:
            values[prefix + name] = field.default
    return values
