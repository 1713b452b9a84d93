"""What the record says: errors of the ways packing by packing, their intervals, costs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from adapters.bed.state import FloatArray
from adapters.procedure.history import sum_cost
from validation.studies.settlement.beds import EVERY, Kind
from validation.study import estimate_mean

Row = dict[str, Any]
LEVEL = 0.9
"""Of the interval of a mean error: inside +-m it shows equivalence within m by two one-sided tests
at 5 % (Schuirmann 1987)."""


def select_rows(rows: Sequence[Row], kind: Kind, way: str) -> dict[int, Row]:
    """Runs of a way that reached the last cycle, by packing."""
    return {
        row["seed"]: row
        for row in rows
        if row["bed"] == kind.name and row["way"] == way and "loaded_body" in row
    }


def find_errors(rows: Sequence[Row], kind: Kind, way: str, figure: str) -> FloatArray:
    """Errors of a way, one a packing that has both runs, over the mean of its full runs [-].

    Packings where either has no such figure, as a stiffness that is not known, are left out.
    """
    mine, full = select_rows(rows, kind, way), select_rows(rows, kind, EVERY)
    pairs = np.array([(mine[seed][figure], full[seed][figure]) for seed in mine if seed in full])
    pairs = pairs.reshape(-1, 2).astype(float)
    pairs = pairs[np.isfinite(pairs).all(axis=1)]
    errors: FloatArray = pairs[:, 0] - pairs[:, 1]
    return errors / pairs[:, 1].mean() if len(errors) else errors


def find_interval(errors: FloatArray) -> tuple[float, float]:
    """The interval of the mean error at `LEVEL` [-]; without bounds for fewer than two packings."""
    mean, half = estimate_mean(errors, LEVEL) if len(errors) > 1 else (0.0, np.inf)
    return mean - half, mean + half


def find_cost(rows: Sequence[Row]) -> float:
    """Mean CPU time behind k_i [s]."""
    return float(np.mean([sum_cost(row["cost"]) for row in rows]))


def find_step_speedup(rows: Sequence[Row], kind: Kind, way: str) -> float:
    """Cost of every cycle over that of a way, had a step cost the same in both [-].

    Every step of the full runs is taken at what the engine spent on one of the way's, its starts
    apart, so machine and hour do not count.  Starts, relaxations and failed tries count on their
    side.
    """
    mine, full = (list(select_rows(rows, kind, name).values()) for name in (way, EVERY))
    if not mine or not full:
        return float("nan")
    cycle = full[0]["steps_per_cycle"]
    steps = sum(row["computed"] * row.get("steps_per_cycle", cycle) for row in mine)
    spent = sum(row["cost"]["engine"] - row["cost"].get("start_up", 0.0) for row in mine)
    whole = np.mean([row["computed"] for row in full]) * cycle
    return float(whole * (spent / steps) / find_cost(mine))
