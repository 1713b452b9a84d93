"""What the record says of every level, and what must hold of rigid runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from validation.case import Check
from validation.studies.rigid_ballast.run import LEVELS, Level, Row
from validation.study import estimate_mean

Floats = NDArray[np.float64]
OVERLAP, GAIN, UPRIGHT = 1e-6, 0.01, 1e-3
"""Greatest overlap of rigid grains at the end of a step over the smallest stone [-], energy gained
in a cycle over the greatest loss in one, steps of 1 ms and less [-], the sleeper's turn [rad]."""
SMALLEST, FINE = 0.025, 1e-3
"""Diameter of the smallest stone [m], and the step from which on energy may not be gained [s]."""


@dataclass(frozen=True)
class Summary:
    """A level over all beds."""

    level: Level
    settlement: Floats
    """After each cycle (beds, cycles) [m]."""
    error: tuple[float, float]
    """Mean difference to the reference over the reference's mean [-], half its 95 % interval."""
    cost: Floats
    """Processor time of a run (beds,) [s]."""
    steps: float
    is_limit: bool
    """It is the finest of its method, judged by that of the other."""


def list_runs(rows: Sequence[Row], level: Level) -> list[Row]:
    """Runs of a level, bed after bed."""
    return [row["runs"][level.name] for row in rows]


def list_ends(rows: Sequence[Row], method: str) -> Floats:
    """Settlement after the last cycle of a method's finest level (beds,) [m]."""
    finest = [level for level in LEVELS if level.method == method][-1]
    return np.array([run["settlement"][-1] for run in list_runs(rows, finest)])


def summarise(rows: Sequence[Row]) -> list[Summary]:
    """Every level."""
    ends = {method: list_ends(rows, method) for method in ("rigid", "soft")}
    finest = [[level for level in LEVELS if level.method == method][-1] for method in ends]
    found = []
    for level in LEVELS:
        runs = list_runs(rows, level)
        reference = sum(ends.values()) / 2
        if level in finest:
            reference = ends["soft" if level.method == "rigid" else "rigid"]
        settled = np.array([run["settlement"] for run in runs])
        off, wide = estimate_mean(settled[:, -1] - reference)
        scale = float(np.mean(reference))
        found.append(Summary(
            level, settled, (off / scale, wide / scale), np.array([run["cpu_s"] for run in runs]),
            float(np.mean([run["steps"] for run in runs])), level in finest,
        ))  # fmt: skip
    return found


def check_bars(rows: Sequence[Row]) -> list[Check]:
    """The bars of rigid runs, and each level's error and cost."""
    rigid = [(level, run) for level in LEVELS if level.method == "rigid"
             for run in list_runs(rows, level)]  # fmt: skip
    failed = sum("why" in run for _, run in rigid)
    tilt = max(abs(run["tilt"]) for _, run in rigid)
    overlap = max(run["overlap"] for _, run in rigid) / SMALLEST
    gain = max(-min(run["dissipated"]) / max(run["dissipated"])
               for level, run in rigid if level.value <= FINE)  # fmt: skip
    checks = [
        Check("rigid runs that did not go to their end", failed, "= 0", failed == 0),
        Check("the sleeper's turn", tilt, f"<= {UPRIGHT:g}", tilt <= UPRIGHT, "rad"),
        Check("overlap at the end of half a cycle over the smallest stone", overlap,
              f"<= {OVERLAP:g}", overlap <= OVERLAP),
        Check("energy gained in a cycle over the greatest loss in one, steps of 1 ms and less",
              gain, f"<= {GAIN:g}", gain <= GAIN),
    ]  # fmt: skip
    for each in summarise(rows):
        name = each.level.name
        checks.append(Check(f"{name}: error of the settlement", each.error[0], "reported", True))
        cost = float(each.cost.mean())
        checks.append(Check(f"{name}: cost of a run", cost, "reported", True, "s"))
    return checks
