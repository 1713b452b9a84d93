"""Full runs, and every other way from the state of the same packing: ``PARTS``."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from adapters.bed.sample import measure_relative_density
from adapters.engines.contract import EngineStart
from adapters.engines.liggghts import LiggghtsEngine
from adapters.errors import SceneError, TrackbedError
from adapters.files.run_folder import RunFolder
from adapters.files.window import load_window
from adapters.laws import get_law
from adapters.laws.fit.outlook import find_outlook
from adapters.procedure.progress import Progress
from adapters.procedure.run import CONTROL, settle
from adapters.procedure.stages import Run, Variant, compute, prepare
from adapters.scene.tables import Scene
from validation.studies.settlement.beds import (
    EVERY,
    KINDS,
    LAWS,
    STEP,
    Kind,
    Method,
    keep_weights,
    list_runs,
)

Row = dict[str, Any]
BLOCK = 10
"""Cycles over whose ends every figure is averaged: a soft bed springs at the end of a cycle."""
LAYERS = 5
"""Of equal height, from the floor to where the relative density is taken."""
ROWS = 60
"""Of the table kept of a full run."""
COLUMNS = {
    "cycle": "d", "settlement": ".7g", "piston_height": ".9g", "coordination_number": ".7g",
    "relative_density": ".7g", "elastic_deflection": ".5g",
    "kinetic_translational": ".4g", "kinetic_rotational": ".4g", "force_error": ".4g",
    "maximum_overlap": ".4g", "cpu_s": ".3g",
}  # fmt: skip
"""Columns of a full run's table in SI units, and the digits kept of them.  Settlement is that of
the grains' mean height since the rain, ``cpu_s`` the engine's, mean of a window."""
STATE = ("coordination_number", "elastic_deflection", "force_error")


class Changed(LiggghtsEngine):
    """LIGGGHTS going on from a state that was saved with another time step, or other masses.

    A saved step count that is no whole number of the scene's cycles is set to zero: the load's
    phase is the step's.  ``lines`` are put behind a line of each window's deck.
    """

    def __init__(self, lines: Mapping[str, Sequence[str]]) -> None:
        self.lines = lines

    def write_cycles(
        self, scene: Scene, start: EngineStart, cycles: int, folder: Path
    ) -> dict[str, str]:
        """As the engine's, then the lines in the folder's own copy of the deck."""
        digests = super().write_cycles(scene, start, cycles, folder)
        lines = dict(self.lines)
        if start.time_step % scene.steps_per_cycle:
            lines["include ${start_part}"] = ("reset_timestep 0",)
        path = folder / "in.cycles"
        for line, more in lines.items():
            deck = path.read_text(encoding="utf-8").splitlines()
            at = deck.index(line) + 1
            path.write_text("\n".join([*deck[:at], *more, *deck[at:]]) + "\n", encoding="utf-8")
        return digests


def begin_run(
    scene: Scene, path: Path, variant: Variant, lines: Mapping[str, Sequence[str]] | None = None
) -> Run:
    """A run in a folder that says nothing, and computes where it may not jump."""
    path.mkdir(parents=True, exist_ok=True)
    return Run(scene, RunFolder(path), Changed(lines or {}), variant, Progress(quiet=True), True)


def run_to_end(kind: Kind, method: Method | None, seed: int, member: int) -> tuple[Run, str]:
    """A way from its packing's state to its end, or why it was refused or failed there.

    ``method`` None: every cycle.  Raises `SceneError` where a scene may not be as the way asks.
    """
    variant = CONTROL
    lines: Mapping[str, Sequence[str]] = {}
    if method is None:
        scene = kind.scene(seed, "procedure.k=10")
    else:
        scene, variant = method.scene(kind, seed), method.variant
        if method.heavier != 1:
            lines = keep_weights(scene, method.heavier)
    home = Path(os.environ.get("TRACKBED_VALIDATION", "validation-runs")) / "settlement"
    packing = begin_run(kind.scene(seed), home / f"{kind.name}-{seed}", CONTROL)
    with packing.folder.lock():
        compute(packing, prepare(packing), kind.k_i)
    name = f"{kind.name}-{seed}-{member}-{method.name if method else EVERY}"
    perturbed = replace(variant, perturbation=member * STEP)
    run = begin_run(scene, home / name.translate(str.maketrans(" ,/=", "----")), perturbed, lines)
    with run.folder.lock():
        run.folder.share_start(packing.folder, kind.k_i)
        try:
            settle(run)
        except TrackbedError as error:
            if getattr(error, "from_outside", False):
                raise
            return run, error.what.splitlines()[0]
    return run, ""


def name_way(kind: Kind, method: str, seed: int, member: int) -> Row:
    """What makes a row this run."""
    run = {"method": method, "seed": seed, "member": member}
    return {"bed": kind.name, **run, "last": kind.last}


def compute_way(kind: Kind, method: Method | None, seed: int, member: int) -> Row:
    """What is kept of a way; one that was refused or failed says why, with what it reached."""
    head = name_way(kind, method.name if method else EVERY, seed, member)
    try:
        run, refused = run_to_end(kind, method, seed, member)
    except SceneError as error:
        return head | {"refused": str(error).splitlines()[0], "computed": 0, "cost": {}}
    head |= {"refused": refused, "steps_per_cycle": run.scene.steps_per_cycle}
    return head | {"engine": run.engine.version()} | measure_run(run, kind, whole=method is None)


def measure_run(run: Run, kind: Kind, whole: bool) -> Row:
    """Figures of a run, and what they cost behind cycle k_i; with ``whole`` its thinned table.

    ``settlement`` and ``piston`` [m] since the `BLOCK` up to k_i, means of the last block up to the
    last cycle; ``state``: means of `STATE` over it; ``profile`` of relative density; ``computed``
    cycles, ``cost`` CPU time [s] by purpose, ``lost`` how many tries failed.
    """
    found = tabulate_cycles(run)
    cost: dict[str, float] = {}
    for outcome in run.folder.outcomes():
        if kind.k_i <= outcome.first_cycle < kind.last:
            for purpose, seconds in outcome.cost.items():
                cost[purpose] = cost.get(purpose, 0.0) + seconds
    known = {cycle: row for cycle, row in found.items() if cycle <= kind.last}
    row: Row = {
        "computed": len(known) - kind.k_i,
        "cost": {purpose: round(seconds, 3) for purpose, seconds in cost.items()},
        "lost": sum(bool(run.folder.failure(name)) for name in run.folder.stage_names()),
    }
    if kind.last not in known:
        return row
    begun, ended = (
        {name: average_block(known, end, name) for name in (*STATE, "settlement", "piston_height")}
        for end in (kind.k_i, kind.last)
    )
    row |= {
        "begun": begun["settlement"],
        "settlement": ended["settlement"] - begun["settlement"],
        "piston": begun["piston_height"] - ended["piston_height"],
        "state": {name: ended[name] for name in STATE},
        "profile": measure_layers(run, kind.last),
    }
    return row | {"table": thin_table(found)} if whole else row


def tabulate_cycles(run: Run) -> dict[int, dict[str, float]]:
    """`COLUMNS` of every computed cycle."""
    found: dict[int, dict[str, float]] = {}
    for name in run.folder.stage_names():
        outcome = run.folder.outcome(name)
        if outcome is None or not name.startswith("window"):
            continue
        share = outcome.cost["engine"] / len(outcome.rows)
        found |= {row["cycle"]: row | {"cpu_s": share} for row in outcome.rows}
    return found


def measure_layers(run: Run, cycle: int) -> list[float]:
    """Relative density of each of `LAYERS` at the end of a cycle."""
    preparation = run.folder.outcome("preparation")
    assert preparation is not None
    edges = np.linspace(0, preparation.notes["density_height"], LAYERS + 1)
    (name,) = (
        f"window_{one.first_cycle:06d}"
        for one in run.folder.outcomes()
        if one.stage == "window" and one.first_cycle < cycle <= one.last_cycle
    )
    window = load_window(run.folder.path / name / "states.npz")
    at = int(np.flatnonzero(window.cycle == cycle)[0])
    return [
        measure_relative_density(
            window.position[at], window.radius, run.scene.container, top, bottom
        )
        for bottom, top in pairwise(edges)
    ]


def average_block(found: Mapping[int, Mapping[str, float]], end: int, column: str) -> float:
    """Mean of a column over the computed cycles of the block up to ``end``."""
    cycles = range(end - BLOCK + 1, end + 1)
    return float(np.mean([found[cycle][column] for cycle in cycles if cycle in found]))


def thin_table(found: Mapping[int, Mapping[str, float]]) -> dict[str, list[float]]:
    """Columns of some `ROWS` cycles, evenly spaced in ln N."""
    last = max(found)
    cycles = np.unique(np.rint(np.geomspace(1, last, ROWS)).astype(int))
    return {
        name: [float(format(found[int(cycle)][name], kind)) for cycle in cycles]
        if kind != "d"
        else cycles.tolist()
        for name, kind in COLUMNS.items()
    }


def fit_law(kind: Kind, law: str, cycles: int, seed: int, member: int) -> Row:
    """Settlement at the last cycle by a law fitted to a full run's first cycles: no bed is left.

    ``auto``: the prediction of `adapters.laws.fit.outlook` from all cycles since the rain; another:
    that
    law's value, fitted to the ``cycles`` behind k_i.
    """
    run, _ = run_to_end(kind, None, seed, member)
    found = tabulate_cycles(run)
    first, end = (1 if law == "auto" else kind.k_i + 1), kind.k_i + cycles
    cycle = np.arange(first, end + 1, dtype=float)
    path = np.array([found[int(one)]["settlement"] for one in cycle])
    if law == "auto":
        predicted = float(find_outlook(cycle, path[:, None], kind.last).prediction[0])
    else:
        chosen = get_law(law)
        ends = np.arange(kind.last - BLOCK + 1.0, kind.last + 1)
        predicted = float(np.mean(chosen.value(chosen.fit(cycle, path), ends)))
    cost = {"engine": sum(found[one]["cpu_s"] for one in range(kind.k_i + 1, end + 1))}
    head = name_way(kind, f"law {law}, {cycles} cycles", seed, member)
    gain = predicted - average_block(found, kind.k_i, "settlement")
    return head | {"refused": "", "computed": cycles, "cost": cost, "settlement": gain}


def list_parts() -> dict[str, Callable[[], Row]]:
    """All runs of the study by name, full runs first, then the laws fitted to them, then ways."""
    parts: dict[str, Callable[[], Row]] = {}
    for kind in KINDS.values():
        for method, seed, member in list_runs(kind):
            name = f"{kind.name}-{seed}-{member}, {method.name if method else EVERY}"
            parts[name] = partial(compute_way, kind, method, seed, member)
            if method is None:
                for law, cycles in LAWS:
                    name = f"{kind.name}-{seed}-{member}, law {law}, {cycles} cycles"
                    parts[name] = partial(fit_law, kind, law, cycles, seed, member)
    return parts


PARTS = list_parts()
