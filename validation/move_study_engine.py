"""What a jump moves, judged by LIGGGHTS: cycles after one jump, beside those before it.

Beds are those of the settlement ensemble.  Each is computed through a window, and from its end on
by every cycle (`FULL`), by every cycle with one grain moved by 1e-10 m (`TWIN`: chaos' own
scatter), and by one jump each way with some cycles behind it.  A stage that is through is kept in
the work folder, a way that is through in the record.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from adapters.engine import engine_named
from adapters.moves import moves_known
from adapters.progress import Progress
from adapters.run_folder import RunFolder
from adapters.scene import Scene
from adapters.stages import Bed, Run, Variant, compute, jump, prepare
from adapters.state import state_load
from adapters.window import window_load
from validation.settlement_ensemble import COARSE, CONFINED, STEP, Kind, Piece, piston_stiffness
from validation.settlement_ensemble_record import EnsembleRecord
from validation.settlement_ensemble_start import packing_lay

Row = dict[str, Any]
FULL, TWIN = "every cycle", "every cycle, twin"
MEASURES = (
    "settlement", "coordination_number", "elastic_deflection", "piston_stiffness",
    "maximum_overlap", "force_error",
)  # fmt: skip
"""What is recorded of each cycle: m, -, m, N/m, m, share of the peak force."""


@dataclass(frozen=True)
class Judged:
    """One jump on some beds of a kind of the ensemble."""

    kind: Kind
    seeds: tuple[int, ...]
    """Of the rain of grains."""
    k_i: int
    k: int
    h: int
    after: int
    """Cycles behind the jump, and before it, that are compared."""
    ways: tuple[str, ...]
    stored: bool = False
    """Whether the bed begins at the ensemble's checkpoint, or with the rain."""

    @property
    def jump(self) -> tuple[int, int, int]:
        """k_i, k and h."""
        return self.k_i, self.k, self.h

    def scene(self, seed: int, way: str) -> Scene:
        """The scene of a bed, whose jumps move grains the given way."""
        scene = self.kind.scene(seed)
        assert scene.procedure is not None
        change = {"k_i": self.k_i, "k": self.k, "h": (self.h,), "move": way}
        procedure = scene.procedure.model_copy(update=change)
        return scene.model_copy(update={"procedure": procedure})


SMALL = Judged(COARSE, tuple(range(1, 9)), 60, 40, 40, 10, (FULL, *moves_known(), TWIN))
PAPER_WAYS = ("still", "smoothed", "shrunk", "per-grain", "profile", FULL)
PAPER = Judged(CONFINED, (1,), 50, 20, 20, 5, PAPER_WAYS, stored=True)
JUDGED = (PAPER, SMALL)


def run_in(folder: Path, scene: Scene) -> Run:
    """A run in ``folder`` that says nothing."""
    folder.mkdir(parents=True, exist_ok=True)
    engine = engine_named(scene.engine.name)
    return Run(scene, RunFolder(folder), engine, Variant(), Progress(quiet=True))


def bed_begun(run: Run, judged: Judged, seed: int) -> Bed:
    """The bed after k_i cycles: computed, or from the ensemble's checkpoint."""
    if judged.stored:
        packing_lay(run, Piece(judged.kind, seed), EnsembleRecord())
    return compute(run, prepare(run), judged.k_i)


def cycles_of(run: Run, name: str, rows: slice) -> dict[str, list[float]]:
    """`MEASURES` of some cycles of a finished window."""
    outcome = run.folder.outcome(name)
    assert outcome is not None
    window = window_load(run.folder.path / name / "states.npz")
    stiffness = piston_stiffness(window.piston, run.scene.steps_per_cycle)
    table = [
        row | {"piston_stiffness": float(value)}
        for row, value in zip(outcome.rows, stiffness, strict=True)
    ]
    return {measure: [float(row[measure]) for row in table[rows]] for measure in MEASURES}


def way_row(work: Path, judged: Judged, seed: int, way: str) -> Row:
    """One way from a bed's window on: cycles before, the state at the target, cycles after."""
    name = f"{judged.kind.name}-{seed}"
    base = run_in(work / name, judged.scene(seed, "still"))
    bed = compute(base, bed_begun(base, judged, seed), judged.k)
    jumps = way in moves_known()
    scene = judged.scene(seed, way if jumps else "still")
    run = run_in(base.folder.path / way.replace(" ", "-").replace(",", ""), scene)
    run.folder.share_start(base.folder, bed.cycle)
    row: Row = {"run": name, "jump": list(judged.jump), "move": way}
    row["before"] = cycles_of(run, bed.window, slice(-judged.after, None))
    row["rise"] = mean_rise(run, bed.window, judged.after)
    if jumps:
        moved = jump(run, bed, judged.h, 1)
        done = compute(run, moved, judged.after, judged.after)
        row["after"] = cycles_of(run, done.window, slice(None))
        stage = f"jump_{bed.cycle:06d}_1"
        row |= jump_figures(run, bed.window, stage)
        cost = row["jump_cost_s"] = stage_cost(run, stage)
    else:
        shift = STEP if way == TWIN else 0.0
        start = replace(bed, start=replace(bed.start, perturbation=shift))
        done = compute(run, start, judged.h + judged.after)
        after = cycles_of(run, done.window, slice(judged.h - 1, None))
        row["start"] = {name: values.pop(0) for name, values in after.items()}
        row["after"] = after
        cost = {}
    row["cpu_s"] = sum(cost.values()) + sum(stage_cost(run, done.window).values())
    row["engine"] = run.engine.version()
    return row


def mean_rise(run: Run, name: str, cycles: int) -> float:
    """Mean upward velocity [m/s] of the grains at the ends of the last cycles of a window."""
    window = window_load(run.folder.path / name / "states.npz")
    return float(window.velocity[-cycles:, :, 2].mean())


def jump_figures(run: Run, window: str, stage: str) -> Row:
    """State after a jump, bed before and after relaxation, lengths of the grains' moves [m]."""
    outcome = run.folder.outcome(stage)
    assert outcome is not None
    after, relaxation = outcome.rows[0], outcome.notes["relaxation"]
    folder = run.folder.path
    before = window_load(folder / window / "states.npz").position[-1]
    move = np.linalg.norm(state_load(folder / stage / "estimated.npz").position - before, axis=1)
    return {
        "start": {name: after[name] for name in MEASURES if name in after},
        "relaxation": {name: relaxation[name] for name in ("before", "estimated", "relaxed")},
        "pushed": [relaxation["median_move"], relaxation["largest_move"]],
        "lengths": np.quantile(move, (0.5, 0.9, 0.99)).tolist(),
    }


def stage_cost(run: Run, stage: str) -> dict[str, float]:
    """CPU time of a stage by purpose [s]."""
    outcome = run.folder.outcome(stage)
    assert outcome is not None
    return dict(outcome.cost)


def rows_engine(work: Path, done: set[tuple[Any, ...]]) -> Iterator[Row]:
    """All rows that are not ``done`` (run, jump, way), bed by bed."""
    for judged in JUDGED:
        for seed in judged.seeds:
            for way in judged.ways:
                if (f"{judged.kind.name}-{seed}", judged.jump, way) not in done:
                    yield way_row(work, judged, seed, way)
