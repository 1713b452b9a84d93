"""What the record of the ballast study says: errors of every level, their cost, the two limits.

Rigid grains with ever shorter steps and soft grains with ever stiffer contacts should meet: in hard
grains.  Whether they do is measured (`Limits`), bed by bed.  The reference is the finest rigid
level, for at the stiffnesses that can be paid for the soft ones still come nearer to it; so the
errors of rigid levels are those of their own convergence.  An error is that of the ensemble: the
mean over the beds of the difference to the reference, over the mean of the reference; its interval
is Student's for paired differences.  No single bed is judged.  Levels are compared by the median,
as a slip of one bed moves a mean by more than all levels differ.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from validation.rigid_ballast_measures import mean_with_interval

Floats = NDArray[np.float64]
Row = dict[str, Any]
FEWEST = 5
"""Beds that make an ensemble."""


@dataclass(frozen=True)
class Limits:
    """The finest level of each method, and the reference made of them."""

    rigid: str
    soft: str
    reference: dict[int, float]
    """Settlement after the last cycle by the finest rigid level [m], by seed."""
    difference: float
    """Mean of rigid less soft settlement [m] ..."""
    interval: float
    """... and the half width of its 95 % interval [m]."""
    soft_limit: float
    """Mean settlement to which three soft levels of equal ratio tend (Aitken) [m]; nan without."""

    @property
    def mean(self) -> float:
        """Mean settlement of the reference [m]."""
        return float(np.mean(list(self.reference.values())))

    @property
    def agree(self) -> bool:
        """The two methods can not be told apart by these beds."""
        return abs(self.difference) <= self.interval


@dataclass(frozen=True)
class Summary:
    """A level over all its beds."""

    name: str
    method: str
    level: Row
    beds: int
    settlement: float
    """Mean settlement after the last cycle [m], and the half width of its interval."""
    interval: float
    curve: Floats
    """Mean settlement after each cycle [m]."""
    median: float
    """Median settlement after the last cycle [m]: a single slip of one bed does not move it."""
    median_bias: float
    """Median less the reference's, over the latter [-]."""
    bias: float
    """Mean difference to the reference over the reference's mean [-], and its half width."""
    bias_interval: float
    cost: float
    """Mean processor time of a run [s]."""
    step: float
    """Mean length of a step [s]."""
    deflection: float
    """Median elastic recoil of the last cycle [m]."""
    lost: Floats
    """Mean energy dissipated in each cycle [J per metre of track]."""
    fabric: dict[str, float]
    """Means of the fabric under the last peak load."""
    is_limit: bool
    """It is the finest of its method."""


def runs_of(rows: Sequence[Row], name: str) -> dict[int, Row]:
    """Runs of a level that went to their end, by seed."""
    return {row["bed"]["seed"]: row for row in rows if row.get("name") == name and row.get("ok")
            and row["kind"] != "state"}  # fmt: skip


def level_names(rows: Sequence[Row], method: str) -> list[str]:
    """Names of a method's levels in the record, the coarse ones first."""
    found = {row["name"]: row["level"] for row in rows if row["kind"] == method}
    sign = -1.0 if method == "rigid" else 1.0
    return sorted(found, key=lambda name: (sign * found[name]["value"], -found[name]["extra"]))


def limits_of(rows: Sequence[Row]) -> Limits:
    """The finest levels that have an ensemble of beds, else the most beds; the reference."""
    finest = {}
    for method in ("rigid", "soft"):
        usual = [row["level"]["extra"] for row in rows if row["kind"] == method]
        main = max(set(usual), key=usual.count)  # the controls differ in it
        names = [
            name for name in level_names(rows, method)
            if next(iter(runs_of(rows, name).values()), {"level": {"extra": None}})["level"][
                "extra"
            ] == main
        ]  # fmt: skip
        whole = [name for name in names if len(runs_of(rows, name)) >= FEWEST]
        best = whole or sorted(names, key=lambda name: len(runs_of(rows, name)))
        finest[method] = best[-1]
    rigid, soft = (last_settlement(runs_of(rows, finest[m])) for m in ("rigid", "soft"))
    both = sorted(rigid.keys() & soft.keys())
    difference, interval = mean_with_interval([rigid[s] - soft[s] for s in both])
    reference = {s: rigid[s] for s in both}
    limit = soft_limit(rows, both)
    return Limits(finest["rigid"], finest["soft"], reference, difference, interval, limit)


def soft_limit(rows: Sequence[Row], seeds: Sequence[int]) -> float:
    """Aitken's extrapolation of mean settlements of the three stiffest levels [m].

    They must be a constant factor of stiffness apart, have all these seeds and go down ever less;
    nan otherwise.
    """
    found = []
    for name in level_names(rows, "soft"):
        runs = runs_of(rows, name)
        if runs.keys() >= set(seeds):
            settled = last_settlement(runs)
            found.append((runs[seeds[0]]["level"]["value"], np.mean([settled[s] for s in seeds])))
    if len(found) < 3:
        return float("nan")
    (k1, s1), (k2, s2), (k3, s3) = found[-3:]
    if not (np.isclose(k2 / k1, k3 / k2) and s1 > s2 > s3 and s1 - s2 > s2 - s3):
        return float("nan")
    return float(s3 - (s3 - s2) ** 2 / ((s3 - s2) - (s2 - s1)))


def last_settlement(runs: dict[int, Row]) -> dict[int, float]:
    """Settlement after the last cycle [m] by seed."""
    return {seed: row["settlement"][-1] for seed, row in runs.items()}


def summaries(rows: Sequence[Row], limits: Limits) -> list[Summary]:
    """Every level that has at least two beds in common with the reference."""
    found = []
    for method in ("rigid", "soft"):
        for name in level_names(rows, method):
            runs = runs_of(rows, name)
            seeds = sorted(runs.keys() & limits.reference.keys())
            if len(seeds) < 2:
                continue
            mine = [runs[seed] for seed in seeds]
            settled = last_settlement(runs)
            mean, interval = mean_with_interval([settled[s] for s in seeds])
            scale = abs(float(np.mean([limits.reference[s] for s in seeds])))
            middle = float(np.median([settled[s] for s in seeds]))
            own = float(np.median([limits.reference[s] for s in seeds]))
            bias, wide = mean_with_interval([settled[s] - limits.reference[s] for s in seeds])
            found.append(Summary(
                name, method, mine[0]["level"], len(seeds), mean, interval,
                np.mean([row["settlement"] for row in mine], axis=0), middle,
                (middle - own) / abs(own), bias / scale, wide / scale,
                float(np.mean([row["cpu_s"] for row in mine])),
                float(np.mean([row["step_s"] for row in mine])),
                float(np.median([row["deflection"] for row in mine])),
                np.mean([row["dissipated"] for row in mine], axis=0),
                {key: float(np.mean([row["fabric"][key] for row in mine]))
                 for key in mine[0]["fabric"]},
                name in (limits.rigid, limits.soft),
            ))  # fmt: skip
    return found


@dataclass(frozen=True)
class Duel:
    """A rigid level against the soft one that errs no more than it, at the least cost."""

    rigid: Summary
    soft: Summary | None
    """None where no soft level errs as little."""

    @property
    def cost_ratio(self) -> float:
        """Cost of soft over rigid grains at equal error [-]; inf where none errs as little."""
        return float("inf") if self.soft is None else self.soft.cost / self.rigid.cost


def near(summary: Summary) -> float:
    """Error of the median without its sign [-]: what levels are compared by."""
    return abs(summary.median_bias)


def duels(found: Sequence[Summary]) -> list[Duel]:
    """Every rigid level but the reference against the cheapest soft one of no larger error."""
    result = []
    for mine in found:
        if mine.method == "rigid" and not mine.is_limit:
            good = [s for s in found if s.method == "soft" and near(s) <= near(mine)]
            result.append(Duel(mine, min(good, key=lambda s: s.cost, default=None)))
    return result


def gain_most(rows: Sequence[Row]) -> float:
    """Greatest energy gained in a cycle, of the greatest loss in a cycle of the same run [-]."""
    return max(-min(row["dissipated"]) / max(row["dissipated"]) for row in rows)
