"""What the settlement gains over a jump, from rates alone, and how far that can be off.

The rate goes as du/dN = A (N / N_k)^(beta - 1) from the last computed cycle N_k on: beta = 0 is the
logarithm, 1 a constant rate, below 0 a bed that shakes down.  Every beta of `fit.regime.EXPONENTS`
is fitted to the gains of the computed blocks and weighed; so jumped cycles, which are no data, do
not enter.
"""

from dataclasses import dataclass
from math import log

import numpy as np
from scipy.special import stdtrit

from adapters.bed import FloatArray
from adapters.jumps.rates import Rates, integrate_power
from adapters.laws import fit


@dataclass(frozen=True, eq=False)
class Forecast:
    """Amplitude, its standard error and the probability of each exponent beta, shape (g,) each."""

    last_cycle: float  # N_k
    rate: FloatArray  # A [m a cycle]
    error: FloatArray  # standard error of A [m a cycle]
    weight: FloatArray
    freedom: float  # degrees of freedom of the errors
    influence: FloatArray  # derivative of A by the gain of each block, shape (b, g)

    def gain(self, start: float, end: float | FloatArray) -> FloatArray:
        """Mean gain from cycle ``start`` to ``end`` [m].

        Negative where the bed rose: cut at zero, noise would settle a bed that is at rest.
        """
        return np.asarray(integrate_power(self.last_cycle, start, end) @ (self.weight * self.rate))

    def shares(self, start: float, end: float) -> FloatArray:
        """Derivative of that gain by the gain of each block it was fitted to, shape (b,)."""
        span = integrate_power(self.last_cycle, start, end)
        return np.asarray(self.influence @ (self.weight * span))

    def half_widths(
        self, start: float, end: float | FloatArray, probability: float
    ) -> tuple[FloatArray, FloatArray]:
        """Half-widths of the gain [m]: from the noise of the rates, from the unknown exponent."""
        span = integrate_power(self.last_cycle, start, end)
        student = stdtrit(self.freedom, (1 + probability) / 2)
        gains = span * self.rate
        mean = gains @ self.weight
        noise = (span * self.error) ** 2 @ self.weight
        spread = (gains - mean[..., None]) ** 2 @ self.weight
        return student * np.sqrt(noise), student * np.sqrt(spread)

    @property
    def regime(self) -> fit.Regime:
        """Regime of the rates; see `fit.regime.find_regime_of_weight`."""
        return fit.find_regime_of_weight(self.weight, not self.rate.any())


def fit_forecast(rates: Rates) -> Forecast:
    """Fit every exponent to the blocks and weigh it.

    Weights are Student's likelihood times Cauchy's prior of `fit.regime`.  A bed without motion has
    rate 0 with no error.
    """
    last = rates.last_cycle
    span = integrate_power(last, rates.start, rates.end)
    prior = 1 / (1 + (fit.EXPONENTS / fit.TAIL.prior) ** 2)
    if not rates.gain.any() and not rates.variance.any():
        still = np.zeros_like(fit.EXPONENTS)
        none = np.zeros((len(rates.gain), len(fit.EXPONENTS)))
        return Forecast(last, still, still, prior / prior.sum(), rates.freedom, none)
    weight = 1 / np.maximum(rates.variance, np.finfo(float).eps * rates.variance.max())[:, None]
    information = (span**2 * weight).sum(axis=0)
    rate = (span * rates.gain[:, None] * weight).sum(axis=0) / information
    missed = ((rates.gain[:, None] - span * rate) ** 2 * weight).sum(axis=0)
    missed = missed - missed.min()
    likely = (1 + missed / rates.freedom) ** (-(rates.freedom + 1) / 2) * prior
    influence = span * weight / information
    weights = likely / likely.sum()
    return Forecast(last, rate, information**-0.5, weights, rates.freedom, influence)


def bound_gain_by_laws(
    cycle: FloatArray, settlement: FloatArray, ends: FloatArray, probability: float
) -> tuple[FloatArray, FloatArray]:
    """Lowest and highest gain that the slow laws give to each of e ``ends``, shape (e,) [m].

    The middle ``probability`` of all laws on all windows (`fit.candidates`), fitted to the run's
    own curve: ``cycle`` (k,), ``settlement`` [m] (k,).  Infinitely far apart for too few cycles.
    """
    if len(cycle) < 2 * fit.CANDIDATES.rows_fewest or not np.ptp(settlement):
        wide = np.full(len(ends), np.inf if len(cycle) < 2 * fit.CANDIDATES.rows_fewest else 0.0)
        return -wide, wide
    few, means = fit.thin_rows(cycle, settlement[:, None])
    with np.errstate(over="ignore", invalid="ignore"):
        found = fit.find_increments(few, means, ends)
    every = np.stack([gains[:, 0] for gains in found.values()])
    outer = (1 - probability) / 2, (1 + probability) / 2
    low, high = np.nanquantile(np.where(np.isfinite(every), every, np.nan), outer, axis=0)
    return low, high


def integrate_gain(before: float, after: float, start: float, end: float) -> float:
    """Gain over [start, end] [m] of a power law through its rates [m a cycle] at both ends.

    With w = N du/dN and x = ln(end / start) it is x (w_2 - w_1) / ln(w_2 / w_1), exact for every
    power of N; the trapezoid where one of them is not positive.
    """
    x, low, high = log(end / start), before * start, after * end
    if min(low, high) <= 0 or abs(high - low) < 1e-9 * abs(high):
        return 0.5 * x * (low + high)
    return x * (high - low) / log(high / low)
