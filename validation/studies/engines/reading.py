"""Differences of two ways on the same beds, and speeds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from adapters.bed.state import FloatArray
from validation.study import estimate_mean

Row = dict[str, Any]
ENGINES = ("liggghts", "lammps", "yade")
TITLES = {"liggghts": "LIGGGHTS", "lammps": "LAMMPS", "yade": "YADE"}
FIGURES = {
    "settlement": ("settlement, µm", 1e6, 0),
    "settlement_after_first": ("cycles 2 to 50, µm", 1e6, 0),
    "coordination": ("coordination number", 1.0, 3),
    "density": ("relative density", 1.0, 4),
    "deflection": ("elastic deflection, µm", 1e6, 2),
}
"""Key of a row: words, factor, decimals."""
FAST = ("settlement", "stiffness", "dissipated")
"""What a time step twice as long is judged by."""
JUDGED = ("settlement", "coordination", "density")
"""Figures that the protocol judges."""
LEVEL = 1 - 0.05 / 9
"""Of an interval that is one of nine."""
TWIN = ("the twin: noise", "liggghts, twin", "liggghts")
"""Words, the run that starts 1e-9 m aside, the run itself."""


def group_by_way(rows: Sequence[Row]) -> dict[str, dict[int, Row]]:
    """Runs that gave figures, by way and seed."""
    found: dict[str, dict[int, Row]] = {}
    for row in rows:
        if row.get("ok"):
            found.setdefault(row["way"], {})[row["seed"]] = row
    return found


def pair(runs: dict[str, dict[int, Row]], way: str, other: str, key: str) -> FloatArray:
    """Differences ``way`` less ``other`` over the beds that both have it of, shape (beds, ...)."""
    seeds = [seed for seed in sorted(runs[way].keys() & runs[other].keys())
             if key in runs[way][seed] and key in runs[other][seed]]  # fmt: skip
    mine, theirs = ([runs[name][seed][key] for seed in seeds] for name in (way, other))
    return np.subtract(mine, theirs)


def format_mean(values: FloatArray, key: str, signed: bool = True) -> str:
    """Mean and interval in the units of `FIGURES`."""
    _, factor, digits = FIGURES[key]
    mean, half = estimate_mean(values * factor)
    return f"{mean:{'+' if signed else ''}.{digits}f} ± {half:.{digits}f}"


def excludes_zero(values: FloatArray, level: float = 0.95) -> bool:
    """Whether zero is outside of the interval of the mean."""
    mean, half = estimate_mean(values, level)
    return bool(abs(mean) > half)


def find_median_speed(rows: Sequence[Row], engine: str, grains: int) -> tuple[float, float, float]:
    """Grain-steps a CPU second: median, least and greatest of the runs."""
    found = [
        grains * (row["steps"][1] - row["steps"][0]) / row["steps_cpu_s"]
        for row in rows
        if row.get("speed") == engine and row["grains"] == grains
    ]
    return float(np.median(found)), min(found), max(found)
