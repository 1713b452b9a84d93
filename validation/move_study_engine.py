"""What a jump moves, judged by LIGGGHTS: ten cycles after one jump, beside those before it.

Beds of the kind `coarse` of the settlement ensemble, from the rain on.  Each is computed through a
window, and from its end on by every cycle (`FULL`), by every cycle with one grain moved by 1e-10 m
(`TWIN`, chaos' own scatter), and by one jump each way with ten cycles behind it.  A stage that is
through is kept in the work folder, a way that is through in the record.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
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
from validation.settlement_ensemble import COARSE, STEP, piston_stiffness

Row = dict[str, Any]
K_I, K, H, AFTER = 60, 40, 40, 10
"""First cycles, fitted cycles, jumped cycles, cycles behind the jump."""
BEDS = (1, 2, 3, 4, 5, 6, 7, 8)
"""Seeds of the rain of grains."""
FULL, TWIN = "every cycle", "every cycle, twin"
MEASURES = (
    "settlement", "coordination_number", "elastic_deflection", "piston_stiffness",
    "maximum_overlap", "force_error",
)  # fmt: skip
"""What is recorded of each cycle: m, -, m, N/m, m, share of the peak force."""


def scene_moved(seed: int, way: str) -> Scene:
    """The coarse scene of a seed, whose jumps move grains the given way."""
    scene = COARSE.scene(seed)
    assert scene.procedure is not None
    change = {"k_i": K_I, "k": K, "h": (H,), "move": way}
    return scene.model_copy(update={"procedure": scene.procedure.model_copy(update=change)})


def run_in(folder: Path, scene: Scene) -> Run:
    """A run in ``folder`` that says nothing."""
    folder.mkdir(parents=True, exist_ok=True)
    engine = engine_named(scene.engine.name)
    return Run(scene, RunFolder(folder), engine, Variant(), Progress(quiet=True))


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


def bed_window(work: Path, seed: int) -> tuple[Run, Bed]:
    """The run and its state at the window's end, cycle K_I + K."""
    run = run_in(work / f"bed-{seed}", scene_moved(seed, "still"))
    bed = compute(run, compute(run, prepare(run), K_I), K)
    return run, bed


def way_row(work: Path, seed: int, way: str) -> Row:
    """One way from a bed's window on: the ten cycles before, the state at the target, ten after."""
    base, bed = bed_window(work, seed)
    jumps = way in moves_known()
    scene = scene_moved(seed, way if jumps else "still")
    run = run_in(base.folder.path / way.replace(" ", "-").replace(",", ""), scene)
    run.folder.share_start(base.folder, K_I + K)
    row: Row = {"run": f"coarse-{seed}", "jump": [K_I, K, H], "move": way}
    row["before"] = cycles_of(run, bed.window, slice(-AFTER, None))
    if jumps:
        moved = jump(run, bed, H, 1)
        done = compute(run, moved, AFTER, AFTER)
        row["after"] = cycles_of(run, done.window, slice(None))
        row |= jump_figures(run, f"jump_{K_I + K:06d}_1")
        cost = stage_cost(run, f"jump_{K_I + K:06d}_1")
        row["jump_cost_s"] = cost
    else:
        shift = STEP if way == TWIN else 0.0
        start = replace(bed, start=replace(bed.start, perturbation=shift))
        done = compute(run, start, H + AFTER)
        after = cycles_of(run, done.window, slice(H - 1, None))
        row["start"] = {name: values.pop(0) for name, values in after.items()}
        row["after"] = after
        cost = {}
    row["cpu_s"] = sum(cost.values()) + sum(stage_cost(run, done.window).values())
    row["engine"] = run.engine.version()
    return row


def jump_figures(run: Run, stage: str) -> Row:
    """State after a jump, bed before and after relaxation, lengths of the grains' moves [m]."""
    outcome = run.folder.outcome(stage)
    assert outcome is not None
    after, relaxation = outcome.rows[0], outcome.notes["relaxation"]
    folder = run.folder.path
    before = window_load(folder / f"window_{K_I:06d}" / "states.npz").position[-1]
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
    for seed in BEDS:
        for way in (FULL, *moves_known(), TWIN):
            if (f"coarse-{seed}", (K_I, K, H), way) not in done:
                yield way_row(work, seed, way)
