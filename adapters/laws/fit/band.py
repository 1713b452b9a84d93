"""How far the prediction of one law can be off: the law may not go on, and the fit is uncertain."""

from math import isfinite, log, sqrt

import numpy as np

from adapters.bed import FloatArray
from adapters.laws.form import Law, ShapedLaw

NOISE_SERIES = 400
"""Random residual series that a fit is repeated on: scatter to 3.5 %; fewer for long series."""
NOISE_ROWS = 20_000
"""Rows of these series at most: a longer series is simulated on every second, third ... cycle."""


def estimate_prediction_band(
    law: Law, cycle: FloatArray, settlement: FloatArray, to_cycle: float, probability: float
) -> tuple[float, float]:
    """How far the settlement at ``to_cycle`` can lie below and above the law's prediction.

    Two independent errors, added as squares; both in the unit of ``settlement``, shape (k,).

    *The law may not go on.*  With s the law's slope du/d(ln N) at the last cycle N_k, settlement
    grows on as the integral of s (N / N_k)^beta over ln N: beta = 1 is a constant rate
    (ratcheting), 0 the logarithm, -1 a bed that shakes down.  No series knows its own future
    exponent, so all of [-1, 1] are taken as equally likely, and the band reaches from -P to P.

    *The fit is uncertain.*  Residuals of neighbouring cycles are alike, so k of them count for
    fewer.  They are taken as a first-order autoregression of the residuals' own variance and
    correlation; the fit is repeated on such series, and the scatter of its prediction is widened
    by Student's t for the effective number of cycles.

    As in `find_outlook` it never reaches back beyond the last value by more than that
    reading's own error: a bed that has settled, and goes on by the law, does not rise, however
    badly it fits.

    The band does not hold for bursts (small beds) and collapse: rates that grow faster than in
    proportion to N.
    """
    from scipy.special import stdtrit

    last, parameters = float(cycle[-1]), law.fit(cycle, settlement)
    predicted = float(law.increment(parameters, last, to_cycle))
    distance, step = log(to_cycle / last), 1e-4
    ahead, behind = law.value(parameters, last * np.array([1 + step, 1 - step]))
    slope = float(ahead - behind) / (2 * step)
    low, high = sorted(
        slope * np.expm1(beta * distance) / beta for beta in (-probability, probability)
    )
    noise = estimate_fit_noise(law, cycle, settlement, to_cycle, probability)
    below = float(np.hypot(max(predicted - low, 0.0), noise))
    above = float(np.hypot(max(high - predicted, 0.0), noise))
    deviation, _, freedom = estimate_residual_noise(law, cycle, settlement)
    reading = float(stdtrit(freedom, (1 + probability) / 2)) * deviation
    moved = float(settlement[-1] - settlement[0])
    if min(predicted, moved) > 0:
        below = min(below, predicted + reading)
    elif max(predicted, moved) < 0:
        above = min(above, reading - predicted)
    return below, above


def estimate_residual_noise(
    law: Law, cycle: FloatArray, settlement: FloatArray
) -> tuple[float, float, float]:
    """Deviation of a reading from ``law`` (unit of ``settlement``, shape (k,)), the correlation of
    neighbours, and the degrees of freedom that these are known with; (0, 0, 1) for an exact fit,
    and no finite deviation where the residuals have none.
    """
    parameters = law.fit(cycle, settlement)
    residual = settlement - law.value(parameters, cycle)
    square, count = float(residual @ residual), len(residual)
    if square == 0 or not isfinite(square):
        return square, 0.0, 1.0
    # A fitted trend takes correlation out of the residuals; (2 + 4 rho) / k puts it back.
    seen = max(float(residual[1:] @ residual[:-1]) / square, 0.0)
    correlation = min(seen + (2 + 4 * seen) / count, 0.99)
    effective = max(count * (1 - correlation) / (1 + correlation), 1.0 + len(parameters))
    freedom = effective - len(parameters)
    return sqrt(square / count * effective / freedom), correlation, freedom


def estimate_fit_noise(
    law: Law, cycle: FloatArray, settlement: FloatArray, to_cycle: float, probability: float
) -> float:
    """Half-width of the part of `estimate_prediction_band` that the residuals of the fit cause.

    Of more than `NOISE_ROWS` cycles each s-th is simulated, up to the last one: between them the
    autoregression has the correlation rho^s, and its scatter is lessened until as many cycles
    count as do of all.
    """
    from scipy.special import stdtrit

    deviation, correlation, freedom = estimate_residual_noise(law, cycle, settlement)
    if deviation == 0 or not isfinite(deviation):
        return deviation
    parameters, count = law.fit(cycle, settlement), len(cycle)
    trend = law.value(parameters, cycle)
    step = -(-count // NOISE_ROWS)
    rows = slice((count - 1) % step, None, step)
    alike = correlation**step
    fewer = (1 - alike) / (1 + alike) / step * (1 + correlation) / (1 - correlation)
    effort = 4e5 if isinstance(law, ShapedLaw) else 2e7  # numbers that are fitted
    members = int(np.clip(effort * step / count, 50, NOISE_SERIES))
    random = np.random.default_rng(0)
    noise = deviation * draw_autoregression(random, alike, (len(cycle[rows]), members))
    kept = correlation ** ((to_cycle - cycle[-1]) / (cycle[-1] - cycle[-2]))
    news = deviation * random.standard_normal(members)
    final = kept * noise[-1] + sqrt(1 - kept**2) * news
    again = law.fit(cycle[rows], trend[rows, None] + sqrt(fewer) * noise)
    increments = law.increment(again, float(cycle[-1]), to_cycle)
    error = final - noise[-1] - (increments - law.increment(parameters, cycle[-1], to_cycle))
    return float(stdtrit(freedom, (1 + probability) / 2) * np.sqrt(np.mean(error**2)))


def draw_autoregression(
    random: np.random.Generator, correlation: float, shape: tuple[int, int]
) -> FloatArray:
    """Stationary series of variance 1, each value ``correlation`` times the last and news."""
    from scipy.signal import lfilter

    white = random.standard_normal(shape)
    white[1:] *= sqrt(1 - correlation**2)
    return np.asarray(lfilter([1.0], [1.0, -correlation], white, axis=0))
