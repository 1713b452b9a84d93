"""Full runs, and every other way from the state of the same packing: ``PARTS``."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from adapters.engines.contract import EngineStart
from adapters.engines.liggghts import LiggghtsEngine
from adapters.errors import TrackbedError
from adapters.files.run_folder import RunFolder
from adapters.laws.fit.outlook import find_outlook
from adapters.procedure.progress import Progress
from adapters.procedure.run import CONTROL, settle
from adapters.procedure.stages import Run, Variant, compute, prepare
from adapters.scene.tables import Scene
from validation.studies.settlement.beds import EVERY, KINDS, Kind, Method, list_methods, list_runs

Row = dict[str, Any]
BLOCK = 10
"""Cycles over whose ends every figure is averaged: a soft bed springs at the end of a cycle."""
ROWS = 60
"""Of the table kept of a full run."""
GAINS = ("loaded_body", "settlement")
"""Columns whose gain since k_i [m] is judged: the loaded body's, and the mean grain's."""
STATES = ("stiffness", "elastic_deflection", "coordination_number")
"""Columns that are means of the last block."""
JUDGED_LAWS = ("confined", "coarse")
"""Beds beside which a law is fitted to as many first cycles as *growing* computes."""


class Reset(LiggghtsEngine):
    """LIGGGHTS going on from a state that was saved with another time step.

    A saved step count that is no whole number of the scene's cycles is set to zero: the load's
    phase is the step's.
    """

    def write_cycles(
        self, scene: Scene, start: EngineStart, cycles: int, folder: Path
    ) -> dict[str, str]:
        """As the engine's, with the reset in the folder's own copy of the deck."""
        digests = super().write_cycles(scene, start, cycles, folder)
        if start.time_step % scene.steps_per_cycle:
            path, line = folder / "in.cycles", "include ${start_part}\n"
            deck = path.read_text(encoding="utf-8")
            path.write_text(deck.replace(line, f"{line}reset_timestep 0\n"), encoding="utf-8")
        return digests


def begin_run(scene: Scene, path: Path, variant: Variant) -> Run:
    """A run in a folder that says nothing, and computes where it may not jump."""
    path.mkdir(parents=True, exist_ok=True)
    return Run(scene, RunFolder(path), Reset(), variant, Progress(quiet=True), True)


def run_to_end(kind: Kind, method: Method | None, seed: int) -> tuple[Run, str]:
    """A way from its packing's state to its end, or why it failed there; None: every cycle."""
    scene, variant = kind.scene(seed), CONTROL
    if method is not None:
        scene, variant = kind.scene(seed, *method.settings), method.variant
    home = Path(os.environ.get("TRACKBED_VALIDATION", "validation-runs")) / "settlement"
    packing = begin_run(kind.scene(seed), home / f"{kind.name}-{seed}", CONTROL)
    with packing.folder.lock():
        compute(packing, prepare(packing), kind.k_i)
    name = f"{kind.name}-{seed}-{method.name if method else EVERY}"
    run = begin_run(scene, home / name.translate(str.maketrans(" ,/=", "----")), variant)
    with run.folder.lock():
        run.folder.share_start(packing.folder, kind.k_i)
        try:
            settle(run)
        except TrackbedError as error:
            if getattr(error, "from_outside", False):
                raise
            return run, error.what.splitlines()[0]
    return run, ""


def compute_way(kind: Kind, method: Method | None, seed: int) -> Row:
    """What is kept of a way: its gains [m], states and cost; one that failed says why."""
    run, refused = run_to_end(kind, method, seed)
    head = {"bed": kind.name, "way": method.name if method else EVERY, "seed": seed}
    head |= {"refused": refused, "steps_per_cycle": run.scene.steps_per_cycle}
    return head | {"engine": run.engine.version()} | measure_run(run, kind, whole=method is None)


def measure_run(run: Run, kind: Kind, whole: bool) -> Row:
    """Figures of a run, and what they cost behind cycle k_i; with ``whole`` its thinned table.

    `GAINS` [m] from the `BLOCK` up to k_i to that up to the last cycle, `STATES` as means of the
    last; ``computed`` cycles, ``cost`` CPU time [s] by purpose, ``lost`` how many tries failed.
    """
    found = tabulate_cycles(run)
    cost: dict[str, float] = {}
    for outcome in run.folder.outcomes():
        if kind.k_i <= outcome.first_cycle < kind.last:
            for purpose, seconds in outcome.cost.items():
                cost[purpose] = cost.get(purpose, 0.0) + seconds
    row: Row = {
        "computed": len(found) - kind.k_i,
        "cost": {purpose: round(seconds, 3) for purpose, seconds in cost.items()},
        "lost": sum(bool(run.folder.failure(name)) for name in run.folder.stage_names()),
    }
    if kind.last in found:
        row |= {name: average_block(found, kind.last, name) - average_block(found, kind.k_i, name)
                for name in GAINS}  # fmt: skip
        row |= {name: average_block(found, kind.last, name) for name in STATES}
    return row | {"table": thin_table(found)} if whole else row


def tabulate_cycles(run: Run) -> dict[int, dict[str, Any]]:
    """The rows of every computed cycle, by cycle."""
    return {
        int(row["cycle"]): row
        for outcome in run.folder.outcomes()
        if outcome.stage == "window"
        for row in outcome.rows
    }


def average_block(found: Mapping[int, Mapping[str, Any]], end: int, column: str) -> float:
    """Mean of what is known of a column over the computed cycles of the block up to ``end``."""
    rows = [found[cycle] for cycle in range(end - BLOCK + 1, end + 1) if cycle in found]
    known = [row[column] for row in rows if row[column] is not None]
    return float(np.mean(known)) if known else float("nan")


def thin_table(found: Mapping[int, Mapping[str, Any]]) -> dict[str, list[float]]:
    """`GAINS` [m] at some `ROWS` cycles, evenly spaced in ln N."""
    wanted = np.unique(np.rint(np.geomspace(1, max(found), ROWS)).astype(int)).tolist()
    columns = {name: [float(f"{found[cycle][name]:.7g}") for cycle in wanted] for name in GAINS}
    return {"cycle": wanted, **columns}


def count_computed(kind: Kind) -> int:
    """Cycles that *growing*, the first way of every bed, computes behind k_i."""
    p = kind.scene(kind.seeds[0], *list_methods(kind)[0].settings).procedure
    assert p is not None
    assert p.h is not None
    return p.window_cycles + len(p.h) * (p.healing_cycles + p.window_cycles)


def fit_law(kind: Kind, seed: int) -> Row:
    """Gain of the loaded body by `find_outlook` from a full run's first cycles: no bed is left."""
    run, _ = run_to_end(kind, None, seed)
    found, seen = tabulate_cycles(run), count_computed(kind)
    cycle = np.arange(1, kind.k_i + seen + 1)
    path = np.array([found[one]["loaded_body"] for one in cycle.tolist()])
    predicted = float(find_outlook(cycle.astype(float), path[:, None], kind.last).prediction[0])
    engine = sum(
        outcome.cost["engine"] / len(outcome.rows)
        for outcome in run.folder.outcomes()
        for row in outcome.rows
        if kind.k_i < row["cycle"] <= kind.k_i + seen
    )
    gain = predicted - average_block(found, kind.k_i, "loaded_body")
    head = {"bed": kind.name, "way": "law of as many cycles", "seed": seed, "refused": ""}
    return head | {"computed": seen, "cost": {"engine": round(engine, 3)}, "loaded_body": gain}


def list_parts() -> dict[str, Callable[[], Row]]:
    """All runs of the study by name, a bed's full runs first, then ways, then the laws."""
    parts: dict[str, Callable[[], Row]] = {}
    for kind in KINDS.values():
        for method, seed in list_runs(kind):
            name = f"{kind.name}-{seed}, {method.name if method else EVERY}"
            parts[name] = partial(compute_way, kind, method, seed)
        for seed in kind.seeds if kind.name in JUDGED_LAWS else ():
            parts[f"{kind.name}-{seed}, law of as many cycles"] = partial(fit_law, kind, seed)
    return parts


PARTS = list_parts()
