"""What the record says: means over packings, errors of the ways, what chaos makes, costs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import t as student

from adapters.bed.state import FloatArray
from adapters.procedure.history import sum_cost
from validation.studies.settlement.beds import EVERY, Kind
from validation.study import estimate_mean

Row = dict[str, Any]
FIGURES: dict[str, Callable[[Row], float]] = {
    "settlement": lambda row: float(row["settlement"]),
    "coordination number": lambda row: float(row["state"]["coordination_number"]),
    "elastic deflection": lambda row: float(row["state"]["elastic_deflection"]),
}
"""Figures of a run at the cycle of comparison; settlement is the mean grain's since k_i."""


@dataclass(frozen=True)
class Nested:
    """Mean of runs within packings, with what it scatters by."""

    mean: float
    """Of the packings' means."""
    half: float
    """Half of Student's 95 % interval for the mean over all packings of this kind."""
    half_given: float
    """The same for the mean of runs from these packings."""
    between: float
    """Standard deviation between packings, without the part that comes from within them."""
    within: float
    """Standard deviation between members of one packing, pooled."""
    alone: float
    """Half of the interval of the mean error that one further full run a packing would have: what
    chaos alone makes of a way."""


def nest(values: Sequence[FloatArray]) -> Nested:
    """Figures of runs within packings: ``values`` of P packings, n_p runs each.

    With packing means m_p: mean = sum m_p / P, half = t(P - 1) sqrt(var(m_p) / P).  With s^2 the
    variance within, pooled over sum(n_p - 1) degrees of freedom: half_given = t sqrt(sum s^2/n_p) /
    P, between^2 = var(m_p) - mean(s^2/n_p), at least 0, alone = t s sqrt(mean(1 + 1/n_p) / P).
    """
    means = np.array([each.mean() for each in values])
    counts = np.array([len(each) for each in values])
    packings, freedom = len(means), int(counts.sum()) - len(means)
    variance = float(means.var(ddof=1))
    within = sum(float(((v - v.mean()) ** 2).sum()) for v in values) / freedom
    from_within = float(np.mean(within / counts))
    quantile = float(student.ppf(0.975, freedom))
    return Nested(
        mean=float(means.mean()),
        half=estimate_mean(means)[1],
        half_given=quantile * (from_within / packings) ** 0.5,
        between=max(variance - from_within, 0.0) ** 0.5,
        within=within**0.5,
        alone=quantile * float(within * np.mean(1 + 1 / counts) / packings) ** 0.5,
    )


def select_rows(rows: Sequence[Row], kind: Kind, method: str) -> list[Row]:
    """Runs of a way that reached the last cycle."""
    return [
        row
        for row in rows
        if row["bed"] == kind.name and row["method"] == method and "settlement" in row
    ]


def group_runs(rows: Iterable[Row], value: Callable[[Row], float]) -> dict[int, FloatArray]:
    """A figure of all runs of each packing."""
    found: dict[int, list[float]] = {}
    for row in rows:
        found.setdefault(row["seed"], []).append(value(row))
    return {seed: np.array(found[seed]) for seed in sorted(found)}


def summarise_reference(rows: Sequence[Row], kind: Kind, figure: str) -> Nested:
    """A figure of the full runs."""
    return nest(list(group_runs(select_rows(rows, kind, EVERY), FIGURES[figure]).values()))


def find_errors(rows: Sequence[Row], kind: Kind, method: str, figure: str) -> FloatArray:
    """Errors of a way: a value a packing that it finished, over the full runs' mean of all."""
    mine, truth = (
        {seed: float(each.mean()) for seed, each in group_runs(found, FIGURES[figure]).items()}
        for found in (select_rows(rows, kind, method), select_rows(rows, kind, EVERY))
    )
    return np.array([mine[seed] - truth[seed] for seed in mine]) / np.mean(list(truth.values()))


def judge_layers(rows: Sequence[Row], kind: Kind, method: str) -> float:
    """Rms over layers of the error of the relative density over its mean, mean over runs."""
    truth = {
        seed: np.mean([row["profile"] for row in select_rows(rows, kind, EVERY)
                       if row["seed"] == seed], axis=0)
        for seed in range(1, kind.packings + 1)
    }  # fmt: skip
    found = []
    for row in select_rows(rows, kind, method):
        apart = np.array(row["profile"]) - truth[row["seed"]]
        found.append(float(np.sqrt(np.mean(apart**2))) / float(truth[row["seed"]].mean()))
    return float(np.mean(found))


def find_cost(rows: Sequence[Row]) -> float:
    """CPU time behind k_i [s], each packing counting once."""
    found = group_runs(rows, lambda row: sum_cost(row["cost"]))
    return float(np.mean([each.mean() for each in found.values()]))


def find_speedup(rows: Sequence[Row], kind: Kind, method: str) -> float:
    """CPU time of every cycle over that of a way [-]."""
    return find_cost(select_rows(rows, kind, EVERY)) / find_cost(select_rows(rows, kind, method))


def find_step_speedup(rows: Sequence[Row], kind: Kind, method: str) -> float:
    """The same had a time step cost the same in both [-]: machine and hour do not count.

    Every step of the full runs is taken at what the engine spent on one of the way's, its starts
    apart.  Starts, relaxations and failed tries count on their side.
    """
    mine, truth = select_rows(rows, kind, method), select_rows(rows, kind, EVERY)
    cycle = truth[0]["steps_per_cycle"]
    steps = sum(row["computed"] * row.get("steps_per_cycle", cycle) for row in mine)
    spent = sum(row["cost"]["engine"] - row["cost"].get("start_up", 0.0) for row in mine)
    return truth[0]["computed"] * cycle * (spent / steps) / find_cost(mine)


def find_spread(rows: Sequence[Row], kind: Kind, method: str) -> float:
    """Standard deviation of the settlement over all runs, over the full runs' [-]."""
    mine, truth = (
        np.array([FIGURES["settlement"](row) for row in select_rows(rows, kind, name)])
        for name in (method, EVERY)
    )
    return float(mine.std(ddof=1) / truth.std(ddof=1))
