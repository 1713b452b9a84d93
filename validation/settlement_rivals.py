"""Ways to the same cycle: jumps, jumps that move nothing, and what a user would do instead.

All but fewer grains, which need a rain of their own, begin at the states of the ensemble's packings
after k_i cycles: the coarse ensemble, or the confined one at paper scale.  A scene alone always
begins with its rain; what it has no key for is written into the decks of the windows (`Changed`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from adapters.engine import EngineStart
from adapters.engine_liggghts import LiggghtsEngine
from adapters.errors import SceneError, TrackbedError
from adapters.jump_schedule import jump_lengths
from adapters.procedure import CONTROL, settle
from adapters.progress import Progress
from adapters.report_history import cost_total
from adapters.run_folder import Outcome, RunFolder
from adapters.sample import GRAVITY, relative_density_profile
from adapters.scene import Scene
from adapters.stages import Run, Variant
from adapters.state import FloatArray
from adapters.window import window_load
from validation.move_study_engine import cycles_of
from validation.settlement_ensemble import COARSE, CONFINED, STEP, Kind, Piece
from validation.settlement_ensemble_record import EnsembleRecord
from validation.settlement_ensemble_start import packing_lay
from validation.settlement_rivals_continuity import sides_of

Row = dict[str, Any]
K_I = COARSE.k_i
GRAINS = COARSE.scene(1).grain_count
BLOCK = 10
"""Cycles over whose ends every figure is averaged: a soft bed springs at the end of a cycle."""
LAYERS = 5
"""Of equal height, from the floor to where the relative density is taken."""
FIRST_WINDOW, HEALING = 20, 5
"""Cycles fitted before a jump, and computed behind it and not fitted."""
STATE = ("coordination_number", "elastic_deflection", "piston_stiffness", "force_error")
"""Figures that are kept of the last `BLOCK` cycles: -, m, N/m, share of the peak force."""


class Changed(LiggghtsEngine):
    """LIGGGHTS going on from a state that was saved with another time step, or other masses.

    A saved step count that is no whole number of the scene's cycles is set to zero: the load's
    phase is the step's.  ``lines`` are put behind a line of each window's deck.
    """

    def __init__(self, lines: Mapping[str, Sequence[str]] | None = None) -> None:
        self.lines = lines or {}

    def write_cycles(
        self, scene: Scene, start: EngineStart, cycles: int, folder: Path
    ) -> dict[str, str]:
        """As the engine's, then the lines in the folder's own copy of the deck."""
        digests = super().write_cycles(scene, start, cycles, folder)
        if start.time_step % scene.steps_per_cycle:
            deck_extend(folder / "in.cycles", "include ${start_part}", "reset_timestep 0")
        for line, more in self.lines.items():
            deck_extend(folder / "in.cycles", line, *more)
        return digests


def masses_scaled(scene: Scene, ratio: float) -> dict[str, tuple[str, ...]]:
    """Lines of `Changed` that give saved grains and piston the scene's masses.

    Gravity is `GRAVITY` over the ``ratio`` of these to the saved ones, so that weights stay.
    Velocities stay too, and so kinetic energies do not.
    """
    assert scene.loading is not None
    return {
        "include piston.in": (
            f"set group grains density {scene.material.grain.density!r}",
            f"set atom ${{piston_atom}} mass {scene.loading.piston_mass!r}",
            "unfix gravity",
            f"fix gravity grains gravity {GRAVITY / ratio!r} vector 0.0 0.0 -1.0",
        )
    }


def deck_extend(path: Path, line: str, *more: str) -> None:
    """Put lines behind one that stands in a deck; ValueError where it does not."""
    lines = path.read_text(encoding="utf-8").splitlines()
    at = lines.index(line) + 1
    path.write_text("\n".join([*lines[:at], *more, *lines[at:]]) + "\n", encoding="utf-8")


@dataclass(frozen=True)
class Method:
    """A way to the last cycle; without jumps it computes every cycle."""

    name: str
    family: str
    """Methods of one family differ by a number: a line in the picture."""
    settings: tuple[str, ...] = ()
    """Keys of the scene that differ."""
    variant: Variant = CONTROL
    jumps: int = 0
    """How many equal jumps reach the last cycle; 0 where the settings say."""
    heavier: float = 1.0
    """Mass over that of the packing's state."""
    own_rain: bool = False
    """Whether it begins with a rain of its own."""
    base: Kind = COARSE
    """The ensemble with whose packings it begins."""
    window: int = FIRST_WINDOW
    """Cycles fitted before each jump."""
    growing: bool = False
    """Whether jumps have the same ratio of cycles, not their number."""
    healing: int = HEALING
    """Cycles computed behind each jump and not fitted."""

    def kind(self, last: int) -> Kind:
        """The ensemble's scene as this method changes it, to cycle ``last``."""
        k = self.window if self.variant.jumps else 100
        keys = [*self.base.settings, f"procedure.total_cycles={last}", *self.settings]
        if not any(key.startswith("procedure.tolerance") for key in self.settings):
            h: int | list[int] = 0
            if self.growing:
                h = jump_lengths(self.jumps, last, self.base.k_i, k, self.healing)
            elif self.jumps:
                h = jump_length(self.jumps, last, self.base.k_i, k, self.healing)
            keys += [f"procedure.k={k}", f"procedure.h={h}"]
        if self.healing != HEALING:
            keys.append(f"procedure.healing_cycles={self.healing}")
        return replace(self.base, settings=tuple(keys))


def jump_length(
    jumps: int, last: int, k_i: int = K_I, window: int = FIRST_WINDOW, healing: int = HEALING
) -> int:
    """Cycles h of each of equal ``jumps``: from k_i a window, then h, healing and a window each.

    ValueError where they do not end at cycle ``last``.
    """
    block, rest = divmod(last - k_i - window, jumps)
    if rest or block <= healing + window:
        raise ValueError(f"{jumps} equal jumps from windows of {window} miss cycle {last}")
    return block - healing - window


JUMPING = Variant()
STILL = ('procedure.move="still"',)


def growing(method: Method) -> Method:
    """The same number of jumps, each longer than the one before."""
    return replace(method, name=method.name.replace("jumps", "growing jumps", 1), growing=True)


def jumping(jumps: int) -> tuple[Method, Method]:
    """So many equal jumps by the procedure, and the same that move nothing."""
    return (
        Method(f"{jumps} jumps", "procedure", (), JUMPING, jumps),
        Method(f"{jumps} jumps, nothing moved", "nothing moved", STILL, JUMPING, jumps),
    )


def remembering(jumps: int, move: str = "") -> Method:
    """So many equal jumps whose mean grain settles by the slopes of all cycles computed.

    ``move``: how grains move beside one another, where that is not the default.
    """
    keys = ('procedure.settlement="history"', *([f'procedure.move="{move}"'] if move else []))
    moved = f", {move}" if move else ""
    return Method(f"{jumps} jumps, by history{moved}", f"history{moved}", keys, JUMPING, jumps)


def seated(method: Method) -> Method:
    """The same, its k_i first cycles counted from where the bed carries the piston."""
    keys = (*method.settings, 'procedure.seating="waits"')
    return replace(method, name=f"{method.name}, seated", settings=keys)


def shortly(method: Method, cycles: int = 4) -> Method:
    """The same where runs wait, so many ``cycles`` that the bed carries its piston in place of k_i:
    of the first k_i = 20 four are left out of forecasts by history, too."""
    keys = (*method.settings, f"procedure.seating_cycles={cycles}")
    return replace(method, name=f"{method.name} for {cycles}", settings=keys)


def rearranging(method: Method) -> Method:
    """The same, its grains changing places where a jump finds no room."""
    keys = (*method.settings, 'procedure.jammed="rearranged"')
    return replace(method, name=f"{method.name}, rearranged", settings=keys)


def healing(method: Method, cycles: int) -> Method:
    """The same with another number of cycles behind each jump that are not fitted."""
    return replace(method, name=f"{method.name}, {cycles} healing", healing=cycles)


def softer(factor: int, base: Kind = COARSE) -> Method:
    """Young's modulus of the grains over ``factor``, and the longer time step that goes with it."""
    young = base.scene(1).material.grain.young / factor
    return Method(f"E/{factor}", "softer", (f"material.grain.young={young!r}",))


def longer(share: float) -> Method:
    """A time step of a ``share`` of the Rayleigh time, where the reference takes 0.2."""
    return Method(f"step x {share / 0.2:g}", "longer step", (f"engine.rayleigh_share={share}",))


def together(jumps: Method, rival: Method) -> Method:
    """Jumps on a bed that is computed as by a rival, which has nothing but other keys."""
    keys = (*jumps.settings, *rival.settings)
    return replace(jumps, name=f"{jumps.name}, {rival.name}", settings=keys)


def faster(factor: int) -> Method:
    """The load at a higher frequency."""
    return Method(f"{factor * 50} Hz", "frequency", (f"loading.frequency={factor * 50.0}",))


def heavier(factor: int, base: Kind = COARSE) -> Method:
    """Density scaling, the piston with the grains; `Changed` keeps the weights."""
    scene = base.scene(1)
    assert scene.loading is not None
    keys = (
        f"material.grain.density={factor * scene.material.grain.density!r}",
        f"loading.piston_mass={factor * scene.loading.piston_mass!r}",
    )
    return Method(f"density x {factor}", "density", keys, heavier=factor)


FEWER = Method("75 grains", "fewer grains", ("sample.count=75",), own_rain=True)
RESUBMITTED = Method("h = 0", "h = 0", (), Variant("h = 0", still=True))
METHODS = (
    *jumping(5), *jumping(2), softer(10), longer(0.8), faster(4), heavier(10), longer(0.4),
    softer(30), softer(100), heavier(100), longer(1.0), longer(0.6), faster(2), FEWER,
    Method("tolerance 0.1", "tolerance", ("procedure.tolerance=0.1",), JUMPING),
    *jumping(10), longer(0.3), RESUBMITTED, remembering(5), remembering(2), remembering(10),
    remembering(2, "profile"), remembering(5, "profile"),
)  # fmt: skip
"""On the coarse bed, in the order in which they are run."""
HEALINGS = (0, 2, 10)
"""Beside `HEALING`."""
HEALED = tuple(
    healing(method, cycles) for cycles in HEALINGS for method in (remembering(5), jumping(5)[0])
)
"""Five jumps with other numbers of healing cycles; `METHODS` has the same with `HEALING`."""
METHODS_OF: dict[str, tuple[Method, ...]] = {
    COARSE.name: METHODS,
    CONFINED.name: tuple(
        replace(method, base=CONFINED)
        for method in (
            *jumping(2), longer(0.4), remembering(2, "profile"), softer(10, CONFINED),
            softer(100, CONFINED), faster(2), heavier(10, CONFINED),
            Method("tolerance 0.02", "tolerance", ("procedure.tolerance=0.02",), JUMPING),
            replace(growing(remembering(5, "profile")), window=10),
            replace(growing(jumping(5)[1]), window=10),
            replace(growing(remembering(3, "profile")), window=18),
            together(replace(growing(remembering(5, "profile")), window=10), longer(0.4)),
        )
    ),
}  # fmt: skip
"""By the name of the ensemble."""


def run_in(
    folder: Path, scene: Scene, variant: Variant, lines: Mapping[str, Sequence[str]] | None = None
) -> Run:
    """A run in ``folder`` on `Changed` that says nothing, and computes where it may not jump."""
    folder.mkdir(parents=True, exist_ok=True)
    return Run(scene, RunFolder(folder), Changed(lines), variant, Progress(quiet=True), True)


def method_run(
    method: Method, seed: int, member: int, last: int, record: EnsembleRecord, folder: Path
) -> Row:
    """A method on a packing to cycle ``last`` in ``folder``: what is kept of it.

    ``member``: one grain begins so many times `STEP` aside.  A run that was refused or failed says
    why, with what it had reached.
    """
    try:
        scene = method.kind(last).scene(seed)
    except SceneError as error:
        why = error.what.splitlines()[-1].rpartition(".toml:")[2].partition(": ")[2]
        return {"refused": why, "computed": 0, "cpu_s": 0.0}
    lines = {} if method.heavier == 1 else masses_scaled(scene, method.heavier)
    variant = replace(method.variant, perturbation=member * STEP)
    run = run_in(folder, scene, variant, lines)
    if not method.own_rain:
        packing_lay(run, Piece(method.base, seed), record)
    refused = ""
    try:
        settle(run)
    except TrackbedError as error:
        if getattr(error, "from_outside", False):
            raise
        refused = error.what.splitlines()[0]
    row = {"refused": refused, "steps_per_cycle": scene.steps_per_cycle}
    row |= reached(run, method.base.k_i)
    return row | {"engine": run.engine.version()}


def reached(run: Run, k_i: int) -> Row:
    """Figures of a run as far as it has come, and what they cost behind cycle k_i.

    ``settlement``, ``state``, ``profile`` as `figures_of`; ``sides`` of jumps; ``computed`` cycles,
    ``cost`` CPU time [s] by purpose, ``lost`` why stages were given up, ``moved`` as `moved_of`.
    """
    first = run.folder.outcome("window_000000")
    assert first is not None
    found = {row["cycle"]: row for row in first.rows}
    names = [name for name in run.folder.stage_names() if name.startswith("window")]
    for name in names[1:]:
        columns, window = cycles_of(run, name, slice(None)), run.folder.outcome(name)
        assert window is not None
        for cycle, values in enumerate(zip(*columns.values(), strict=True), window.first_cycle + 1):
            found[cycle] = dict(zip(columns, values, strict=True))
    cost: dict[str, float] = {}
    for outcome in run.folder.outcomes():
        if outcome.first_cycle >= k_i:
            for purpose, seconds in outcome.cost.items():
                cost[purpose] = cost.get(purpose, 0.0) + seconds
    row = {
        "computed": len(found) - k_i,
        "cost": cost,
        "cpu_s": cost_total(cost),
        "sides": sides_of(run),
        "moved": moved_of(run.folder.outcomes()),
        "lost": [why for name in run.folder.stage_names() if (why := run.folder.failure(name))],
    }
    if len(names) == 1:
        return row
    last = window_load(run.folder.path / names[-1] / "states.npz")
    preparation = run.folder.outcome("preparation")
    assert preparation is not None
    height = preparation.notes["density_height"]
    layers = profile(run.scene, height, last.position[-1], last.radius)
    return row | figures_of(found, k_i) | {"profile": layers}


def moved_of(outcomes: Sequence[Outcome]) -> list[list[float]]:
    """Of each jump by history: settlement that was asked for, and that the bed had room for [m]."""
    notes = [one.notes for one in outcomes if one.stage == "jump"]
    return [[note["asked"], note["gain"]] for note in notes if "asked" in note]


def figures_of(found: Mapping[int, Mapping[str, float]], k_i: int) -> Row:
    """Figures from the columns of computed cycles.

    ``settlement`` [m] since the `BLOCK` up to k_i by the last cycle of each block that was computed
    whole, means of blocks both; ``state``: means of `STATE` over the last block.
    """
    ends = range(k_i + BLOCK, max(found) + 1, BLOCK)
    before = mean_of(found, k_i, "settlement")
    return {
        "settlement": {
            str(end): mean_of(found, end, "settlement") - before
            for end in ends
            if all(cycle in found for cycle in range(end - BLOCK + 1, end + 1))
        },
        "state": {column: mean_of(found, max(found), column) for column in STATE},
    }


def mean_of(found: Mapping[int, Mapping[str, float]], end: int, column: str) -> float:
    """Mean of a column over the cycles of the block up to ``end`` that were computed."""
    cycles = range(end - BLOCK + 1, end + 1)
    return float(np.mean([found[cycle][column] for cycle in cycles if cycle in found]))


def profile(scene: Scene, height: float, position: FloatArray, radius: FloatArray) -> list[float]:
    """Relative density of `LAYERS` up to ``height``, of centres (n, 3) and radii (n,) [m]."""
    edges = np.linspace(0, height, LAYERS + 1)
    return relative_density_profile(position, radius, scene.container, edges).tolist()
