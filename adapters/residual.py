"""Residual displacement of grains, how well a trend describes it, and how many cycles that takes.

All functions take one state a cycle end: row p is the state at t + p T, row 0 the one before the
window (Karrech et al. 2007, section 3.1).
"""

from __future__ import annotations

from math import ceil, isfinite, log, sqrt

import numpy as np

from adapters.errors import UsageError
from adapters.laws.law import Law
from adapters.state import FloatArray


def residual_displacement(position: FloatArray) -> FloatArray:
    """u^r(t + p T) = x(t + p T) - x(t) [m], shape (k+1, n, 3), as ``position`` [m] (eqs 8, 9).

    At a cycle's end the load is that of its start, so the reversible part of eq. 8 is the same
    and drops out.  What eq. 9 lets die away first, the motion that outlasts the load, is kept:
    small when the kinetic energy at the cycle's end is.
    """
    position = np.asarray(position, float)
    return np.asarray(position - position[0])


def residual_increment(position: FloatArray) -> FloatArray:
    """u^r(t + p T) - u^r(t + (p-1) T) [m], p = 1 ... k, shape (k, n, 3) (eqs 10, 12)."""
    return np.diff(np.asarray(position, float), axis=0)


def error_term(law: Law, cycle: FloatArray, displacement: FloatArray) -> FloatArray:
    """xi^(p): displacement less the law fitted to it [m], shape as given (eqs 11, 12, 18).

    ``cycle``, shape (k,), and ``displacement`` [m], shape (k, n, 3) or (k,): the states that
    the law fits, from p = `Law.first_state` on.
    """
    parameters = law.fit(cycle, displacement)
    return np.asarray(displacement - law.value(parameters, np.asarray(cycle, float)))


def stability_of_displacement(position: FloatArray) -> FloatArray:
    """g_u(k) = 1/k (sum over grains, p <= k, axes of increment^2)^(1/2) [m] (eq. 13).

    For k = 1 ... K, shape (K,), from ``position`` [m], shape (K+1, n, 3).  It falls as k^(-1/2)
    for a steady settlement: a small g_u says that k is large, not that a law holds.
    """
    increment = residual_increment(position)
    square = (increment**2).reshape(len(increment), -1).sum(axis=1)
    return np.asarray(np.sqrt(np.cumsum(square)) / np.arange(1, len(square) + 1))


def stability_of_error(law: Law, cycle: FloatArray, displacement: FloatArray) -> FloatArray:
    """f_xi(k) = 1/k (sum over grains, p <= k, axes of xi^2)^(1/2) [m] (eq. 14).

    For every k from the fewest states the law needs to K, the law fitted to the first k cycles.
    ``cycle``, shape (K+1,); ``displacement`` [m], shape (K+1, n, 3); K refits.  The last entry
    is k = K, so entry -1-j is k = K - j.
    """
    first = law.first_state
    return np.array(
        [
            np.linalg.norm(error_term(law, cycle[first:end], displacement[first:end])) / (end - 1)
            for end in range(first + law.minimum_cycles, len(cycle) + 1)
        ]
    )


def error_of_displacement(start: FloatArray, computed: FloatArray, estimated: FloatArray) -> float:
    """E_r = ||u - u^|| / ||u|| of the residual displacements from ``start`` on (eq. 22).

    Positions [m], shape (n, 3) each.  1 is the error of moving nothing.  With ``start`` the last
    computed state, u is the displacement of the jump alone: the number to judge a method by.
    Few loose grains rule the norm, and two full runs of the same bed, apart by round-off, differ
    by as much as this measures: it compares methods, and proves none.
    """
    computed = np.asarray(computed, float)
    return _relative_error(computed - start, np.asarray(estimated, float) - start)


def error_of_coordinates(computed: FloatArray, estimated: FloatArray) -> float:
    """E_r of eq. 22 with u the coordinates themselves, as in Figs 6 and 7 of the paper.

    Positions [m], shape (n, 3) each.  The denominator is the size of the sample and depends on
    its origin, so the number is small for any method, moving nothing included; to be quoted
    only beside `error_of_displacement`.
    """
    return _relative_error(np.asarray(computed, float), np.asarray(estimated, float))


def _relative_error(computed: FloatArray, estimated: FloatArray) -> float:
    size = float(np.linalg.norm(computed))
    if not size > 0:
        raise UsageError("the relative error has no denominator: nothing moved")
    return float(np.linalg.norm(computed - estimated)) / size


def cycles_for_error(low: float, high: float, error: float, probability: float) -> int:
    """Cycles k that keep the mean error term below ``error`` (eq. 15, Chernoff and Hoeffding).

    k >= (b - a)^2 / (2 eps^2) ln(2 / p), for error terms within [``low``, ``high``] = [a, b] and
    an ``error`` eps, all in the same unit; ``probability`` p is the chance of exceeding it.
    At least 1.

    The bound needs *independent* terms in a *known* interval.  Increments of a bed that
    rearranges are correlated (k counts for less than k) and heavy-tailed (the range seen in k
    cycles is not the range); and it bounds the mean error inside the window, not the error of
    an extrapolation.  Read it as a lower limit of k.
    """
    _bound_arguments(low, high, probability)
    if not (error > 0 and isfinite(error)):
        raise UsageError(f"the error level must be positive and finite, is {error:g}")
    ratio = (high - low) / error
    cycles = ratio * ratio / 2 * log(2 / probability)
    if not isfinite(cycles):
        raise UsageError(f"no number of cycles brings the mean error term below {error:g}")
    return max(1, ceil(cycles))


def error_for_cycles(low: float, high: float, cycles: int, probability: float) -> float:
    """The error level eps that ``cycles`` reach: the inverse of `cycles_for_error`.

    eps = (b - a) (ln(2 / p) / (2 k))^(1/2), in the unit of ``low`` and ``high``; holds as little.
    """
    _bound_arguments(low, high, probability)
    if cycles < 1:
        raise UsageError(f"at least one cycle is needed, not {cycles}")
    return (high - low) * sqrt(log(2 / probability) / (2 * cycles))


def _bound_arguments(low: float, high: float, probability: float) -> None:
    if not 0 < probability < 1:
        raise UsageError(f"a probability lies between 0 and 1, not at {probability:g}")
    if not (high >= low and isfinite(high - low)):
        raise UsageError(f"error terms can not lie between {low:g} and {high:g}")
