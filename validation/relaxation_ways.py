"""The ways to relax a jump that are compared: the project's, and what a user would do instead."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from adapters.engine import EngineStart
from adapters.errors import TrackbedError
from adapters.relaxation import Method, Relaxation, RelaxationNotConverged, relax
from adapters.relaxation_kernel import BoolArray
from adapters.scene import Scene
from adapters.scene_file import scene_load
from adapters.state import FloatArray
from scenes import scene_path
from validation.relaxation_beds import AFTER, LiveBed
from validation.relaxation_engine import (
    STYLES,
    EngineRelaxed,
    damped_from_data,
    damped_from_restart,
    minimised_by,
    stopped_because,
)
from validation.relaxation_jumps import Jumped
from validation.relaxation_measures import figures_before, measured
from validation.relaxation_rivals import MARKS, minimised

Row = dict[str, Any]

TOLERANCES: dict[Method, tuple[float, ...]] = {
    "smallest-move": (3.0, 1.0, 0.3, 0.1, 0.03, 0.01, 0.003),
    "proximal": (10.0, 1.0, 0.1, 0.01),
}
"""Relative tolerances at which the project's methods are run at paper scale."""
STEPS = (30, 100, 300, 1000, 3000, 10_000)
"""Damped steps, and iterations of an engine's minimiser."""
EVALUATIONS_MAX = MARKS[-1]
"""Of the project's energies, as of the rivals."""
POTENTIALS = ("hertz", "eq29", "eq29-free")
MINIMISERS = ("gradient", "lbfgs", "fire")


@dataclass(frozen=True)
class Relaxed:
    """What a way made of a jump: positions and cost, or a state of the engine to go on from."""

    position: FloatArray
    """Centres [m], (n, 3)."""
    cpu_s: float
    """Processor time [s]."""
    note: str = ""
    """What it says of itself."""
    start: EngineStart | None = None
    """Where the engine goes on, when it relaxed by itself; None: a resubmission."""


def own(
    jump: Jumped, method: Method, tolerance: float = 0.01, frontier: BoolArray | None = None
) -> Relaxation:
    """A method of the project; what it had reached where it does not converge.

    ``frontier`` (n,): grains that ``karrech2007`` holds; None: those at the walls.
    """
    try:
        return relax(
            jump.estimate,
            jump.before,
            jump.walls,
            jump.stiffness,
            walls_after=jump.walls_after,
            method=method,
            tolerance=tolerance,
            frontier="fixed" if frontier is None else frontier,
            evaluations_max=EVALUATIONS_MAX if method != "smallest-move" else 40_000,
        )
    except RelaxationNotConverged as error:
        return error.best


# --- at paper scale: the way there ---------------------------------------------------------------


def rough(found: dict[str, Any]) -> Row:
    """Figures with four digits, as a record keeps them."""
    return {
        key: float(f"{value:.4g}") if isinstance(value, float) else value
        for key, value in found.items()
    }


def paper_ways(jump: Jumped, work: Path) -> Iterator[tuple[str, Callable[[], Row]]]:
    """Name of each way at paper scale, and a function that gives its row: a list of points."""
    yield "before", lambda: {"points": [rough(figures_before(jump))]}
    yield "estimate", lambda: {"points": [rough(measured(jump, jump.estimate))]}
    for method in TOLERANCES:
        yield method, lambda method=method: own_points(jump, method)  # type: ignore[misc]
    for potential in POTENTIALS:
        for minimiser in MINIMISERS:
            yield (
                f"{potential} {minimiser}",
                lambda potential=potential, minimiser=minimiser: {  # type: ignore[misc]
                    "points": [
                        rough(
                            {
                                "evaluations": noted.evaluations,
                                "cpu_s": noted.cpu_s,
                                "ended": noted.ended,
                            }
                            | measured(jump, noted.position)
                        )
                        for noted in minimised(jump, potential, minimiser)
                    ]
                },
            )
    scenes = {name: scene_load(scene_path("karrech"), [f'engine.name="{name}"']) for name in STYLES}
    for recipe in ("drag", "limit"):
        yield (
            f"liggghts {recipe}",
            lambda recipe=recipe: engine_points(  # type: ignore[misc]
                jump,
                work,
                lambda steps, folder: damped_from_data(
                    scenes["liggghts"], jump, recipe, steps, folder
                ),
            ),
        )
    for style in ("quickmin", "fire"):
        yield (
            f"lammps {style}",
            lambda style=style: engine_points(  # type: ignore[misc]
                jump,
                work,
                lambda steps, folder: minimised_by(
                    "lammps", scenes["lammps"], jump, style, steps, folder
                ),
            ),
        )
    for engine, styles in STYLES.items():
        for style in styles:
            yield (
                f"minimize {engine} {style}",
                lambda engine=engine, style=style: verdict(  # type: ignore[misc]
                    engine, scenes[engine], jump, style, work
                ),
            )


def own_points(jump: Jumped, method: Method) -> Row:
    """A method of the project at each of its tolerances."""
    own(jump, method)  # compiled, out of the times below
    points = []
    for tolerance in TOLERANCES[method]:
        found = own(jump, method, tolerance)
        point = {
            "tolerance": tolerance,
            "evaluations": found.evaluations,
            "cpu_s": found.cpu_s,
            "ended": found.converged,
        }
        points.append(rough(point | measured(jump, found.position)))
    return {"points": points}


def engine_points(jump: Jumped, work: Path, relaxed: Callable[[int, Path], EngineRelaxed]) -> Row:
    """An engine's relaxation, a fresh process for each number of `STEPS`."""
    points = []
    for steps in STEPS:
        folder = work / "engine"
        shutil.rmtree(folder, ignore_errors=True)
        found = relaxed(steps, folder)
        point = {"evaluations": steps, "cpu_s": found.cpu_s, "ended": False}
        points.append(rough(point | measured(jump, found.position)))
    return {"points": points}


def verdict(engine: str, scene: Scene, jump: Jumped, style: str, work: Path) -> Row:
    """What an engine's minimiser says after 1,000 iterations, or of why it has none."""
    folder = work / "engine"
    shutil.rmtree(folder, ignore_errors=True)
    try:
        found = minimised_by(engine, scene, jump, style, 1000, folder)
    except TrackbedError as error:
        return {"says": str(error).partition("sentinel line: ")[2].splitlines()[0]}
    return {"says": stopped_because(folder)} | rough(measured(jump, found.position))


# --- live beds: where it ends, and the cycles behind ----------------------------------------------


def by_project(method: Method) -> Callable[[LiveBed], Relaxed]:
    """A method of the project."""

    def relaxed(bed: LiveBed) -> Relaxed:
        found = own(bed.jump, method)
        note = f"{found.evaluations} evaluations" + ("" if found.converged else ", not converged")
        return Relaxed(found.position, found.cpu_s, note)

    return relaxed


def by_rival(potential: str, minimiser: str, carried: bool) -> Callable[[LiveBed], Relaxed]:
    """A minimiser to its end, or until no overlap exceeds the greatest one ``carried`` before."""

    def relaxed(bed: LiveBed) -> Relaxed:
        way = minimised(bed.jump, potential, minimiser)
        chosen = way[-1]
        if carried:
            bound = figures_before(bed.jump)["overlap"]
            for noted in way:
                if measured(bed.jump, noted.position)["overlap"] <= bound:
                    chosen = noted
                    break
        note = f"{chosen.evaluations} evaluations" + ("" if chosen.ended else ", not ended")
        return Relaxed(chosen.position, chosen.cpu_s, note)

    return relaxed


def by_damping(recipe: str, steps: int) -> Callable[[LiveBed], Relaxed]:
    """Damped steps of LIGGGHTS on the restart file: springs stay."""

    def relaxed(bed: LiveBed) -> Relaxed:
        folder = bed.folder / "damped"
        shutil.rmtree(folder, ignore_errors=True)
        start = bed.resubmission(bed.jump.estimate, bed.piston_height)
        found, after = damped_from_restart(bed.scene, bed.jump, start, recipe, steps, folder)
        return Relaxed(found.position, found.cpu_s, f"{steps} steps", after)

    return relaxed


def by_lammps(style: str, iterations: int) -> Callable[[LiveBed], Relaxed]:
    """LAMMPS' minimiser, the grains at the walls held."""

    def relaxed(bed: LiveBed) -> Relaxed:
        folder = bed.folder / "minimised"
        shutil.rmtree(folder, ignore_errors=True)
        scene = bed.scene.model_copy(
            update={"engine": bed.scene.engine.model_copy(update={"name": "lammps"})}
        )
        found = minimised_by("lammps", scene, bed.jump, style, iterations, folder)
        return Relaxed(found.position, found.cpu_s, f"{iterations} iterations")

    return relaxed


def as_estimated(bed: LiveBed) -> Relaxed:
    """No relaxation at all."""
    return Relaxed(bed.jump.estimate, 0.0)


RESUBMITTED = "resubmitted"
"""The way that does not jump: what dump and resubmission alone do."""

WAYS: dict[str, Callable[[LiveBed], Relaxed]] = {
    "estimate": as_estimated,
    "smallest-move": by_project("smallest-move"),
    "proximal": by_project("proximal"),
    "karrech2007": by_project("karrech2007"),
    "eq29 gradient": by_rival("eq29", "gradient", carried=False),
    "eq29-free lbfgs": by_rival("eq29-free", "lbfgs", carried=False),
    "hertz gradient, carried": by_rival("hertz", "gradient", carried=True),
    "hertz lbfgs, carried": by_rival("hertz", "lbfgs", carried=True),
    "hertz lbfgs": by_rival("hertz", "lbfgs", carried=False),
    "hertz fire, carried": by_rival("hertz", "fire", carried=True),
    "hertz fire": by_rival("hertz", "fire", carried=False),
    "liggghts drag, 1000": by_damping("drag", 1000),
    "liggghts drag, 10000": by_damping("drag", 10_000),
    "liggghts limit, 1000": by_damping("limit", 1000),
    "lammps fire, 1000": by_lammps("fire", 1000),
}
"""Ways on live beds; ``carried`` ends when no overlap exceeds those before the jump."""


def bed_row(bed: LiveBed, way: str) -> Row:
    """A relaxation of a live bed, and the ten cycles behind it; what failed says why."""
    before = bed.jump.before
    if way == RESUBMITTED:
        start = bed.resubmission(before.position, before.piston_height)
        return {"after": _after(bed, way, start)}
    try:
        found = WAYS[way](bed)
    except TrackbedError as error:
        return {"refused": str(error).splitlines()[0]}
    row = {"cpu_s": found.cpu_s, "note": found.note} | measured(bed.jump, found.position)
    start = found.start or bed.resubmission(found.position, bed.piston_height)
    return rough(row) | {"after": _after(bed, way, start)}


def _after(bed: LiveBed, way: str, start: EngineStart) -> Row:
    """The answer of ten cycles from ``start``; why there is none where they fail."""
    try:
        window = bed.loaded(way.replace(" ", "_").replace(",", ""), start, AFTER)
    except TrackbedError as error:
        return {"refused": str(error).splitlines()[0]}
    return bed.answer(window, bed.jump.before, history=True)
