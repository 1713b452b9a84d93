"""What the record of the ballast study says: errors of every level, their cost, the two limits.

Rigid grains with ever shorter steps and soft grains with ever stiffer contacts should meet: in hard
grains.  Whether they do is measured bed by bed (`Limits`).  The reference of a level is the mean of
the finest level of each method, so that it favours neither; a finest level itself is judged by that
of the other method.  An error is that of the ensemble: the mean over the beds of the difference to
the reference, over the mean of the reference; its interval is Student's for paired differences.  No
single bed is judged: they are chaotic.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from validation.student import interval

Floats = NDArray[np.float64]
Row = dict[str, Any]
Settled = dict[int, float]
FEWEST = 5
"""Beds that make an ensemble."""
WITHIN = (0.5, 0.25)
"""Errors of the mean settlement at which costs are compared [-]."""


@dataclass(frozen=True)
class Limits:
    """The finest level of each method, and whether the two meet."""

    rigid: str
    soft: str
    ends: dict[str, Settled]
    """Settlement after the last cycle [m] by method and seed."""
    difference: float
    """Mean of rigid less soft settlement [m] ..."""
    interval: float
    """... and the half width of its 95 % interval [m]."""

    @property
    def reference(self) -> Settled:
        """Mean of both limits [m], by seed."""
        both = self.ends["rigid"].keys() & self.ends["soft"].keys()
        return {s: 0.5 * (self.ends["rigid"][s] + self.ends["soft"][s]) for s in sorted(both)}

    @property
    def mean(self) -> float:
        """Mean settlement of the reference [m]."""
        return float(np.mean(list(self.reference.values())))

    @property
    def agree(self) -> bool:
        """The two methods can not be told apart by these beds."""
        return abs(self.difference) <= self.interval

    def reference_of(self, name: str) -> Settled:
        """What a level is judged by: both limits; a limit itself by the other one."""
        if name == self.rigid:
            return self.ends["soft"]
        return self.ends["rigid"] if name == self.soft else self.reference


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
    median: float
    """Median of it [m]."""
    curve: Floats
    """Mean settlement after each cycle [m]."""
    error: float
    """Mean difference to the reference over the reference's mean [-], and its half width."""
    error_interval: float
    cost: float
    """Mean processor time of a run [s], and the half width of its interval."""
    cost_interval: float
    costs: Settled
    """Processor time [s] by seed."""
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

    def within(self, most: float) -> str:
        """Is the error at most ``most`` [-]?  ``yes`` or ``no`` where the whole interval says so,
        else ``open``."""
        if abs(self.error) + self.error_interval <= most:
            return "yes"
        return "no" if abs(self.error) - self.error_interval > most else "open"


def runs_of(rows: Sequence[Row], name: str) -> dict[int, Row]:
    """Runs of a level that went to their end, by seed."""
    return {row["bed"]["seed"]: row for row in rows
            if row["kind"] in ("rigid", "soft") and row["name"] == name and row["ok"]}  # fmt: skip


def level_names(rows: Sequence[Row], method: str) -> list[str]:
    """Names of a method's levels in the record, the coarse ones first."""
    found = {row["name"]: row["level"] for row in rows if row["kind"] == method}
    sign = -1.0 if method == "rigid" else 1.0
    return sorted(found, key=lambda name: (sign * found[name]["value"], -found[name]["extra"]))


def limits_of(rows: Sequence[Row]) -> Limits:
    """The finest levels that have an ensemble of beds, else those of the most beds."""
    finest = {}
    for method in ("rigid", "soft"):
        names = level_names(rows, method)
        whole = [name for name in names if len(runs_of(rows, name)) >= FEWEST]
        best = whole or sorted(names, key=lambda name: len(runs_of(rows, name)))
        finest[method] = best[-1]
    ends = {m: last_settlement(runs_of(rows, finest[m])) for m in ("rigid", "soft")}
    both = sorted(ends["rigid"].keys() & ends["soft"].keys())
    apart = interval([ends["rigid"][s] - ends["soft"][s] for s in both])
    return Limits(finest["rigid"], finest["soft"], ends, *apart)


def last_settlement(runs: dict[int, Row]) -> Settled:
    """Settlement after the last cycle [m] by seed."""
    return {seed: row["settlement"][-1] for seed, row in runs.items()}


def summaries(rows: Sequence[Row], limits: Limits) -> list[Summary]:
    """Every level that has at least two beds in common with its reference."""
    found = []
    for method in ("rigid", "soft"):
        for name in level_names(rows, method):
            runs, reference = runs_of(rows, name), limits.reference_of(name)
            seeds = sorted(runs.keys() & reference.keys())
            if len(seeds) < 2:
                continue
            mine = [runs[seed] for seed in seeds]
            settled = [row["settlement"][-1] for row in mine]
            scale = abs(float(np.mean([reference[s] for s in seeds])))
            off, wide = interval([runs[s]["settlement"][-1] - reference[s]
                                            for s in seeds])  # fmt: skip
            costs = {seed: row["cpu_s"] for seed, row in zip(seeds, mine, strict=True)}
            found.append(Summary(
                name, method, mine[0]["level"], len(seeds), *interval(settled),
                float(np.median(settled)), np.mean([row["settlement"] for row in mine], axis=0),
                off / scale, wide / scale, *interval(list(costs.values())), costs,
                float(np.mean([row["step_s"] for row in mine])),
                float(np.median([row["deflection"] for row in mine])),
                np.mean([row["dissipated"] for row in mine], axis=0),
                {key: float(np.mean([row["fabric"][key] for row in mine]))
                 for key in mine[0]["fabric"]},
                name in (limits.rigid, limits.soft),
            ))  # fmt: skip
    return found


def cheapest(found: Sequence[Summary], method: str, most: float, shown: bool) -> Summary | None:
    """The cheapest level of a method whose error is ``shown`` to be at most ``most`` [-], or, if
    not ``shown``, is not shown to be larger; None if there is none."""
    good = ("yes",) if shown else ("yes", "open")
    mine = [s for s in found if s.method == method and s.within(most) in good]
    return min(mine, key=lambda s: s.cost, default=None)


def cost_ratio(soft: Summary, rigid: Summary) -> tuple[float, float, float]:
    """Cost of soft over that of rigid grains on the same beds: geometric mean and 95 % interval."""
    both = sorted(soft.costs.keys() & rigid.costs.keys())
    mean, half = interval([np.log(soft.costs[s] / rigid.costs[s]) for s in both])
    return float(np.exp(mean)), float(np.exp(mean - half)), float(np.exp(mean + half))


def gain_most(rows: Sequence[Row]) -> float:
    """Greatest energy gained in a cycle, of the greatest loss in a cycle of the same run [-]."""
    return max(-min(row["dissipated"]) / max(row["dissipated"]) for row in rows)
