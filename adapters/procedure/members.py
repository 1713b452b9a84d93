"""What the members of a run say together: the result with its band, and the error of the jumps.

A bed of grains is chaotic, so that one run is one draw of many.  Members go on from one state after
k_i cycles, the m-th with its first grain moved by m times 1e-10 m: what they differ by is chaos.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import isfinite, nan, sqrt
from typing import Any

import numpy as np

from adapters.bed import FloatArray
from adapters.jumps import BAND_PROBABILITY
from adapters.procedure.history import History, find_speed_up, sum_cost
from adapters.procedure.record import Record

PRESCRIBED = 1e-6
"""Of the mean grain's settlement: a body that settles by less is not driven by a force [-]."""


@dataclass(frozen=True)
class Mean:
    """A mean over members, in the unit of what was averaged; nan where not known."""

    value: float
    band: tuple[float, float] | None = None
    """Student's interval of the mean, with `BAND_PROBABILITY`; None of a single member."""
    chaos: float = nan  # standard deviation between members


@dataclass(frozen=True)
class Settled:
    """The result of a run over its members, at the cycle where the first of them is; SI units."""

    members: int  # that have reached the cycle
    asked: int  # members in all
    cycle: int
    loaded_body: Mean  # permanent settlement of the loaded body since the preparation [m]
    first_cycle: Mean  # of it in the first cycle, which the body finds its seat in [m]
    stiffness: Mean  # secant stiffness under it in the last cycles computed [N/m]
    mean_grain: Mean
    """Settlement of the mean grain [m]; of one run with a tolerance its band is that of a full run
    from the same state."""
    cost: float  # CPU time of all members without full runs, what they share counted once [s]
    pairs: int  # members compared with a full run from the same state
    compared_at: int  # cycle of that comparison; 0 without one
    error: Mean
    """Gain of the loaded body since the first jump, less that of the full run, over the mean gain
    of the full runs; its chaos is what these differ by."""
    mean_grain_error: Mean  # likewise
    full_run: Mean  # permanent settlement of the loaded body in the full runs by then [m]
    full_stiffness: Mean  # secant stiffness under it there [N/m]
    speed_up: float  # CPU time of the full runs over that of the members beside them

    def __str__(self) -> str:
        """How far the loaded body, which stands for a sleeper, settles, and what else is known."""
        members = f"{self.members} of {self.asked}" if self.members < self.asked else ""
        body = format_length(self.loaded_body, members or f"{self.members}")
        said = f"sleeper settles {body} by cycle {self.cycle:,}"
        if self.cycle > 1 and isfinite(first := self.first_cycle.value) and first:
            said += f", {format_length(Mean(first))} of it in the first"
        full = "full run" if self.pairs == 1 else "full runs"
        if isfinite(self.stiffness.value):
            said += f"; stiffness {1e-6 * self.stiffness.value:.3g} kN/mm"
            if isfinite(self.full_stiffness.value) and self.compared_at == self.cycle:
                said += f" ({full}: {1e-6 * self.full_stiffness.value:.3g})"
        if isfinite(self.speed_up):
            dearer = self.speed_up < 1
            ratio = 1 / self.speed_up if dearer else self.speed_up
            said += f"; {ratio:.1f} times {'dearer' if dearer else 'cheaper'}"
        at = f" at cycle {self.compared_at:,}" * (self.compared_at != self.cycle)
        said += format_error(self.error, at)
        known = isfinite(self.error.value)
        return said + f"; {full}: {format_length(replace(self.full_run, chaos=nan))}" * known


def estimate_mean(values: FloatArray, probability: float) -> tuple[Any, Any]:
    """Mean over axis 0 and half of Student's interval, t_(n-1) s/sqrt(n); nan for one sample.

    ``values`` of shape (n, ...), a sample in each row; independent and normal.
    """
    from scipy.special import stdtrit

    n = len(values)
    mean = values.mean(axis=0)
    if n < 2:
        return mean, np.full_like(mean, np.nan)
    factor = float(stdtrit(n - 1, 0.5 + probability / 2)) / sqrt(n)
    return mean, factor * values.std(axis=0, ddof=1)


def average_members(values: Sequence[float] | FloatArray) -> Mean:
    """Mean, interval and chaos of a value a member, of those that are known."""
    found = np.array([value for value in values if isfinite(value)])
    if len(found) < 2:
        return Mean(*found.tolist() or [nan])
    mean, half = map(float, estimate_mean(found, BAND_PROBABILITY))
    return Mean(mean, (mean - half, mean + half), float(found.std(ddof=1)))


def judge_members(record: Record) -> Settled | None:
    """The result of a run as far as it has come; None before its first cycle is done."""
    if not len(record.run.history.cycle):
        return None
    cycle, at = int(record.run.history.cycle[-1]), record.comparable_cycle
    runs = [one for one in (record, *record.members) if cycle in one.run.history.cycle]
    pairs = [
        (one.run.history, one.control.history)
        for one in runs
        if one.control is not None and at and one.comparable_cycle == at
    ]
    jumps = [span[0] for one in runs for span in one.run.spans]
    sunk, seated, grain = (
        average_members([one.run.history.gain(0, last, of) for one in runs])
        for last, of in ((cycle, "loaded_body"), (1, "loaded_body"), (cycle, "settlement"))
    )
    band = record.run.estimate_band()
    if len(runs) == 1 and band is not None:
        grain = replace(grain, band=(band.low, band.high))
    error, grain_error = (
        compare_pairs(pairs, min(jumps, default=at), at, of) for of in ("loaded_body", "settlement")
    )
    full = average_members([one.gain(0, at, "loaded_body") for _, one in pairs])
    full_stiffness = average_members([one.late_mean("stiffness", at) for _, one in pairs])
    spent, spent_by_full = (sum(pair[i].gain(0, at, "cpu_s") for pair in pairs) for i in (0, 1))
    return Settled(
        members=len(runs), asked=record.asked, cycle=cycle, loaded_body=sunk, first_cycle=seated,
        stiffness=average_members([one.run.history.late_mean("stiffness", cycle) for one in runs]),
        mean_grain=grain, cost=sum_members_cost(record), pairs=len(pairs), compared_at=at,
        error=error, mean_grain_error=grain_error, full_run=full, full_stiffness=full_stiffness,
        speed_up=find_speed_up(spent_by_full, spent),
    )  # fmt: skip


def compare_pairs(
    pairs: Sequence[tuple[History, History]], first: int, cycle: int, of: str
) -> Mean:
    """Error of the gain ``of`` a column from cycle ``first`` on, of runs beside full runs."""
    own, full = (
        np.array([pair[which].gain(first, cycle, of) for pair in pairs]) for which in (0, 1)
    )
    gained = abs(full.mean()) if len(pairs) else 0.0
    if not gained:
        return average_members([])
    return replace(
        average_members((own - full) / gained), chaos=average_members(full / gained).chaos
    )


def sum_members_cost(record: Record) -> float:
    """CPU time of all finished stages but those of full runs, shared ones counted once [s]."""
    shared = record.scene.procedure.k_i if record.scene.procedure else 0
    own = [o for one in record.members for o in one.run.outcomes if o.last_cycle > shared]
    return sum(sum_cost(outcome.cost) for outcome in (*record.run.outcomes, *own))


def describe_result(record: Record) -> list[str]:
    """What came out so far: a sentence on the mean grain, then the one that an engineer asks for,
    where there is a loaded body; none before a cycle."""
    settled = judge_members(record)
    if settled is None:
        return []
    computed = record.run.history.count_computed(settled.cycle)
    how = "all" if computed == settled.cycle else f"{computed:,}"
    said = f"mean grain settles {format_length(settled.mean_grain)}"
    said += f"; {how} of {settled.cycle:,} cycles computed{record.run.exchanged}"
    said += format_error(settled.mean_grain_error)
    if abs(settled.loaded_body.value) <= PRESCRIBED * abs(settled.mean_grain.value):
        return [f"{said}; the loaded body goes a prescribed way and does not settle"]
    return [said, *([str(settled)] if isfinite(settled.loaded_body.value) else [])]


def format_length(length: Mean, members: str = "") -> str:
    """A length with its band, or why it has none: in mm from 1 mm on, else in um."""
    unit, scale = ("mm", 1e3) if abs(length.value) >= 1e-3 else ("um", 1e6)
    low, high = length.band or (nan, nan)
    known = [f"{scale * low:.3g} ... {scale * high:.3g}"] if length.band else []
    if members:
        known.append(f"{members} members" if members != "1" else "one member, so no band")
    if isfinite(length.chaos):
        known.append(f"chaos {scale * length.chaos:.2g}")
    return f"{scale * length.value:.3g} {unit}" + f" ({'; '.join(known)})" * bool(known)


def format_error(error: Mean, at: str = "") -> str:
    """An error of the gain in per cent, its band and what full runs differ by; empty for none."""
    if not isfinite(error.value):
        return ""
    said = f"; error{at} {100 * error.value:+.1f} %"
    if error.band:
        said += " ({:+.1f} ... {:+.1f})".format(*(100 * end for end in error.band))
        said += f", chaos of the full runs {100 * error.chaos:.1f} %"
    return said
