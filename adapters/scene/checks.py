"""What the keys of a scene demand of one another; `adapters.scene.mechanics` has their numbers.

A check reads the scene as dotted keys.  It is skipped when a key it asks for is not valid in
itself, so that one wrong key never hides what is wrong elsewhere.
"""

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
from adapters.scene.values import Check, NotValid, Values
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

ROLLING = ("material.grain.rolling_friction", "material.wall.rolling_friction")
"""Keys of resistance to rolling."""
STONE_ENGINES = ("liggghts",)
"""Engines whose grains may be stones of several spheres."""
MPI_STARTERS = {"mpirun", "mpiexec", "mpiexec.hydra", "orterun", "srun"}
"""Programs that start the program behind them several times."""


DEMANDS: tuple[tuple[str, Callable[[Values], Any], str], ...] = (
    ("sample.symmetry", lambda of: len({*of["sample.symmetry"]}) < len(of["sample.symmetry"]),
     "each mirror plane only once"),
    ("sample.grading_scale", lambda of: not of.has("sample.grading"),
     "there is no sample.grading to scale"),
    ("sample.rain_friction", lambda of: of["sample.rain_friction"] > of["material.grain.friction"],
     "must be at most the grains' friction, {0[material.grain.friction]:g}"),
    *((key, lambda of: not of["material.grain.friction"],
       "grains without friction slip in place of rolling: give them friction") for key in ROLLING),
    *((key, lambda of: of.form is not SPHERE,
       "it stands for the form of stones, which these have: leave it out") for key in ROLLING),
    ("sample.porosity", lambda of: of.form is not SPHERE,
     "is reached by taps of spheres alone so far: leave it out"),
    ("engine.name",
     lambda of: of["engine.name"] not in ("auto", *STONE_ENGINES) and of.form is not SPHERE,
     f"{{0[engine.name]}} carries no stones yet: {STONE_ENGINES[0]} does"),
    ("procedure.relaxation",
     lambda of: of["procedure.relaxation"] == "karrech2007" and of.form is not SPHERE,
     'eq. 29 is for spheres: leave it out, or "none"'),
    ("loading.crib", lambda of: not of.has("loading.footprint"),
     "is the height of ballast beside a block: give loading.footprint"),
    ("loading.crib", lambda of: of.form is not SPHERE,
     "lies on spheres alone so far: leave it out"),
    ("loading.crib", lambda of: of["procedure.relaxation"] == "karrech2007",
     "eq. 29 knows no weight of it: another procedure.relaxation"),
    ("loading.stage", lambda of: of["loading.waveform"] != "sine", "follows a sine, not a series"),
    ("procedure", lambda of: not of.has_table("loading"),
     "there are no cycles without a loading table"),
    ("procedure.total_cycles", lambda of: of["procedure.total_cycles"] <= of["procedure.k_i"],
     "must exceed k_i = {0[procedure.k_i]}, is {0[procedure.total_cycles]}"),
    ("procedure.settlement",
     lambda of: of["procedure.settlement"] != "law" and of.has(TOLERANCE_KEY),
     "with a tolerance jumps forecast the settlement: leave this out"),
    ("procedure.settlement",
     lambda of: of["procedure.settlement"] != "law" and of["procedure.move"] == "still",
     "move 'still' moves nothing, so no settlement: leave one of them out"),
    ("procedure.seating_cycles", lambda of: of.get("procedure.seating") in (None, "any"),
     'only a run that waits for its piston counts them: seating = "waits"'),
    ("procedure.seating_cycles",
     lambda of: of["procedure.seating"] == "waits"
     and of["procedure.seating_cycles"] >= of["procedure.total_cycles"],
     "with no fewer than total_cycles a run that waits never jumps"),
    ("engine.launcher",
     lambda of: of["engine.name"] == "yade"
     and MPI_STARTERS & {Path(word).name for word in of["engine.launcher"]},
     "YADE runs in one process: several would write the same files"),
)  # fmt: skip
"""A key or table that a scene gives, when that is wrong, and what to say; {0[...]} is a value."""


def _check_demand(
    key: str, is_wrong: Callable[[Values], Any], said: str, scene: Values
) -> Iterator[Problem]:
    if scene.has(key) and is_wrong(scene):
        yield Problem(key, said.format(scene))


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
    chosen = scene[choice]
    for owner, names in owners.items():
        for name in names:
            given = scene.has(f"{table}.{name}")
            if given != (owner == chosen):
                said = idle if given else missing
                yield Problem(f"{table}.{name}", said.format(owner=chosen, key=name))


def _check_grain_radius(scene: Values) -> Iterator[Problem]:
    radii = scene.radii
    if not isinstance(radii, RadiusDistribution) or scene.has(STATE_KEY):
        return
    key = "sample.grain_radius.standard_deviation"
    if radii.name == "constant" and radii.standard_deviation > 0:
        yield Problem(key, "constant radii have no standard deviation")
    elif radii.name != "constant" and radii.standard_deviation == 0:
        yield Problem(key, f"a {radii.name} distribution needs one above zero")
    elif radii.smallest <= 0:
        yield Problem(key, f"too wide: the smallest radius would be {radii.smallest:g} m")


def _check_stored_bed(scene: Values) -> Iterator[Problem]:
    if not scene.has(STATE_KEY):
        return
    for key in (*STATE_HAS, "sample.form"):
        if scene.has(key):
            yield Problem(key, "a saved bed has its own grains, spheres: leave it or state out")
    for key, default in (("seed", 1), ("relative_density_start", 0.05)):
        if scene[f"sample.{key}"] != default:
            yield Problem(f"sample.{key}", "nothing is drawn for a saved bed: leave it out")
    try:
        if read_stored_bed(scene[STATE_KEY]).orientation is not None:
            yield Problem(STATE_KEY, "is a bed of stones: spheres alone can be taken over so far")
    except (UsageError, DumpError) as error:
        yield Problem(STATE_KEY, describe_error(error), error.where)
    except OSError as error:
        yield Problem(STATE_KEY, f"cannot be read ({error.strerror}): {scene[STATE_KEY]}")


def _check_porosity(scene: Values) -> Iterator[Problem]:
    key = "sample.porosity"
    if not scene.has(key):
        return
    grain, height = 2 * scene.radii.mean, scene.get("sample.fill_height") or inf
    if find_middle(scene.container, grain, height) is None:
        yield Problem(
            key, "is measured a mean grain inside all sides, where this bed is less than two wide: "
            f"give a larger one (a mean grain is {grain:.3g} m)"
        )  # fmt: skip


def _check_series(scene: Values) -> Iterator[Problem]:
    try:
        read_load_series(Path(scene["loading.series"]))
    except SceneError as error:
        yield Problem("loading.series", error.what, error.where)


def _check_partial_piston(scene: Values) -> Iterator[Problem]:
    box = scene["sample.container"] == "box"
    if scene["loading.area_share"] < 1 and box:
        said = "a disc on a part of the section needs a cylinder; a box takes loading.footprint"
        yield Problem("loading.area_share", said)
    lengths = scene.get("loading.footprint")
    sizes = [scene[f"sample.size_{axis}"] for axis in "xy"] if box else [0.0, 0.0]
    if lengths and np.greater(lengths, sizes).any():
        have = f"this one is {sizes[0]:g} m by {sizes[1]:g} m" if box else "not a cylinder"
        yield Problem("loading.footprint", f"needs a box that holds it, {have}")


def _check_crib(scene: Values) -> Iterator[Problem]:
    key = "loading.crib"
    if not scene.has(key):
        return
    lengths = scene.get("loading.footprint")
    sizes = [scene.get(f"sample.size_{axis}") or 0.0 for axis in "xy"]
    if lengths and np.subtract(sizes, lengths).max() < 2 * scene.radii.mean:
        yield Problem(key, "no grain has room beside this block: leave it out")


def _check_stages(scene: Values) -> Iterator[Problem]:
    key, stages = "loading.stage", scene["loading.stage"]
    begins = [0, *(one["from_cycle"] for one in stages), scene["procedure.total_cycles"]]
    if any(after <= before for before, after in pairwise(begins)):
        yield Problem(key, f"from_cycle must grow, to below total_cycles = {begins[-1]}")
    if scene.has(TOLERANCE_KEY) or scene.get("procedure.settlement") != "history":
        yield Problem(key, 'jumps by history alone know when a load began: name = "growing"')
    elif scene.get("procedure.name") is None and scene["procedure.k_i"] >= begins[1]:
        yield Problem(key, f"from_cycle must be above k_i = {scene['procedure.k_i']}")


def _check_jumps(scene: Values) -> Iterator[Problem]:
    """Either k and h, or a tolerance by which they choose themselves."""
    for key in JUMP_KEYS if scene.has_table("procedure") else ():
        given, name = scene.has(key), key.rpartition(".")[2]
        if given and scene.has(TOLERANCE_KEY):
            yield Problem(key, f"with a tolerance {name} chooses itself: give one of the two")
        elif not given and not scene.has(TOLERANCE_KEY):
            yield Problem(key, "missing: give k and h, or a tolerance instead of both")


def _check_form(scene: Values) -> Iterator[Problem]:
    try:
        find_form(scene.get("sample.form"))
    except SceneError as error:
        yield Problem("sample.form", describe_error(error), error.where)


def _check_choice(
    key: str, what: str, list_known: Callable[[], Iterable[str]], retired: Mapping[str, str],
    scene: Values,
) -> Iterator[Problem]:  # fmt: skip
    name, known = scene[key], tuple(list_known())
    if name not in known:
        hint = explain_retired(name, retired) or suggest_word(name, known)
        yield Problem(key, f"unknown {what} {name!r}{hint}")


def _check_relaxation(scene: Values) -> Iterator[Problem]:
    key, usual = "procedure.relaxation", ("smallest-move", "none")
    if scene[key] not in usual:
        from adapters.relaxation import METHODS, RETIRED  # loads the compiler

        yield from _check_choice(key, "relaxation", lambda: (*METHODS, "none"), RETIRED, scene)


CHECKS: tuple[Check, ...] = (
    _check_alternatives, *(partial(_check_owned_keys, *row) for row in OWNED),
    *(partial(_check_demand, *row) for row in DEMANDS), _check_grain_radius, _check_stored_bed,
    _check_porosity, _check_form, _check_series, _check_partial_piston, _check_crib, _check_stages,
    _check_jumps,
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
