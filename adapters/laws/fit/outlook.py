"""Prediction of a series without a law named: regime, median of the slow laws, band, agreement."""

from dataclasses import dataclass
from math import isfinite, log

import numpy as np

from adapters.bed import FloatArray
from adapters.files import make_too_few_error
from adapters.laws import get_law
from adapters.laws.fit.candidates import (
    CANDIDATES,
    BoolArray,
    Candidates,
    find_candidates,
    fit_constant_rates,
    thin_rows,
)
from adapters.laws.fit.prior import shrink_to_tail, shrink_to_tests
from adapters.laws.fit.regime import (
    EXPONENTS,
    SHAKEDOWN,
    TAIL,
    Regime,
    count_independent,
    find_regimes,
    fit_tail_residual,
    make_tail_column,
    select_tail,
    weigh_exponents,
)
from adapters.laws.form import check_training_data

JUDGED = 0.9
"""Probability of the band that a prediction is judged by (`fit.refusal`, `compare_laws`), whatever
band is asked for: a narrower one is no way round a refusal.  The study of laws measured the
refusals at 90 %, the probability that regimes need too."""
TO_TELL = "to see a regime"
"""What `CANDIDATES.rows_fewest` rows are needed for, in the words of an error."""


@dataclass(frozen=True)
class Outlook:
    """What n series are expected to do; each array of shape (n,), in the unit of the series.

    Prediction and ends of bands are not finite where the laws overflow; `fit.refusal.find_refusals`
    raises then.
    """

    regime: list[Regime]
    prediction: FloatArray
    low: FloatArray
    high: FloatArray
    candidates: Candidates
    votes: BoolArray  # candidates that have a vote, shape (c, n)
    last_cycle: float
    to_cycle: float
    last: FloatArray  # reading at the last cycle
    settled: FloatArray  # largest settlement so far, without its sign
    alone: FloatArray  # prediction of the laws without `fit.prior`: no prior undoes a refusal, so
    judged: tuple[FloatArray, FloatArray]  # this is the band around it, with probability `JUDGED`
    reading: FloatArray
    """Error of a reading: its half-width with `JUDGED`, `TAIL.resolution` of the range at least."""
    counted_from: float = 0.0  # the user's number of cycle 0, as in `Series`: for sentences


def find_outlook(
    cycle: FloatArray, displacement: FloatArray, to_cycle: float, probability: float = 0.9,
    frequency: float | None = None,
) -> Outlook:  # fmt: skip
    """Regime, prediction and band of n series (k, n) at ``to_cycle``, whatever the regime.

    *Prediction*: the last value plus the median increment of the slow laws, each fitted to the
    last decade, the last two, and all data; one that missed the held-out block by more than three
    times the median miss has no vote.  Where the tail says for certain (90 %) that the total has
    an end, or has none, only laws of that kind vote.  No law is right on ballast, and the median
    of several is less often far off than the one that fits best.  It is shrunk towards a tail that
    ends and, with ``frequency`` [Hz], towards tests on ballast, with a band of theirs (`prior`).

    *Band*, three independent parts added as squares, each side by itself:

    - spread: from the (1 - P) / 2 to the (1 + P) / 2 quantile of all candidates; where the tail
      says for certain that the total has no end, and a constant rate beside a logarithm fits no
      worse than a power law, also to where that leads;
    - held-out block: the median's own error there, in proportion to the distance in ln N, as one
      standard deviation;
    - tail: error of the last reading and of the slope there; see `find_tail_error`.

    It never reaches back beyond the last value by more than the reading: a bed that settles does
    not rise.  The band does not hold in the regimes ratcheting and collapse.

    Cycle 0 must be left out.  Raises `UsageError` for what no law can take and for fewer than
    `CANDIDATES.rows_fewest` cycles.
    """
    cycle, displacement = check_training_data(get_law("log"), cycle, displacement)
    if len(cycle) < CANDIDATES.rows_fewest:
        raise make_too_few_error(len(cycle), CANDIDATES.rows_fewest, TO_TELL, where="law auto")
    few, means = thin_rows(cycle, displacement)
    last, regimes = displacement[-1], find_regimes(few, means)
    settled, reach = np.abs(displacement).max(axis=0), (float(cycle[-1]), to_cycle)
    bounded = np.array([regime.name == SHAKEDOWN for regime in regimes])
    unbounded = np.array([regime.bounded < 1 - TAIL.certain for regime in regimes]) & ~bounded
    exponent = EXPONENTS[weigh_exponents(few, means).argmax(axis=0)]
    known = to_cycle == cycle[-1]
    with np.errstate(over="ignore", invalid="ignore"):  # judged in `fit.refusal`
        candidates = find_candidates(few, means, to_cycle)
        votes = candidates.votes(bounded, unbounded)
        alone = np.zeros_like(last) if known else candidates.median(votes)
        moved = shrink_to_tail(few, means, alone, candidates, to_cycle)
        endless = np.where(unbounded, fit_constant_rates(few, means, to_cycle), np.nan)

        def find_band(
            moved: FloatArray, probability: float
        ) -> tuple[FloatArray, FloatArray, FloatArray]:
            """Low end and high end around an increment, and half-width of a reading."""
            reading, tail = find_tail_error(cycle, displacement, exponent, to_cycle, probability)
            if known:
                return last, last, reading
            miss = find_held_out_error(candidates, log(to_cycle / cycle[-1]), probability)
            further = np.hypot(miss, tail)
            lowest, highest = candidates.spread(bounded, probability)
            lowest = np.fmin(lowest, np.fmin.reduce(endless))
            highest = np.fmax(highest, np.fmax.reduce(endless))
            below = np.hypot(np.maximum(moved - lowest, 0.0), further)
            above = np.hypot(np.maximum(highest - moved, 0.0), further)
            low, high = last + moved - below, last + moved + above
            low = np.where(moved > 0, np.maximum(low, last - reading), low)
            high = np.where(moved < 0, np.minimum(high, last + reading), high)
            return low, high, reading

        low, high, _ = find_band(moved, probability)
        *judged, reading = find_band(alone, JUDGED)
        if frequency is not None and not known:
            found = shrink_to_tests(last, moved, reach, frequency, probability)
            moved, low, high = found[0], last + found[1], last + found[2]
    least = np.fmax(TAIL.resolution * np.ptp(displacement, axis=0), TAIL.round_off * settled)
    return Outlook(
        regimes, last + moved, low, high, candidates, votes, *reach, last, settled,
        alone=last + alone, judged=(judged[0], judged[1]), reading=np.fmax(reading, least),
    )  # fmt: skip


def find_held_out_error(candidates: Candidates, distance: float, probability: float) -> FloatArray:
    """Half-width from the median's own error on the held-out block, (n,); 0 without a block.

    The error grows in proportion to the distance in ln N, here ``distance``, and is taken as one
    standard deviation of a normal one.
    """
    from scipy.special import ndtri

    if not candidates.distance:
        return np.zeros_like(candidates.combined_miss)
    miss = np.abs(candidates.combined_miss) * distance / candidates.distance
    return np.asarray(ndtri((1 + probability) / 2) * miss)


def find_tail_error(
    cycle: FloatArray, displacement: FloatArray, exponent: FloatArray, to_cycle: float,
    probability: float,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Half-widths of one reading, and of the reading and the tail's increment, (n,) each.

    The tail is c + a phi(N) with ``exponent`` beta (n,), cut to [-1, 1]; its residuals have the
    deviation sigma, and k' of the k are independent (few in what an engine computes).  a then has
    the variance sigma^2 (k / k') / sum phi^2, the increment phi(r N_k)^2 times that, and Student's
    t for k' - 3 widens both.
    """
    from scipy.special import stdtrit

    exponent = np.clip(exponent, -1.0, 1.0)
    residual = fit_tail_residual(cycle, displacement, exponent)
    counted = count_independent(residual)
    freedom = np.maximum(counted - 3, 1.0)
    variance = (residual * residual).sum(axis=0) / len(residual) * counted / freedom
    column = make_tail_column((cycle[select_tail(cycle)] / cycle[-1])[:, None], exponent)
    square = ((column - column.mean(axis=0)) ** 2).sum(axis=0)
    ahead = make_tail_column(np.array(to_cycle / cycle[-1]), exponent)
    slope = variance * len(residual) / counted / square
    student = stdtrit(freedom, (1 + probability) / 2)
    return student * np.sqrt(variance), student * np.sqrt(variance + slope * ahead**2)


AGREE = 0.1
"""A law agrees whose increment behind the last reading lies so near the joint one, as its share.
Not as a share of the total: near the last cycle all totals are alike, whatever the laws say."""


@dataclass(frozen=True)
class LawSaid:
    """One law's own prediction."""

    prediction: float | None
    """Median of its windows, in the unit of the series; None where that is not finite."""
    votes: int  # of its windows, how many have a vote in the joint prediction: 0 to 3
    agrees: bool
    """Its increment is within `AGREE` of the joint one, whether that is given or refused; or both
    are below the error of a reading (`Outlook.reading`), so that no reading separates them: a bed
    at rest."""
    inside: bool | None
    """Inside the band; None where the prediction is refused, as no band holds there."""


def compare_laws(outlook: Outlook, series: int = 0, refused: bool = False) -> dict[str, LawSaid]:
    """By name, what the laws of ``outlook`` say of one of its series."""
    candidates, last = outlook.candidates, float(outlook.last[series])
    joint, reading = float(outlook.prediction[series]) - last, float(outlook.reading[series])
    low, high = float(outlook.low[series]), float(outlook.high[series])
    found = {}
    for name in dict.fromkeys(candidates.law):
        own = [row for row, law in enumerate(candidates.law) if law == name]
        gain = float(np.median(candidates.increment[own, series]))
        value = last + gain
        found[name] = LawSaid(
            value if isfinite(value) else None,
            int(outlook.votes[own, series].sum()),
            abs(gain - joint) <= AGREE * abs(joint) or max(abs(gain), abs(joint)) <= reading,
            None if refused else low <= value <= high,
        )
    return found
