"""What the slow laws say of a later cycle, each on three windows, and how they did once before.

All functions take n series at once: displacements (k, n) at ascending cycles > 0, (k,).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from adapters.bed import FloatArray
from adapters.errors import UsageError
from adapters.laws import get_law
from adapters.laws.fit.regime import TAIL, select_tail

BoolArray = NDArray[np.bool_]

SLOW_LAWS = ("log", "power", "hyperbolic", "stretched-exponential", "inverse-log")
"""Laws whose rate falls: those with a term b N explode when they are extrapolated."""
BOUNDED_LAWS = ("hyperbolic", "stretched-exponential", "inverse-log")
"""Those of them whose total has an end."""


@dataclass(frozen=True)
class CandidateNumbers:
    """Windows of the laws, the rows that they are fitted to, and their votes."""

    window_decades: tuple[float, ...] = (1.0, 2.0, np.inf)
    """The tail alone knows best where the bed goes, all data what noise is: neither is trusted."""
    rows_per_decade: int = 24
    """Means that cycles are thinned to: each decade weighs the same, and a fit costs the same."""
    rows_fewest: int = 4  # that show a regime
    veto: float = 3.0  # median misses of the held-out block with which a candidate has no vote [-]


CANDIDATES = CandidateNumbers()


@dataclass(frozen=True)
class Candidates:
    """Predictions of c candidates, each a law on a window, for n series."""

    law: tuple[str, ...]
    increment: FloatArray  # from the last cycle to the one asked for, shape (c, n)
    miss: FloatArray
    """Absolute error on the held-out block's last cycle, (c, n); nan where not tested."""
    distance: float  # ln(N_k / N_h), length of the held-out block; 0 where there was none
    combined_miss: FloatArray  # error of the candidates' median there, shape (n,)
    happened: FloatArray  # increment there, shape (n,)

    def votes(self, bounded: BoolArray, unbounded: BoolArray) -> BoolArray:
        """True for candidates that have a vote, shape (c, n); half of the admitted ones at least.

        ``bounded`` and ``unbounded``, shape (n,): series whose total has an end, or has none, for
        certain.  Only laws of the same kind are admitted there, and all where neither is certain.
        """
        ends = np.array([law in BOUNDED_LAWS for law in self.law])[:, None]
        admitted = np.where(ends, ~unbounded, ~bounded)
        tested = admitted & ~np.isnan(self.miss)
        if not tested.any():
            return admitted
        bound = CANDIDATES.veto * np.nanmedian(np.where(tested, self.miss, np.nan), axis=0)
        return admitted & ~(self.miss > bound)

    def median(self, votes: BoolArray) -> FloatArray:
        """Median increment of those that have a vote, shape (n,)."""
        return np.asarray(np.nanmedian(np.where(votes, self.increment, np.nan), axis=0))

    def spread(self, bounded: BoolArray, probability: float) -> tuple[FloatArray, FloatArray]:
        """Increments between which the middle ``probability`` of the candidates lies, (n,) each.

        All count, whatever they missed; but where the total has an end not the power law, which
        never slows down to the logarithm.
        """
        slow = np.array([law != "power" for law in self.law])
        kept = np.where(slow[:, None] | ~bounded, self.increment, np.nan)
        outer = (1 - probability) / 2, (1 + probability) / 2
        low, high = np.nanquantile(kept, outer, axis=0)
        return low, high


def thin_rows(cycle: FloatArray, displacement: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Means over bins evenly spaced in ln N, ``rows_per_decade``; the last row stays as it is.

    Less than a decade of data gets as many as a decade.  A bin's cycle is the geometric mean of its
    own, so the unit of N does not matter.  Not thinned to fewer than ``rows_fewest`` rows.
    """
    span = np.log10(cycle[-1] / cycle[0])
    place = np.log10(cycle / cycle[-1]) * CANDIDATES.rows_per_decade / min(span, 1.0)
    number = np.floor(place + 1e-9)
    number[-1] = 1.0
    _, start, count = np.unique(number, return_index=True, return_counts=True)
    if len(start) == len(cycle) or len(start) < CANDIDATES.rows_fewest:
        return cycle, displacement
    mean_log = np.add.reduceat(np.log(cycle), start) / count
    few = np.append(np.exp(mean_log[:-1]), cycle[-1])
    return few, np.add.reduceat(displacement, start, axis=0) / count[:, None]


def cut_windows(cycle: FloatArray) -> list[tuple[float, slice]]:
    """Decades and rows of the windows that differ from one another."""
    found: dict[int, tuple[float, slice]] = {}
    for decades in CANDIDATES.window_decades:
        rows = select_tail(cycle, decades) if np.isfinite(decades) else slice(0, None)
        found.setdefault(rows.start, (decades, rows))
    return list(found.values())


def find_increments(
    cycle: FloatArray, displacement: FloatArray, to_cycle: float | FloatArray
) -> dict[tuple[str, float], FloatArray]:
    """Increment to ``to_cycle``, (n,), or to m, (m, n), of each law on each window telling it."""
    found = {}
    last = float(cycle[-1])
    for decades, rows in cut_windows(cycle):
        for name in SLOW_LAWS:
            law = get_law(name)
            if len(cycle) - rows.start > law.minimum_cycles:
                parameters = law.fit(cycle[rows], displacement[rows])
                found[name, decades] = law.increment(parameters, last, to_cycle)
    return found


def fit_constant_rates(cycle: FloatArray, displacement: FloatArray, to_cycle: float) -> FloatArray:
    """Increments of a + b N beside a logarithm, a row a window, (w, n); nan where not believed.

    Believed on a window where c + a ln N + b N misses the readings by no more than c + a N^b does,
    to `TAIL.resolution` of their range: both have a rate that falls slower than the logarithm's,
    and only the first one's tends to a constant.
    """
    constant, power, last = get_law("log-linear"), get_law("power"), float(cycle[-1])
    reading = (TAIL.resolution * np.ptp(displacement, axis=0)) ** 2
    found = [np.full(displacement.shape[1], np.nan)]
    for _, rows in cut_windows(cycle):
        known, happened = cycle[rows], displacement[rows]
        if len(known) <= constant.minimum_cycles:
            continue
        try:
            parameters = constant.fit(known, happened)
        except UsageError:  # ln N and N are one straight line there
            continue
        missed = np.square(happened - constant.value(parameters, known)).mean(axis=0)
        rival = np.square(happened - power.value(power.fit(known, happened), known)).mean(axis=0)
        believed = missed <= rival + reading
        found.append(np.where(believed, constant.increment(parameters, last, to_cycle), np.nan))
    return np.stack(found)


def count_held_out_rows(cycle: FloatArray) -> int:
    """How many rows come before the held-out block; 0 where too few would be left.

    The block is the last half decade, but never more than the last third of the data in ln N.
    """
    block = min(0.5 * np.log(10.0), np.log(cycle[-1] / cycle[0]) / 3)
    before = int(np.searchsorted(cycle, cycle[-1] * np.exp(-block) * (1 + 1e-9)))
    return before if before >= 4 and before < len(cycle) else 0


def find_candidates(cycle: FloatArray, displacement: FloatArray, to_cycle: float) -> Candidates:
    """Predictions for ``to_cycle`` and errors on the held-out block, rows `thin_rows` before."""
    found = find_increments(cycle, displacement, to_cycle)
    count, before = displacement.shape[1], count_held_out_rows(cycle)
    miss = dict.fromkeys(found, np.full(count, np.nan))
    combined, happened, distance = np.zeros(count), np.zeros(count), 0.0
    if before:
        past = find_increments(cycle[:before], displacement[:before], float(cycle[-1]))
        happened = displacement[-1] - displacement[before - 1]
        distance = float(np.log(cycle[-1] / cycle[before - 1]))
        miss |= {key: np.abs(past[key] - happened) for key in found if key in past}
        combined = np.median(np.stack(list(past.values())), axis=0) - happened
    return Candidates(
        tuple(name for name, _ in found), np.stack(list(found.values())),
        np.stack([miss[key] for key in found]), distance, combined, happened,
    )  # fmt: skip
