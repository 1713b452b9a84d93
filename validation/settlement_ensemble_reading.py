"""What the ensemble says: means of runs within packings, their bands, their spread, their cost."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from statistics import median

import numpy as np

from adapters.state import FloatArray
from validation.settlement_ensemble import Kind, Piece
from validation.settlement_ensemble_record import COLUMNS, EnsembleRecord

LAST = 10
"""Cycle ends over which figures of the state are averaged, the told one the last."""

LEVEL = 0.95
"""Of the intervals."""

Curve = dict[str, FloatArray]
"""Columns of a table by name, shape (cycles,) each."""
Figure = Callable[[Curve, int, int], float]
"""A figure of a curve at a cycle, for a kind's k_i; nan where it has none."""


@dataclass(frozen=True)
class Nested:
    """Mean of runs within packings, with what it scatters by."""

    mean: float
    """Of the packings' means."""
    half: float
    """Half of Student's interval for the mean over all packings of this kind."""
    half_given: float
    """Half of Student's interval for the mean of runs from these packings."""
    between: float
    """Standard deviation between packings, without the part that comes from within them."""
    within: float
    """Standard deviation between members of one packing, pooled."""
    packings: int
    members: int


def nested(values: dict[int, FloatArray]) -> Nested:
    """Figures of runs within packings: ``values`` of P packings, n_p runs each.

    With packing means m_p: mean = sum m_p / P, half = t(P - 1) sqrt(var(m_p) / P).  With s^2 the
    variance within, pooled over sum(n_p - 1) degrees of freedom: half_given = t sqrt(sum s^2/n_p)/P
    and between^2 = var(m_p) - mean(s^2/n_p), at least 0.  What too few runs leave open is nan.
    """
    means = np.array([v.mean() for v in values.values()])
    counts = np.array([len(v) for v in values.values()])
    packings, freedom = len(means), int(counts.sum()) - len(means)
    nan = float("nan")
    variance = float(means.var(ddof=1)) if packings > 1 else nan
    squares = sum(float(((v - v.mean()) ** 2).sum()) for v in values.values())
    within = squares / freedom if freedom else nan
    from_within = float(np.mean(within / counts))
    return Nested(
        mean=float(means.mean()),
        half=student(packings - 1) * (variance / packings) ** 0.5,
        half_given=student(freedom) * (from_within / packings) ** 0.5,
        between=max(variance - from_within, 0.0) ** 0.5 if variance == variance else nan,
        within=within**0.5,
        packings=packings,
        members=int(counts.sum()),
    )


def student(freedom: int) -> float:
    """Quantile of Student's distribution for a two-sided interval of `LEVEL`; nan without any."""
    from scipy.stats import t

    return float(t.ppf(0.5 + LEVEL / 2, freedom)) if freedom > 0 else float("nan")


def curves(kind: Kind, record: EnsembleRecord) -> dict[Piece, Curve]:
    """Tables of all runs of a kind that have rows, members with their packing's before theirs."""
    tables = {piece: record.table(piece.name) for piece in kind.runs()}
    return {
        piece: table
        if piece.packing is None
        else {c: np.concatenate([tables[piece.packing][c], table[c]]) for c in COLUMNS}
        for piece, table in tables.items()
        if len(table["cycle"])
    }


def at_cycle(kind: Kind, runs: dict[Piece, Curve], figure: Figure, cycle: int) -> Nested | None:
    """A figure of all runs that reached ``cycle``: packings up to k_i, members behind it."""
    values: dict[int, list[float]] = {}
    for piece, curve in runs.items():
        own = piece.first < cycle <= piece.last and cycle <= curve["cycle"][-1]
        value = figure(curve, cycle, kind.k_i) if own else float("nan")
        if value == value:
            values.setdefault(piece.seed, []).append(value)
    return nested({seed: np.array(v) for seed, v in values.items()}) if values else None


def column_at(name: str) -> Figure:
    """The value of a column at the end of a cycle."""

    def value(curve: Curve, cycle: int, k_i: int) -> float:
        return float(curve[name][cycle - 1])

    return value


def column_since(name: str, sign: float) -> Figure:
    """``sign`` times the change of a column since cycle k_i; nan up to it."""

    def value(curve: Curve, cycle: int, k_i: int) -> float:
        change = curve[name][cycle - 1] - curve[name][k_i - 1] if cycle > k_i else np.nan
        return sign * float(change)

    return value


def column_mean(name: str) -> Figure:
    """Mean of a column over the `LAST` cycles up to one; nan before there are so many."""

    def value(curve: Curve, cycle: int, k_i: int) -> float:
        return float(curve[name][cycle - LAST : cycle].mean()) if cycle >= LAST else float("nan")

    return value


@dataclass(frozen=True)
class Cost:
    """CPU time of the engine for a kind."""

    rain: float
    """Of a rain of grains, median [s]; nan before the first."""
    cycle: float
    """Of a load cycle, median over all cycles [s]; nan before the first."""
    cycles_done: int
    cycles_planned: int
    spent: float
    """So far [s]."""
    missing: float
    """Still to spend by these medians [s]."""


def cost(kind: Kind, record: EnsembleRecord) -> Cost:
    """What a kind has cost and what it still needs; a run that failed needs nothing more."""
    rains, cycles, done, planned, left = [], [], 0, 0, 0
    for piece in kind.runs():
        kept = record.kept(piece.name)
        length = piece.last - piece.first
        planned += length
        here = 0 if kept is None else kept.cycle - piece.first
        done += here
        left += 0 if kept is not None and kept.failed else length - here
        if kept is not None and kept.preparation:
            rains.append(float(kept.preparation["cpu_s"]))
        cycles += record.table(piece.name)["cpu_s"].tolist()
    rain = median(rains) if rains else float("nan")
    cycle = median(cycles) if cycles else float("nan")
    to_rain = kind.packings - len(rains)
    return Cost(
        rain,
        cycle,
        done,
        planned,
        sum(rains) + sum(cycles),
        left * cycle + (to_rain * rain if to_rain else 0.0),
    )
