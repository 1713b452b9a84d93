"""What the keys of a scene demand of one another; `adapters.scene.mechanics` has their numbers.

A check reads the scene as dotted keys.  It is skipped when a key it asks for is not valid in
itself, so that one wrong key never hides what is wrong elsewhere.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from functools import partial
from itertools import pairwise
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from adapters import laws, moves
from adapters.bed import RadiusDistribution
from adapters.bed.stones import SPHERE, find_form
from adapters.errors import DumpError, SceneError, UsageError
from adapters.files import read_load_series
from adapters.scene import mechanics
from adapters.scene.ballast import read_stored_bed
from adapters.scene.porosity import find_middle
from adapters.scene.values import (
    Check,
    NotValid,
    Values,
    find_geometry,
    find_named_form,
    find_radii,
)
from trackbed.choices import explain_retired, find_choices
from trackbed.scene_files import Problem, describe_error, suggest_word

ALTERNATIVES = (
    ("sample.count", "sample.fill_height"),
    ("material.grain.viscous_alpha", "material.grain.restitution"),
    ("engine.rayleigh_share", "engine.time_step"),
    ("sample.grain_radius", "sample.grading"),
)
"""Pairs of keys of which a scene gives exactly one."""
STATE_KEY, STATE_HAS = "sample.state", tuple(
    f"sample.{key}" for key in ("count", "fill_height", "grain_radius", "grading", "grading_scale")
)  # fmt: skip
"""A saved bed, and the keys of what it has by itself."""
JUMP_KEYS, TOLERANCE_KEY = ("procedure.k", "procedure.h"), "procedure.tolerance"
"""Cycles computed and jumped by hand, and what stands instead."""
OWNED = (
    (
        "sample.container",
        {"cylinder": ("radius",), "box": ("size_x", "size_y")},
        "missing: a {owner} has a {key}",
        "a {owner} has no {key}",
    ),
    (
        "loading.waveform",
        {"sine": ("amplitude", "mean", "frequency"), "series": ("series",)},
        "missing: waveform {owner!r} needs it",
        "waveform {owner!r} does not use it",
    ),
)
"""A key, keys of its table that only one of its words has, what to say where they miss or are."""

CHOICES: tuple[tuple[str, str, Callable[[], Iterable[str]], Mapping[str, str]], ...] = (
    # engines are looked for by name, as their room imports the scene
    ("engine.name", "engine", lambda: ("auto", *find_choices("adapters.engines", "ENGINE")), {}),
    ("procedure.law", "law", laws.list_laws, laws.RETIRED),
    ("procedure.move", "way", moves.list_moves, moves.RETIRED),
)
"""Keys whose word is a name, what that names, the names that there are, and those that left."""

STONE_ENGINES = ("liggghts",)
"""Engines whose grains may be stones of several spheres."""
MPI_STARTERS = {"mpirun", "mpiexec", "mpiexec.hydra", "orterun", "srun"}
"""Programs that start the program behind them several times."""


def _check_alternatives(scene: Values) -> Iterator[Problem]:
    for first, second in ALTERNATIVES:
        given = [key for key in (first, second) if scene.has(key)]
        name = second.rpartition(".")[2]
        if not given and not (first in STATE_HAS and scene.has(STATE_KEY)):
            yield Problem(first, f"missing: give this or {name}")
        elif len(given) == 2:
            yield Problem(first, f"give this or {name}, not both")


def _check_owned_keys(
    choice: str, owners: Mapping[str, tuple[str, ...]], missing: str, idle: str, scene: Values
) -> Iterator[Problem]:
    table = choice.partition(".")[0]
    if not scene.has_table(table):
        return
    chosen = scene.need(choice)
    for owner, names in owners.items():
        for name in names:
            given = scene.has(f"{table}.{name}")
            if given != (owner == chosen):
                said = idle if given else missing
                yield Problem(f"{table}.{name}", said.format(owner=chosen, key=name))


def _check_symmetry(scene: Values) -> Iterator[Problem]:
    planes = scene.get("sample.symmetry") or ()
    if len(set(planes)) != len(planes):
        yield Problem("sample.symmetry", "each mirror plane only once")


def _check_grain_radius(scene: Values) -> Iterator[Problem]:
    radii = find_radii(scene)
    if not isinstance(radii, RadiusDistribution) or scene.has(STATE_KEY):
        return
    key = "sample.grain_radius.standard_deviation"
    if radii.name == "constant" and radii.standard_deviation > 0:
        yield Problem(key, "constant radii have no standard deviation")
    elif radii.name != "constant" and radii.standard_deviation == 0:
        yield Problem(key, f"a {radii.name} distribution needs one above zero")
    elif radii.smallest <= 0:
        yield Problem(key, f"too wide: the smallest radius would be {radii.smallest:g} m")


def _check_grading_scale(scene: Values) -> Iterator[Problem]:
    if scene.has("sample.grading_scale") and not scene.has("sample.grading"):
        yield Problem("sample.grading_scale", "there is no sample.grading to scale")


def _check_stored_bed(scene: Values) -> Iterator[Problem]:
    if not scene.has(STATE_KEY):
        return
    for key in (*STATE_HAS, "sample.form"):
        if scene.has(key):
            yield Problem(key, "a saved bed has its own grains, spheres: leave it or state out")
    for key, default in (("seed", 1), ("relative_density_start", 0.05)):
        if scene.need(f"sample.{key}") != default:
            yield Problem(f"sample.{key}", "nothing is drawn for a saved bed: leave it out")
    try:
        if read_stored_bed(scene.need(STATE_KEY)).orientation is not None:
            yield Problem(STATE_KEY, "is a bed of stones: spheres alone can be taken over so far")
    except (UsageError, DumpError) as error:
        yield Problem(STATE_KEY, describe_error(error), error.where)
    except OSError as error:
        yield Problem(STATE_KEY, f"cannot be read ({error.strerror}): {scene.need(STATE_KEY)}")


def _check_rain(scene: Values) -> Iterator[Problem]:
    if scene.need("sample.rain_friction") > (most := scene.need("material.grain.friction")):
        yield Problem("sample.rain_friction", f"must be at most the grains' friction, {most:g}")


def _check_porosity(scene: Values) -> Iterator[Problem]:
    key = "sample.porosity"
    if not scene.has(key):
        return
    grain, height = 2 * find_radii(scene).mean, scene.get("sample.fill_height") or inf
    if find_named_form(scene) is not SPHERE:
        yield Problem(key, "is reached by taps of spheres alone so far: leave it out")
    elif find_middle(find_geometry(scene), grain, height) is None:
        yield Problem(
            key, "is measured a mean grain inside all sides, where this bed is less than two wide: "
            f"give a larger one (a mean grain is {grain:.3g} m)"
        )  # fmt: skip


def _check_rolling(scene: Values) -> Iterator[Problem]:
    grain, wall = (scene.get(f"material.{one}.rolling_friction") for one in ("grain", "wall"))
    key = f"material.{'grain' if grain else 'wall'}.rolling_friction"
    if (grain or wall) and not scene.need("material.grain.friction"):
        yield Problem(key, "grains without friction slip in place of rolling: give them friction")


def _check_series(scene: Values) -> Iterator[Problem]:
    try:
        read_load_series(Path(scene.need("loading.series")))
    except SceneError as error:
        yield Problem("loading.series", error.what, error.where)


def _check_partial_piston(scene: Values) -> Iterator[Problem]:
    box = scene.need("sample.container") == "box"
    if scene.need("loading.area_share") < 1 and box:
        said = "a disc on a part of the section needs a cylinder; a box takes loading.footprint"
        yield Problem("loading.area_share", said)
    lengths = scene.get("loading.footprint")
    sizes = [scene.need(f"sample.size_{axis}") for axis in "xy"] if box else [0.0, 0.0]
    if lengths and np.greater(lengths, sizes).any():
        have = f"this one is {sizes[0]:g} m by {sizes[1]:g} m" if box else "not a cylinder"
        yield Problem("loading.footprint", f"needs a box that holds it, {have}")


def _check_crib(scene: Values) -> Iterator[Problem]:
    key = "loading.crib"
    if not scene.has(key):
        return
    lengths = scene.get("loading.footprint")
    sizes = [scene.get(f"sample.size_{axis}") or 0.0 for axis in "xy"]
    if not lengths:
        yield Problem(key, "is the height of ballast beside a block: give loading.footprint")
    elif np.subtract(sizes, lengths).max() < 2 * find_radii(scene).mean:
        yield Problem(key, "no grain has room beside this block: leave it out")
    if find_named_form(scene) is not SPHERE:
        yield Problem(key, "lies on spheres alone so far: leave it out")
    if scene.get("procedure.relaxation") == "karrech2007":
        yield Problem(key, "eq. 29 knows no weight of it: another procedure.relaxation")


def _check_stages(scene: Values) -> Iterator[Problem]:
    key, stages = "loading.stage", scene.need("loading.stage")
    begins = [0, *(one["from_cycle"] for one in stages), scene.need("procedure.total_cycles")]
    if any(after <= before for before, after in pairwise(begins)):
        yield Problem(key, f"from_cycle must grow, to below total_cycles = {begins[-1]}")
    if scene.need("loading.waveform") != "sine":
        yield Problem(key, "follows a sine, not a series")
    if scene.has(TOLERANCE_KEY) or scene.get("procedure.settlement") != "history":
        yield Problem(key, 'jumps by history alone know when a load began: name = "growing"')
    elif scene.get("procedure.name") is None and scene.need("procedure.k_i") >= begins[1]:
        yield Problem(key, f"from_cycle must be above k_i = {scene.need('procedure.k_i')}")


def _check_procedure(scene: Values) -> Iterator[Problem]:
    if scene.has_table("procedure") and not scene.has_table("loading"):
        yield Problem("procedure", "there are no cycles without a loading table")
    first, total = scene.need("procedure.k_i"), scene.need("procedure.total_cycles")
    if total <= first:
        yield Problem("procedure.total_cycles", f"must exceed k_i = {first}, is {total}")


def _check_jumps(scene: Values) -> Iterator[Problem]:
    """Either k and h, or a tolerance by which they choose themselves."""
    if not scene.has_table("procedure"):
        return
    given = [key for key in JUMP_KEYS if scene.has(key)]
    if scene.has(TOLERANCE_KEY):
        for key in given:
            name = key.rpartition(".")[2]
            yield Problem(key, f"with a tolerance {name} chooses itself: give one of the two")
    else:
        for key in JUMP_KEYS:
            if key not in given:
                yield Problem(key, "missing: give k and h, or a tolerance instead of both")


def _check_settlement(scene: Values) -> Iterator[Problem]:
    if not scene.has_table("procedure") or scene.need("procedure.settlement") == "law":
        return
    key = "procedure.settlement"
    if scene.has(TOLERANCE_KEY):
        yield Problem(key, "with a tolerance jumps forecast the settlement: leave this out")
    if scene.need("procedure.move") == "still":
        yield Problem(key, "move 'still' moves nothing, so no settlement: leave one of them out")


def _check_seating(scene: Values) -> Iterator[Problem]:
    key = "procedure.seating_cycles"
    if scene.has(key) and scene.get("procedure.seating") in (None, "any"):
        yield Problem(key, 'only a run that waits for its piston counts them: seating = "waits"')
    elif scene.has(key) and scene.need(key) >= scene.need("procedure.total_cycles"):
        yield Problem(key, "with no fewer than total_cycles a run that waits never jumps")


def _check_form(scene: Values) -> Iterator[Problem]:
    """Stones want an engine that carries them, and what is known to be right for them in a jump."""
    try:
        if find_form(scene.get("sample.form")) is SPHERE:
            return
    except SceneError as error:
        yield Problem("sample.form", describe_error(error), error.where)
    engine = scene.need("engine.name")
    if engine not in ("auto", *STONE_ENGINES):
        yield Problem("engine.name", f"{engine} carries no stones yet: {STONE_ENGINES[0]} does")
    for key in ("material.grain.rolling_friction", "material.wall.rolling_friction"):
        if scene.has(key):
            yield Problem(key, "it stands for the form of stones, which these have: leave it out")
    if scene.has_table("procedure") and scene.need("procedure.relaxation") == "karrech2007":
        yield Problem("procedure.relaxation", 'eq. 29 is for spheres: leave it out, or "none"')


def _check_launcher(scene: Values) -> Iterator[Problem]:
    words = [Path(word).name for word in scene.get("engine.launcher") or ()]
    if scene.need("engine.name") == "yade" and set(words) & MPI_STARTERS:
        yield Problem(
            "engine.launcher", "YADE runs in one process: several would write the same files"
        )


def _check_choice(
    key: str, what: str, list_known: Callable[[], Iterable[str]], retired: Mapping[str, str],
    scene: Values,
) -> Iterator[Problem]:  # fmt: skip
    name, known = scene.need(key), tuple(list_known())
    if name not in known:
        hint = explain_retired(name, retired) or suggest_word(name, known)
        yield Problem(key, f"unknown {what} {name!r}{hint}")


def _check_relaxation(scene: Values) -> Iterator[Problem]:
    key, usual = "procedure.relaxation", ("smallest-move", "none")
    if scene.need(key) not in usual:
        from adapters.relaxation import METHODS, RETIRED  # loads the compiler

        yield from _check_choice(key, "relaxation", lambda: (*METHODS, "none"), RETIRED, scene)


CHECKS: tuple[Check, ...] = (
    _check_alternatives, *(partial(_check_owned_keys, *row) for row in OWNED), _check_symmetry,
    _check_grain_radius, _check_grading_scale, _check_stored_bed, _check_rain,
    _check_porosity, _check_rolling, _check_form, _check_series, _check_partial_piston, _check_crib,
    _check_stages, _check_procedure, _check_jumps, _check_settlement, _check_seating,
    _check_launcher,
    *(partial(_check_choice, *row) for row in CHOICES), _check_relaxation, *mechanics.CHECKS,
)  # fmt: skip


def find_problems(values: Mapping[str, Any], invalid: Iterable[str] = ()) -> list[Problem]:
    """All that is wrong between the keys of a scene.

    ``values`` by dotted key, defaults included; ``invalid`` names keys and tables that are not
    valid in themselves.
    """
    scene = Values(values, invalid)
    found = _run_checks(CHECKS, scene)
    return found + _run_checks(mechanics.IMPLAUSIBLE, scene) if found else []  # maybe the cause


def find_warnings(values: Mapping[str, Any]) -> list[Problem]:
    """All that is doubtful in a valid scene; ``values`` by dotted key, defaults included."""
    return _run_checks(mechanics.DOUBTS, Values(values, ()))


def _run_checks(checks: Iterable[Check], scene: Values) -> list[Problem]:
    problems: list[Problem] = []
    for check in checks:
        with suppress(NotValid):
            problems.extend(check(scene))
    return problems
