"""Ways to the same cycle: jumps, jumps that move nothing, and what a user would do instead.

All but fewer grains, which need a rain of their own, begin at the states of the coarse ensemble's
packings after k_i cycles.  A scene alone always begins with its rain; what it has no key for is
written into the decks of the windows (`Changed`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from adapters.engine import EngineStart
from adapters.engine_liggghts import LiggghtsEngine
from adapters.errors import SceneError, TrackbedError
from adapters.procedure import CONTROL, settle
from adapters.progress import Progress
from adapters.report_history import cost_total
from adapters.run_folder import RunFolder
from adapters.sample import GRAVITY, relative_density_profile
from adapters.scene import Scene
from adapters.stages import Run, Variant
from adapters.state import FloatArray
from adapters.window import window_load
from validation.move_study_engine import cycles_of
from validation.settlement_ensemble import COARSE, Kind, Piece
from validation.settlement_ensemble_record import EnsembleRecord
from validation.settlement_ensemble_start import packing_lay

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
    phase is the step's.  ``heavier`` s: grains and piston get the scene's masses, which are s times
    the saved ones, and gravity is `GRAVITY` / s, so that weights stay.  Velocities stay too.
    """

    def __init__(self, heavier: float = 1.0) -> None:
        self.heavier = heavier

    def write_cycles(
        self, scene: Scene, start: EngineStart, cycles: int, folder: Path
    ) -> dict[str, str]:
        """As the engine's, then the changes in the folder's own copy of the deck."""
        digests = super().write_cycles(scene, start, cycles, folder)
        if start.time_step % scene.steps_per_cycle:
            deck_extend(folder / "in.cycles", "include ${start_part}", "reset_timestep 0")
        if self.heavier != 1:
            assert scene.loading is not None
            deck_extend(
                folder / "in.cycles",
                "include piston.in",
                f"set group grains density {scene.material.grain.density!r}",
                f"set atom ${{piston_atom}} mass {scene.loading.piston_mass!r}",
                "unfix gravity",
                f"fix gravity grains gravity {GRAVITY / self.heavier!r} vector 0.0 0.0 -1.0",
            )
        return digests


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

    def kind(self, last: int) -> Kind:
        """The coarse ensemble's scene as this method changes it, to cycle ``last``."""
        k = FIRST_WINDOW if self.variant.jumps else 100
        keys = [*COARSE.settings, f"procedure.total_cycles={last}", *self.settings]
        if not any(key.startswith("procedure.tolerance") for key in self.settings):
            h = jump_length(self.jumps, last) if self.jumps else 0
            keys += [f"procedure.k={k}", f"procedure.h={h}"]
        return replace(COARSE, settings=tuple(keys))


def jump_length(jumps: int, last: int) -> int:
    """Cycles h of each of equal ``jumps``: from k_i a window, then h, healing and a window each.

    ValueError where they do not end at cycle ``last``.
    """
    block, rest = divmod(last - K_I - FIRST_WINDOW, jumps)
    if rest or block <= HEALING + FIRST_WINDOW:
        raise ValueError(f"{jumps} equal jumps from windows of {FIRST_WINDOW} miss cycle {last}")
    return block - HEALING - FIRST_WINDOW


JUMPING = Variant()
STILL = ('procedure.move="still"',)


def jumping(jumps: int) -> tuple[Method, Method]:
    """So many equal jumps by the procedure, and the same that move nothing."""
    return (
        Method(f"{jumps} jumps", "procedure", (), JUMPING, jumps),
        Method(f"{jumps} jumps, nothing moved", "nothing moved", STILL, JUMPING, jumps),
    )


def softer(factor: int) -> Method:
    """Young's modulus of the grains over ``factor``, and the longer time step that goes with it."""
    return Method(f"E/{factor}", "softer", (f"material.grain.young={1e9 / factor!r}",))


def longer(share: float) -> Method:
    """A time step of a ``share`` of the Rayleigh time, where the reference takes 0.2."""
    return Method(f"step x {share / 0.2:g}", "longer step", (f"engine.rayleigh_share={share}",))


def faster(factor: int) -> Method:
    """The load at a higher frequency."""
    return Method(f"{factor * 50} Hz", "frequency", (f"loading.frequency={factor * 50.0}",))


def heavier(factor: int) -> Method:
    """Density scaling, the piston with the grains; `Changed` keeps the weights."""
    scene = COARSE.scene(1)
    assert scene.loading is not None
    keys = (
        f"material.grain.density={factor * scene.material.grain.density!r}",
        f"loading.piston_mass={factor * scene.loading.piston_mass!r}",
    )
    return Method(f"density x {factor}", "density", keys, heavier=factor)


FEWER = Method("75 grains", "fewer grains", ("sample.count=75",), own_rain=True)
RESUBMITTED = Method("h = 0", "h = 0", (), Variant("h = 0", still=True))
METHODS = (
    *jumping(5), *jumping(2), softer(10), softer(30), softer(100),
    longer(0.4), longer(0.6), longer(0.8), longer(1.0),
    faster(2), faster(4), heavier(10), heavier(100), FEWER,
    Method("tolerance 0.1", "tolerance", ("procedure.tolerance=0.1",), JUMPING),
    longer(0.3), *jumping(10), RESUBMITTED,
)  # fmt: skip
"""In the order in which they are run."""


def method_run(method: Method, seed: int, last: int, record: EnsembleRecord, folder: Path) -> Row:
    """A method on a packing to cycle ``last`` in ``folder``: what is kept of it.

    A run that was refused or failed says why, with what it had reached.
    """
    try:
        scene = method.kind(last).scene(seed)
    except SceneError as error:
        return {"refused": " ".join(str(error).split()), "computed": 0, "cpu_s": 0.0}
    folder.mkdir(parents=True, exist_ok=True)
    run = Run(
        scene, RunFolder(folder), Changed(method.heavier), method.variant,
        Progress(quiet=True), cycle_by_cycle=True,
    )  # fmt: skip
    if not method.own_rain:
        packing_lay(run, Piece(COARSE, seed), record)
    refused = ""
    try:
        settle(run)
    except TrackbedError as error:
        if getattr(error, "from_outside", False):
            raise
        refused = str(error).splitlines()[0]
    row = {"refused": refused, "steps_per_cycle": scene.steps_per_cycle} | reached(run)
    return row | {"engine": run.engine.version()}


def reached(run: Run) -> Row:
    """Figures of a run as far as it has come, and what they cost behind cycle k_i.

    ``settlement`` [m] since the cycles up to k_i by the last cycle of each `BLOCK` that was
    computed whole, ``state`` the `STATE` of the last, ``profile`` relative density of the layers at
    the end, ``computed`` cycles, ``cost`` CPU time [s] by purpose, ``lost`` stages given up.
    """
    first = run.folder.outcome("window_000000")
    assert first is not None
    before = np.mean([line["settlement"] for line in first.rows[-BLOCK:]])
    names = [name for name in run.folder.stage_names() if name.startswith("window")]
    found: dict[int, dict[str, float]] = {}
    for name in names[1:]:
        outcome = run.folder.outcome(name)
        if outcome is None:
            continue
        columns = cycles_of(run, name, slice(None))
        for at, line in enumerate(outcome.rows):
            found[line["cycle"]] = {column: values[at] for column, values in columns.items()}
    outcomes = [o for o in run.folder.outcomes() if o.last_cycle > K_I or o.first_cycle >= K_I]
    cost: dict[str, float] = {}
    for outcome in outcomes:
        for purpose, seconds in outcome.cost.items():
            cost[purpose] = cost.get(purpose, 0.0) + seconds
    lost = [run.folder.failure(n) for n in run.folder.stage_names() if run.folder.failure(n)]
    row: Row = {"computed": len(found), "cost": cost, "cpu_s": cost_total(cost), "lost": lost}
    if found:
        row["settlement"] = {
            str(end): mean_of(found, end, "settlement") - float(before)
            for end in range(K_I + BLOCK, max(found) + 1, BLOCK)
            if all(cycle in found for cycle in range(end - BLOCK + 1, end + 1))
        }
        row["state"] = {column: mean_of(found, max(found), column) for column in STATE}
        window = window_load(run.folder.path / names[-1] / "states.npz")
        row["profile"] = profile(run, window.position[-1], window.radius)
    return row


def mean_of(found: dict[int, dict[str, float]], end: int, column: str) -> float:
    """Mean of a column over the cycles of the block up to ``end`` that were computed."""
    cycles = range(end - BLOCK + 1, end + 1)
    return float(np.mean([found[cycle][column] for cycle in cycles if cycle in found]))


def profile(run: Run, position: FloatArray, radius: FloatArray) -> list[float]:
    """Relative density of `LAYERS` layers of centres (n, 3) and radii (n,) [m]."""
    preparation = run.folder.outcome("preparation")
    assert preparation is not None
    edges = np.linspace(0, preparation.notes["density_height"], LAYERS + 1)
    return relative_density_profile(position, radius, run.scene.container, edges).tolist()
