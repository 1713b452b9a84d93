"""Which way a settlement series goes: shakedown, steady, ratcheting or collapse.

From the rate of the rate.  With v = du/dN, q = d ln v / d ln N is -1 for the logarithm, 0 for
a constant rate; beta = q + 1 is the exponent of the tail u = c + a (N^beta - 1) / beta.
"""

from dataclasses import dataclass, replace
from math import sqrt
from typing import Any

import numpy as np

from adapters.bed import FloatArray
from adapters.laws.fit.growth import measure_growth

EXPONENTS = np.linspace(-4.0, 6.0, 201)
"""Exponents beta that are weighed."""
REGIMES = ("shakedown", "steady", "ratcheting", "collapse")
SHAKEDOWN, STEADY, RATCHETING, COLLAPSE = REGIMES
WHY_NOT = {
    RATCHETING: "the settlement rate falls too slowly (ratcheting)",
    COLLAPSE: "the settlement rate grows (collapse)",
}
"""Regimes in which nothing bounds what comes after the data, and the words for it."""
WHY_NOT_PISTON = {
    RATCHETING: "the rate at which the piston sinks falls too slowly (ratcheting)",
    COLLAPSE: "the rate at which the piston sinks grows (collapse)",
}
"""The same of a piston that breaks into a bed whose mean grain may even rise."""


@dataclass(frozen=True)
class TailNumbers:
    """The end of a series, and what is said by it."""

    ratio: float = 10.0  # of the last cycle, N_k, to its first one: it is the last decade [-]
    rows: int = 6  # fewest cycles of it; where the last decade has fewer, earlier ones join
    prior: float = 0.5
    """Half-width of beta's distribution (Cauchy's) before any data [-]: rates from N^-1.5 to N^-0.5
    have half of it; its long tails let an explosion be seen as one."""
    resolution: float = 1e-3
    """Deviation of a reading at best over the whole range [-], a digit of a curve of 300: a bed
    that has settled but for its last digit is at rest, whichever way that goes."""
    certain: float = 0.9  # probability from which a regime but steady is said [-]
    round_off: float = 1e-12  # relative difference of means of equal readings [-]


TAIL = TailNumbers()


@dataclass(frozen=True)
class Regime:
    """Regime of one series, and the exponent it follows from."""

    name: str
    exponent: float  # mean of beta; the rate falls as N^(beta - 1)
    deviation: float  # standard deviation of beta
    bounded: float  # probability of beta < 0: that the total has an end
    growth: float = 1.0  # rate at the end over the least before; 1 where it has not surely grown

    @property
    def jump_allowed(self) -> bool:
        """True where the rate falls fast enough for a slow law to go on."""
        return self.name not in WHY_NOT

    def parameters(self) -> dict[str, Any]:
        """For ``parameters`` of the command's JSON."""
        return {"exponent": self.exponent, "exponent_deviation": self.deviation}


def select_tail(cycle: FloatArray, decades: float = 1.0) -> slice:
    """Rows of the last ``decades``, at least `TAIL.rows` of them where there are so many."""
    first = int(np.searchsorted(cycle, cycle[-1] / TAIL.ratio**decades * (1 - 1e-9)))
    return slice(max(0, min(first, len(cycle) - TAIL.rows)), None)


def make_tail_column(ratio: FloatArray, exponent: FloatArray) -> FloatArray:
    """(x^beta - 1) / beta of x = N / N_k, ln x where beta is 0; arguments broadcast."""
    log = np.log(ratio)
    small = np.abs(exponent) < 1e-9
    return np.where(small, log, np.expm1(exponent * log) / np.where(small, 1.0, exponent))


def weigh_exponents(cycle: FloatArray, displacement: FloatArray) -> FloatArray:
    """Probability of each of `EXPONENTS`, shape (g, n), for series (k, n) at cycles > 0, (k,).

    Least squares on the tail for every beta; Student's likelihood (the noise is not known) with as
    many degrees of freedom as there are `count_independent` residuals.  A tail without any movement
    gives the prior.
    """
    rows = select_tail(cycle)
    ratio = cycle[rows] / cycle[-1]
    series = displacement[rows] - displacement[rows].mean(axis=0)
    columns = make_tail_column(ratio[:, None], EXPONENTS)
    columns = columns - columns.mean(axis=0)
    columns /= np.linalg.norm(columns, axis=0)
    along = columns.T @ series
    total = (series * series).sum(axis=0)
    reading = len(ratio) * (TAIL.resolution * np.ptp(displacement, axis=0)) ** 2
    missed = np.where(total > 0, np.maximum(total - along**2, 0.0) + reading, 1.0)
    best = missed.argmin(axis=0)
    residual = series - columns[:, best] * along[best, np.arange(series.shape[1])]
    counted = np.maximum(count_independent(residual), 4.0)
    fit = np.log(missed / missed.min(axis=0))
    weight = np.exp(-(counted - 2) / 2 * fit) / (1 + (EXPONENTS[:, None] / TAIL.prior) ** 2)
    return np.asarray(weight / weight.sum(axis=0))


def count_independent(residual: FloatArray) -> FloatArray:
    """How many of k residuals (k, n) count: k (1 - rho) / (1 + rho), rho of neighbours, >= 0.

    What an engine computes is a sum of increments, so neighbouring cycles are off alike.
    """
    square = np.maximum((residual * residual).sum(axis=0), np.finfo(float).tiny)
    alike = np.clip((residual[1:] * residual[:-1]).sum(axis=0) / square, 0.0, 0.99)
    return np.asarray(len(residual) * (1 - alike) / (1 + alike))


def fit_tail_residual(
    cycle: FloatArray, displacement: FloatArray, exponent: FloatArray
) -> FloatArray:
    """Tail less c + a (N^beta - 1) / beta fitted to it, shape (rows, n), ``exponent`` (n,)."""
    rows = select_tail(cycle)
    series = displacement[rows] - displacement[rows].mean(axis=0)
    column = make_tail_column((cycle[rows] / cycle[-1])[:, None], exponent)
    column = column - column.mean(axis=0)
    slope = (column * series).sum(axis=0) / (column * column).sum(axis=0)
    return np.asarray(series - slope * column)


def find_regimes(cycle: FloatArray, displacement: FloatArray) -> list[Regime]:
    """Regime of each of n series (k, n) at ascending cycles > 0, (k,), k >= 3.

    The tail says what the bed does, not what it will do: real ballast at 30 to 40 Hz ratchets for
    some hundred cycles and then shakes down.  A rate that has grown (`measure_growth`) is collapse
    whatever one exponent of the whole tail says: it is a mean over the fall and the growth.
    """
    weight = weigh_exponents(cycle, displacement)
    tail = displacement[select_tail(cycle)]
    still = np.ptp(tail, axis=0) <= TAIL.round_off * np.abs(tail).max(axis=0)
    found = [find_regime_of_weight(*each) for each in zip(weight.T, still, strict=True)]
    growth = map(float, measure_growth(cycle, displacement))
    return [
        replace(one, name=COLLAPSE, growth=ratio) if ratio > 1 else one
        for one, ratio in zip(found, growth, strict=True)
    ]


def find_regime_of_weight(weight: FloatArray, still: bool) -> Regime:
    """Regime where `EXPONENTS` have the probabilities ``weight``, (g,); each needs `TAIL.certain`.

    - *collapse*: beta > 1, a rate that grows;
    - *ratcheting*: beta > 1/2, a rate nearer to a constant one than to that of the logarithm;
    - *shakedown*: beta < 0, a total that stays bounded; or nothing moves (``still``);
    - *steady* otherwise: unbounded, ever slower, or none of these for certain.
    """
    fast, growing = (float(weight[limit < EXPONENTS].sum()) for limit in (0.5, 1))
    bounded = float(weight[EXPONENTS < -1e-9].sum())
    mean = float(EXPONENTS @ weight)
    deviation = sqrt(max(float(EXPONENTS**2 @ weight) - mean**2, 0.0))
    if still or bounded > TAIL.certain:
        name = SHAKEDOWN
    elif fast > TAIL.certain:
        name = COLLAPSE if growing > TAIL.certain else RATCHETING
    else:
        name = STEADY
    return Regime(name, mean, deviation, bounded)
