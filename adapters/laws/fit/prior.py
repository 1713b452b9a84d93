"""What is known before the readings: how settlement ends, and at which cycles ballast moves."""

from dataclasses import dataclass

import numpy as np

from adapters.bed import FloatArray
from adapters.errors import UsageError
from adapters.laws.fit.candidates import Candidates
from adapters.laws.fit.regime import make_tail_column


@dataclass(frozen=True)
class PriorNumbers:
    """Learned from 12 cyclic triaxial tests on ballast (Sun, Indraratna and Nimbalkar 2016,
    digitised) as the study of laws does it, which judges each test by numbers of the other 11.

    The strain of these tests goes as g(N) = 1 + a ln N + b (f / 1 Hz)^p / (1 + (N_b / N)^s): most
    of it comes in one burst at some hundred cycles, the larger the faster they are loaded.
    """

    exponent: float = -0.7  # beta of the tail by which the next decade follows the last half [-]
    missed: float = 0.0016
    """Share of the held-out block that the laws missed, over the square of the readings, with which
    that tail weighs as much as they [-]: a tenth of 8 readings.  Less would cost the families more
    than the tests gain."""
    slowing: float = 0.07  # a [-]
    burst: float = 0.6  # b, over the strain of the first cycle [-]
    speed: float = 0.49  # p [-]
    burst_cycle: float = 272.0  # N_b, middle of the burst [cycle]
    steepness: float = 1.69  # s [-]
    frequencies: tuple[float, float] = (5.0, 60.0)  # of the tests [Hz]
    share: float = 0.8  # of the tests in the growth ln u(N) that is predicted; the laws' is 0.2 [-]
    scatter: tuple[float, float] = (0.06, 0.3)
    """Deviation of that growth: so much a decade, and that share of the growth itself [-]."""


PRIOR = PriorNumbers()


def shrink_to_tail(
    cycle: FloatArray, displacement: FloatArray, increment: FloatArray, candidates: Candidates,
    to_cycle: float,
) -> FloatArray:  # fmt: skip
    """``increment`` (n,) of the laws, shrunk towards that of a tail c + a N^beta behind the last
    half decade where they missed much of the held-out block of the series (k, n) at cycles (k,), or
    there is none: a law of three parameters goes through five readings of a burst, and sees no end.
    """
    last = float(cycle[-1])
    start = max(last / 10**0.5, float(cycle[0]))
    begun = [np.interp(np.log(start), np.log(cycle), series) for series in displacement.T]
    behind, ahead = make_tail_column(np.array([start, to_cycle]) / last, np.array(PRIOR.exponent))
    tail = (displacement[-1] - np.array(begun)) * ahead / -behind
    allowed = (PRIOR.missed * len(cycle) ** 2 * candidates.happened) ** 2
    weight = allowed / (allowed + candidates.combined_miss**2 + np.finfo(float).tiny)
    return np.asarray(tail + (increment - tail) * weight)


def predict_growth(reach: FloatArray, frequency: float) -> FloatArray:
    """ln u of the tests of `PriorNumbers` at ``frequency`` [Hz], from cycles reach[0] to reach[1].

    Raises `UsageError` for a frequency that none of them had.
    """
    least, most = PRIOR.frequencies
    if not least <= frequency <= most:
        raise UsageError(
            f"tests at {frequency:g} Hz are not known, those known had {least:g} to {most:g} Hz",
            where="--frequency", remedy="leave it out: the readings alone then decide",
        )  # fmt: skip
    number = np.maximum(reach, 1.0)
    burst = PRIOR.burst * frequency**PRIOR.speed
    grown = 1 + PRIOR.slowing * np.log(number)
    grown += burst / (1 + (PRIOR.burst_cycle / number) ** PRIOR.steepness)
    return np.asarray(np.log(grown[1] / grown[0]))


def shrink_to_tests(
    last: FloatArray, moved: FloatArray, reach: tuple[float, float], frequency: float,
    probability: float,
) -> FloatArray:  # fmt: skip
    """Increment, and low and high end of its band, (3, n): mean of what the laws say, ``moved``
    (n,) from the readings ``last`` (n,), and of the tests at ``frequency`` [Hz], in ln u; ``reach``
    is the last cycle and the one asked for, counted from the first load on a fresh bed.
    """
    from scipy.special import ndtri

    growth = predict_growth(np.array(reach), frequency)
    laws = np.log(np.maximum(1 + np.divide(moved, last, where=last != 0, out=0 * last), 0.5))
    joint = PRIOR.share * growth + (1 - PRIOR.share) * laws
    decades, share = PRIOR.scatter
    scatter = np.hypot(decades * np.log10(reach[1] / reach[0]), share * growth)
    half = ndtri((1 + probability) / 2) * scatter
    middle, *ends = (last * np.expm1(joint + off) for off in (0.0, -half, half))
    return np.stack([middle, *np.sort(ends, axis=0)])
