"""Prediction of a series without a law named: regime, median of the slow laws, band."""

from __future__ import annotations

from dataclasses import dataclass
from math import log

import numpy as np

from adapters.errors import NotConverged, UsageError
from adapters.fit_candidates import Candidates, candidates_of, thinned
from adapters.fit_regime import (
    EXPONENTS,
    Regime,
    exponent_weights,
    independent,
    regimes_of,
    tail_residual,
)
from adapters.laws import law_named
from adapters.laws.law import training_data
from adapters.state import FloatArray

FEWEST = 4
"""Cycles that a regime can be told from."""


@dataclass(frozen=True)
class Outlook:
    """What n series are expected to do; each array of shape (n,), in the unit of the series."""

    regime: list[Regime]
    prediction: FloatArray
    low: FloatArray
    high: FloatArray
    candidates: Candidates


def outlook(
    cycle: FloatArray, displacement: FloatArray, to_cycle: float, probability: float = 0.9
) -> Outlook:
    """Regime, prediction and band of n series (k, n) at ``to_cycle``, whatever the regime.

    *Prediction*: the last value plus the median increment of the slow laws, each fitted to the
    last decade, the last two, and all data; one that missed the held-out block by more than three
    times the median miss has no vote.  No law is right on ballast, and the median of several is
    less often far off than the one that fits best.

    *Band*, three independent parts added as squares, each side by itself:

    - spread: from the (1 - P) / 2 to the (1 + P) / 2 quantile of all candidates;
    - held-out block: the median's own error there, in proportion to the distance in ln N, as one
      standard deviation;
    - reading: the residuals of the tail, by Student's t.

    It never reaches back beyond the last value by more than the reading: a bed that settles does
    not rise.  The band does not hold in the regimes ratcheting and collapse.

    Cycle 0 must be left out.  Raises `UsageError` for what no law can take, fewer than `FEWEST`
    cycles included, and `NotConverged` when the prediction is not finite.
    """
    cycle, displacement = training_data(law_named("log"), cycle, displacement)
    if len(cycle) < FEWEST:
        raise UsageError(
            f"{len(cycle)} cycles are too few to tell a regime from",
            where="law auto",
            remedy=f"give at least {FEWEST} computed cycles, or name a law: --law log",
        )
    few, means = thinned(cycle, displacement)
    last = displacement[-1]
    if to_cycle == cycle[-1]:
        candidates = candidates_of(few, means, to_cycle)
        return Outlook(regimes_of(few, means), last, last, last, candidates)
    with np.errstate(over="ignore", invalid="ignore"):  # judged below, in one place
        candidates = candidates_of(few, means, to_cycle)
        moved = candidates.median()
        reading = reading_error(cycle, displacement, few, means, probability)
        distance = log(to_cycle / cycle[-1])
        below, above = half_widths(candidates, moved, distance, reading, probability)
        low, high = last + moved - below, last + moved + above
        low = np.where(moved > 0, np.maximum(low, last - reading), low)
        high = np.where(moved < 0, np.minimum(high, last + reading), high)
    if not (np.isfinite(low).all() and np.isfinite(high).all()):
        raise NotConverged(
            f"the slow laws give no finite settlement at cycle {to_cycle:g}",
            remedy="predict less far, or use the law log",
        )
    return Outlook(regimes_of(few, means), last + moved, low, high, candidates)


def half_widths(
    candidates: Candidates,
    moved: FloatArray,
    distance: float,
    reading: FloatArray,
    probability: float,
) -> tuple[FloatArray, FloatArray]:
    """How far the band reaches below and above the prediction, (n,) each; see `outlook`.

    ``moved``: predicted increment, (n,); ``distance``: ln of the jump's end over its start;
    ``reading``: half-width of `reading_error`, (n,).
    """
    from scipy.special import ndtri

    outer = (1 - probability) / 2, (1 + probability) / 2
    lowest, highest = np.quantile(candidates.increment, outer, axis=0)
    held_out = np.zeros_like(moved)
    if candidates.distance:
        miss = np.abs(candidates.combined_miss) * distance / candidates.distance
        held_out = ndtri(outer[1]) * miss
    further = np.hypot(held_out, reading)
    return (
        np.hypot(np.maximum(moved - lowest, 0.0), further),
        np.hypot(np.maximum(highest - moved, 0.0), further),
    )


def reading_error(
    cycle: FloatArray,
    displacement: FloatArray,
    few: FloatArray,
    means: FloatArray,
    probability: float,
) -> FloatArray:
    """Half-width of the interval of one reading, (n,): scatter of the tail about its own trend.

    ``few`` and ``means`` are the `thinned` rows, which give the trend's exponent.
    """
    from scipy.special import stdtrit

    exponent = EXPONENTS[exponent_weights(few, means).argmax(axis=0)]
    residual = tail_residual(cycle, displacement, exponent)
    freedom = np.maximum(independent(residual) - 3, 1.0)
    deviation = np.sqrt((residual * residual).sum(axis=0) / max(len(residual) - 3, 1))
    return np.asarray(stdtrit(freedom, (1 + probability) / 2) * deviation)
