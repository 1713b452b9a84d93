"""What no slow law goes through: a rate that grows again, and a settlement that falls."""

from dataclasses import dataclass

import numpy as np

from adapters.bed import FloatArray
from adapters.laws import get_law


@dataclass(frozen=True)
class GrowthNumbers:
    """When a rate counts as grown, and a settlement as fallen."""

    block: float = 1 / 8
    """Decades of N over which a rate is a mean, one gap between readings at least [-]: where it
    grows that mean lags, and exceeds the least one before once the rate itself has grown by 1.3."""
    held_out: float = 0.5  # decades at the end that slow laws fitted before it fall short of [-]
    deviations: float = 3.0  # of a reading by which they do, for certain [-]
    share: float = 0.06  # of the range by which they do at least: so far computed beds wander [-]
    most: float = 1e3  # growth that is said at most, as after a standstill [-]
    rows: int = 3  # readings whose median is a level: one outlier moves none [-]
    fall: float = 0.1  # of the range that a level falls by: five deviations of readings of 2 % [-]


GROWTH = GrowthNumbers()
PAST = GrowthNumbers(deviations=5.0, share=0.1)
"""Of growth that has ended since: it was looked for many times, and is to be that much surer."""
PAST_GROWTH, PAST_ROWS = 2.0, 12
"""Least ratio of such a growth [-], and fewest readings up to its end.  Of series N^.2 to N^.45,
two in a hundred that scatter by 1 % seem to have grown so, and ten that scatter by 2 %."""


def measure_growth(
    cycle: FloatArray, displacement: FloatArray, numbers: GrowthNumbers = GROWTH
) -> FloatArray:
    """Rate per cycle at the end over the least one before, (n,), of series (k, n) at cycles (k,).

    Where the series does not show for certain that its rate has grown: 1.  It does where the ratio
    is above 1, and the logarithm and the power law, fitted to what came `GROWTH.held_out` before
    the end, both fall short of the last reading by more than readings scatter about them: the rate
    of a noisy series grows by chance, but not so far beyond what was foreseen.
    """
    edges = [len(cycle) - 1]
    while (earlier := _count_before(cycle, float(cycle[edges[-1]]), numbers.block)) > 0:
        edges.append(earlier - 1)
    moved = np.sign(displacement[-1] - displacement[0])
    before = _count_before(cycle, float(cycle[-1]), numbers.held_out)
    if len(edges) < 3 or before <= get_law("log").minimum_cycles:
        return np.ones_like(moved)
    rows = edges[::-1]
    rate = moved * np.diff(displacement[rows], axis=0) / np.diff(cycle[rows])[:, None]
    least = np.maximum(rate[:-1].min(axis=0), np.abs(rate[-1]) / numbers.most)
    certain = moved != 0
    for law in map(get_law, ("log", "power")):
        if before > law.minimum_cycles:
            parameters = law.fit(cycle[:before], displacement[:before])
            missed = displacement[:before] - law.value(parameters, cycle[:before])
            freedom = max(before - len(parameters), 1)
            noise = np.sqrt((missed * missed).sum(axis=0) / freedom)
            short = moved * (displacement[-1] - law.value(parameters, float(cycle[-1])))
            least_short = numbers.share * np.ptp(displacement, axis=0)
            certain &= short > np.fmax(numbers.deviations * noise, least_short)
    growth = np.divide(rate[-1], least, np.ones_like(least), where=certain & (least > 0))
    return np.maximum(growth, 1.0)


def find_growth(cycle: FloatArray, settlement: FloatArray) -> tuple[int, float] | None:
    """Where the rate of a series (k,) had grown, as in a burst that has calmed since: the last row
    of the latest such growth, and its ratio; None where there was none for certain (`PAST`).

    Readings are looked at up to ends that lie half of `GrowthNumbers.block` apart.
    """
    end, moved = len(cycle), np.sign(settlement[-1] - settlement[0])
    while end > 0:
        end = _count_before(cycle, float(cycle[end - 1]), PAST.block / 2)
        if end < PAST_ROWS:
            break
        if moved * (settlement[end] - settlement[end - 1]) < 0:
            continue  # one bad reading is no growth: the next one does not bear it out
        growth = float(measure_growth(cycle[:end], settlement[:end, None], PAST)[0])
        if growth >= PAST_GROWTH:
            return end - 1, growth
    return None


def find_fall(settlement: FloatArray) -> tuple[int, float] | None:
    """Where the level of a series (k,) falls most, as by tamping: the row behind, and by how much.

    None where it only rises or, of a heave, only sinks, but for `GROWTH.fall`.  Levels are medians
    of the readings before and behind a step.
    """
    away, rows = settlement - settlement[0], GROWTH.rows
    series = np.sign(away[np.abs(away).argmax()]) * settlement
    step, bar = -np.diff(series), GROWTH.fall * float(np.ptp(series))
    levels = [
        np.median(series[max(row - rows, 0) : row]) - np.median(series[row : row + rows])
        for row in range(1, len(series))
    ]
    fallen = np.where(np.array(levels) > max(bar, 0.0), step, 0.0)
    row = int(fallen.argmax())
    return (row + 1, float(levels[row])) if fallen[row] > 0 else None


def _count_before(cycle: FloatArray, end: float, decades: float) -> int:
    """Rows that lie at least so many decades before the cycle ``end``."""
    return int(np.searchsorted(cycle, end / 10**decades * (1 + 1e-9)))
