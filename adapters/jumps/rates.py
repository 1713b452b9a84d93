"""What computed cycles say of the settlement rate, and how noisy they are.

Increments of neighbouring cycles are alike (a burst lasts), so k cycles count for fewer: what
counts is the long-run variance S = sum over all lags of the autocovariance, and the mean of k
increments has the variance S / k.  Lengths in metres, rates in metres a cycle.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import ceil, sqrt

import numpy as np

from adapters.bed import FloatArray
from adapters.laws.fit import EXPONENTS

BLOCKS = 4
"""Parts of a stretch whose mean rates are fitted: enough to see a trend inside of it."""
LAW_ERROR = 0.02
"""Share of a block's gain by which no law is better known: forms of laws are made by people."""


@dataclass(frozen=True, eq=False)
class Stretch:
    """Cycles computed one after another, healing cycles left out; k of them."""

    first_cycle: int  # cycles done before
    gain: FloatArray  # settlement gained in each cycle [m], shape (k,)
    coordination: FloatArray  # contacts with other grains a grain, at each cycle's end, shape (k,)
    deflection: FloatArray  # rise of the piston on unloading [m], shape (k,)

    @property
    def last_cycle(self) -> int:
        """Cycles done at its end."""
        return self.first_cycle + len(self.gain)

    @property
    def rate(self) -> float:
        """Mean settlement a cycle [m]."""
        return float(self.gain.mean())

    def part(self, begin: int, end: int) -> Stretch:
        """Its cycles from number ``begin`` up to ``end``, the first being 0."""
        columns = (one[begin:end] for one in (self.gain, self.coordination, self.deflection))
        return Stretch(self.first_cycle + begin, *columns)


@dataclass(frozen=True, eq=False)
class Rates:
    """Gains of b blocks of cycles with their variances, each of shape (b,)."""

    start: FloatArray  # cycles done before each block
    end: FloatArray  # cycles done after it
    gain: FloatArray  # settlement gained in it [m]
    variance: FloatArray  # of the gain [m^2]
    freedom: float  # degrees of freedom that the variances are known with

    @property
    def last_cycle(self) -> float:
        """Cycle that predictions start from."""
        return float(self.end[-1])


def estimate_long_run_variance(series: FloatArray) -> float:
    """S = gamma_0 + 2 sum_l (1 - l / L) gamma_l of a series (k,), its straight trend taken out.

    Bartlett's weights up to L = sqrt(k), which keep S >= 0 (Newey and West 1987); divided by k - 2
    for the two parameters of the trend.  0 for fewer than 4 values.  Too small by the share of the
    correlation that reaches further than L.
    """
    k = len(series)
    if k < 4:
        return 0.0
    place = np.arange(k) - (k - 1) / 2
    residual = series - series.mean() - place * (place @ series) / (place @ place)
    lags = ceil(sqrt(k))
    total = float(residual @ residual)
    for lag in range(1, lags):
        total += 2 * (1 - lag / lags) * float(residual[lag:] @ residual[:-lag])
    return max(total, 0.0) / (k - 2)


@dataclass(frozen=True, eq=False)
class Noise:
    """Noise of the gains of s stretches."""

    variance: FloatArray  # long-run variance S [m^2 a cycle] of each, shape (s,)
    freedom: float  # degrees of freedom that it is known with


def find_noise(stretches: Sequence[Stretch]) -> Noise:
    """Long-run variance of the gains about their smooth rate, from all stretches together.

    Alone, a window between two bursts sees none, would look quiet, and be believed too much.  The
    noise is in proportion to the rate or the same everywhere, whichever makes the gains likelier.
    Its correlation is that of an autoregression of first order, with what a fitted trend takes out
    of it put back, (2 + 4 rho) / k; scatter of whole stretches about the trend, where there are
    four or more, is pooled in by its degrees of freedom.
    """
    count = np.array([len(one.gain) for one in stretches])
    total, ends = int(count.sum()), np.cumsum(count)
    cycles = np.concatenate([one.first_cycle + 0.5 + np.arange(len(one.gain)) for one in stretches])
    rate = fit_smooth_rate(stretches)(cycles)
    residual = np.concatenate([one.gain for one in stretches]) - rate
    if total < 4 or not residual @ residual:
        return Noise(np.zeros(len(stretches)), 1.0)
    scale, standard = np.ones(total), residual
    if (rate > 0).all():
        relative = residual / rate
        gained = np.log(residual @ residual) - np.log(relative @ relative)
        if gained * total / 2 > np.log(rate).sum():
            scale, standard = rate, relative
    variance = float(standard @ standard) / max(total - 2, 1)
    pairs = standard[1:] * standard[:-1]
    inside = np.ones(total - 1, bool)
    inside[ends[:-1] - 1] = False
    seen = float(pairs[inside].mean()) / variance if inside.any() else 0.0
    correlation = float(np.clip(seen + (2 + 4 * seen) / total, -0.5, 0.9))
    grown = (1 + correlation) / (1 - correlation)
    freedom = max(total / grown - 2, 1.0)
    pooled = variance * grown
    if len(stretches) >= 4:
        sums = np.add.reduceat(standard, np.append(0, ends[:-1]))
        between = float((sums**2 / count).sum()) / (len(stretches) - 2)
        further = len(stretches) - 2
        pooled = (freedom * pooled + further * between) / (freedom + further)
    return Noise(pooled * scale[ends - count // 2 - 1] ** 2, freedom)


def integrate_power(scale: float, start: float | FloatArray, end: float | FloatArray) -> FloatArray:
    """phi_beta = integral of (N / scale)^(beta - 1) dN, shape (..., g); ``start`` above 0."""
    low = np.log(np.asarray(start, float) / scale)[..., None]
    high = np.log(np.asarray(end, float) / scale)[..., None]
    flat = np.abs(EXPONENTS) < 1e-9
    safe = np.where(flat, 1.0, EXPONENTS)
    power = np.exp(safe * low) * np.expm1(safe * (high - low)) / safe
    return np.asarray(scale * np.where(flat, high - low, power))


def fit_smooth_rate(stretches: Sequence[Stretch]) -> Callable[[FloatArray], FloatArray]:
    """Rate [m a cycle] at a cycle: the power of N next to the gains of all blocks, least squares.

    A gain weighs N^2 / k, as if noise were in proportion to the logarithm's rate, and never by what
    was gained: a fit that believes quiet windows more comes out too slow.
    """
    start, end, gain = cut_blocks(stretches)
    scale = float(end[-1])
    span = integrate_power(scale, start, end)
    weight = ((start + (end - start) / 2) ** 2 / (end - start))[:, None]
    rate = (span * gain[:, None] * weight).sum(axis=0) / (span**2 * weight).sum(axis=0)
    missed = ((gain[:, None] - span * rate) ** 2 * weight).sum(axis=0)
    missed += missed.max() * 1e-9 * EXPONENTS**2  # of one block alone every power is as good
    best = int(missed.argmin())
    return lambda cycle: float(rate[best]) * (cycle / scale) ** (float(EXPONENTS[best]) - 1)


def count_blocks(stretch: Stretch) -> int:
    """Blocks of a stretch: `BLOCKS`, of two cycles at least."""
    return min(BLOCKS, max(1, len(stretch.gain) // 2))


def cut_blocks(stretches: Sequence[Stretch]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Cycles done before and after each block of all stretches, and its gain [m], (b,) each."""
    edges = [
        np.round(np.linspace(0, len(one.gain), count_blocks(one) + 1)).astype(np.int64)
        for one in stretches
    ]
    pairs = list(zip(stretches, edges, strict=True))
    start = np.concatenate([one.first_cycle + e[:-1].astype(float) for one, e in pairs])
    end = np.concatenate([one.first_cycle + e[1:].astype(float) for one, e in pairs])
    return start, end, np.concatenate([np.add.reduceat(one.gain, e[:-1]) for one, e in pairs])


def find_rates(stretches: Sequence[Stretch]) -> Rates:
    """Blocks of all stretches, with the noise of all."""
    start, end, gain = cut_blocks(stretches)
    noise, count = find_noise(stretches), end - start
    own = np.repeat(noise.variance, [count_blocks(one) for one in stretches])
    smooth = fit_smooth_rate(stretches)(0.5 * (start + end)) * count
    variance = own * count + (LAW_ERROR * smooth) ** 2
    return Rates(start, end, gain, variance, max(noise.freedom, 3.0))


def fit_slope_trend(rates: Rates, blocks: int = 3 * BLOCKS) -> tuple[float, float]:
    """Trend g = dw / d ln N of w = N du/dN over the last blocks, and its standard error [m].

    The logarithm has w constant, so g is the slope change of Cojocaru and Karlsson (2006) by which
    a jump errs; a weighted straight line instead of three single slopes.  (0, 0) where one block,
    or a bed without motion, has no trend.
    """
    last = slice(-blocks, None)
    start, end = rates.start[last], rates.end[last]
    span = np.log(end / start)
    if len(span) < 2:
        return 0.0, 0.0
    place, w = 0.5 * np.log(start * end), rates.gain[last] / span
    weight = span**2 / np.maximum(rates.variance[last], np.finfo(float).tiny)
    weight = weight / weight.max()
    mean = weight @ place / weight.sum()
    square = weight @ (place - mean) ** 2
    slope = float(weight @ ((place - mean) * w) / square)
    variances = rates.variance[last] / span**2
    return slope, sqrt(float((weight * (place - mean)) ** 2 @ variances)) / float(square)


def fit_state_trend(stretches: Sequence[Stretch], name: str) -> tuple[float, float, float]:
    """Mean of ``coordination`` or ``deflection``, its trend a unit of ln N, the standard error."""
    values = [getattr(one, name) for one in stretches]
    known = np.isfinite(np.concatenate(values))
    every = np.concatenate(values)[known]
    if len(every) < 4:
        return 0.0, 0.0, 0.0
    cycles = np.concatenate([one.first_cycle + 1 + np.arange(len(one.gain)) for one in stretches])
    place = np.log(cycles[known])
    place = place - place.mean()
    square = float(place @ place)
    slope = float(place @ every) / square
    noise = estimate_long_run_variance(every - slope * place)
    return float(every.mean()), slope, sqrt(noise / square)
