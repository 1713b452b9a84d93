"""Prediction of a series without a law named: regime, median of the slow laws, band."""

from __future__ import annotations

from dataclasses import dataclass
from math import log

import numpy as np

from adapters.errors import NotConverged, UsageError
from adapters.fit_candidates import (
    ROWS_FEWEST,
    BoolArray,
    Candidates,
    candidates_of,
    constant_rate_gains,
    thinned,
)
from adapters.fit_regime import (
    CERTAIN,
    EXPONENTS,
    SHAKEDOWN,
    Regime,
    exponent_weights,
    independent,
    regimes_of,
    tail_column,
    tail_residual,
    tail_rows,
)
from adapters.laws import law_named
from adapters.laws.law import training_data
from adapters.state import FloatArray


@dataclass(frozen=True)
class Outlook:
    """What n series are expected to do; each array of shape (n,), in the unit of the series."""

    regime: list[Regime]
    prediction: FloatArray
    low: FloatArray
    high: FloatArray
    candidates: Candidates
    votes: BoolArray
    """Candidates that have a vote, shape (c, n)."""
    last_cycle: float
    to_cycle: float
    last: FloatArray
    """Reading at the last cycle."""
    settled: FloatArray
    """Largest settlement so far, without its sign."""


def outlook(
    cycle: FloatArray, displacement: FloatArray, to_cycle: float, probability: float = 0.9
) -> Outlook:
    """Regime, prediction and band of n series (k, n) at ``to_cycle``, whatever the regime.

    *Prediction*: the last value plus the median increment of the slow laws, each fitted to the
    last decade, the last two, and all data; one that missed the held-out block by more than three
    times the median miss has no vote.  Where the tail says for certain (90 %) that the total has
    an end, or has none, only laws of that kind vote.  No law is right on ballast, and the median
    of several is less often far off than the one that fits best.

    *Band*, three independent parts added as squares, each side by itself:

    - spread: from the (1 - P) / 2 to the (1 + P) / 2 quantile of all candidates; where the tail
      says for certain that the total has no end, and a constant rate beside a logarithm fits no
      worse than a power law, also to where that leads;
    - held-out block: the median's own error there, in proportion to the distance in ln N, as one
      standard deviation;
    - tail: error of the last reading and of the slope there; see `tail_error`.

    It never reaches back beyond the last value by more than the reading: a bed that settles does
    not rise.  The band does not hold in the regimes ratcheting and collapse.

    Cycle 0 must be left out.  Raises `UsageError` for what no law can take and for fewer than
    `ROWS_FEWEST` cycles, `NotConverged` when the prediction is not finite.
    """
    cycle, displacement = training_data(law_named("log"), cycle, displacement)
    if len(cycle) < ROWS_FEWEST:
        raise UsageError(
            f"{len(cycle)} cycles are too few to tell a regime from",
            where="law auto",
            remedy=f"give at least {ROWS_FEWEST} computed cycles, or name a law: --law log",
        )
    few, means = thinned(cycle, displacement)
    last, regimes = displacement[-1], regimes_of(few, means)
    settled, reach = np.abs(displacement).max(axis=0), (float(cycle[-1]), to_cycle)
    bounded = np.array([regime.name == SHAKEDOWN for regime in regimes])
    unbounded = np.array([regime.bounded < 1 - CERTAIN for regime in regimes]) & ~bounded
    with np.errstate(over="ignore", invalid="ignore"):  # judged below, in one place
        candidates = candidates_of(few, means, to_cycle)
        votes = candidates.votes(bounded, unbounded)
        if to_cycle == cycle[-1]:
            return Outlook(regimes, last, last, last, candidates, votes, *reach, last, settled)
        moved = candidates.median(votes)
        exponent = EXPONENTS[exponent_weights(few, means).argmax(axis=0)]
        reading, tail = tail_error(cycle, displacement, exponent, to_cycle, probability)
        miss = held_out_error(candidates, log(to_cycle / cycle[-1]), probability)
        further = np.hypot(miss, tail)
        lowest, highest = candidates.spread(bounded, probability)
        endless = np.where(unbounded, constant_rate_gains(few, means, to_cycle), np.nan)
        lowest = np.fmin(lowest, np.fmin.reduce(endless))
        highest = np.fmax(highest, np.fmax.reduce(endless))
        below = np.hypot(np.maximum(moved - lowest, 0.0), further)
        above = np.hypot(np.maximum(highest - moved, 0.0), further)
        low, high = last + moved - below, last + moved + above
        low = np.where(moved > 0, np.maximum(low, last - reading), low)
        high = np.where(moved < 0, np.minimum(high, last + reading), high)
    if not (np.isfinite(low).all() and np.isfinite(high).all()):
        raise NotConverged(
            f"the slow laws give no finite settlement at cycle {to_cycle:g}",
            remedy="predict less far, or use the law log",
        )
    return Outlook(regimes, last + moved, low, high, candidates, votes, *reach, last, settled)


def held_out_error(candidates: Candidates, distance: float, probability: float) -> FloatArray:
    """Half-width from the median's own error on the held-out block, (n,); 0 without a block.

    The error grows in proportion to the distance in ln N, here ``distance``, and is taken as one
    standard deviation of a normal one.
    """
    from scipy.special import ndtri

    if not candidates.distance:
        return np.zeros_like(candidates.combined_miss)
    miss = np.abs(candidates.combined_miss) * distance / candidates.distance
    return np.asarray(ndtri((1 + probability) / 2) * miss)


def tail_error(
    cycle: FloatArray,
    displacement: FloatArray,
    exponent: FloatArray,
    to_cycle: float,
    probability: float,
) -> tuple[FloatArray, FloatArray]:
    """Half-widths of one reading, and of the reading and the tail's increment, (n,) each.

    The tail is c + a phi(N) with ``exponent`` beta (n,), cut to [-1, 1]; its residuals have the
    deviation sigma, and k' of the k are independent (few in what an engine computes).  a then has
    the variance sigma^2 (k / k') / sum phi^2, the increment phi(r N_k)^2 times that, and Student's
    t for k' - 3 widens both.
    """
    from scipy.special import stdtrit

    exponent = np.clip(exponent, -1.0, 1.0)
    residual = tail_residual(cycle, displacement, exponent)
    counted = independent(residual)
    freedom = np.maximum(counted - 3, 1.0)
    variance = (residual * residual).sum(axis=0) / len(residual) * counted / freedom
    column = tail_column((cycle[tail_rows(cycle)] / cycle[-1])[:, None], exponent)
    square = ((column - column.mean(axis=0)) ** 2).sum(axis=0)
    ahead = tail_column(np.array(to_cycle / cycle[-1]), exponent)
    slope = variance * len(residual) / counted / square
    student = stdtrit(freedom, (1 + probability) / 2)
    return student * np.sqrt(variance), student * np.sqrt(variance + slope * ahead**2)
