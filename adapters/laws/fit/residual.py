"""How well a trend describes residual displacements, and how many cycles that takes.

All functions take one state a cycle end: row p is the state at t + p T, row 0 the one before the
window (Karrech et al. 2007, section 3.1).
"""

from __future__ import annotations

from math import ceil, isfinite, log

import numpy as np

from adapters.bed import FloatArray
from adapters.errors import UsageError
from adapters.laws.form import Law

FIRST_WINDOW = 20
"""Cycles that are fitted first where no k is given: the paper finds k > 20 enough."""


def fit_error_term(law: Law, cycle: FloatArray, displacement: FloatArray) -> FloatArray:
    """xi^(p): displacement less the law fitted to it [m], shape as given (eqs 11, 12, 18).

    ``cycle``, shape (k,), and ``displacement`` [m], shape (k, n, 3) or (k,): the states that
    the law fits, from p = `Law.first_state` on.
    """
    parameters = law.fit(cycle, displacement)
    return np.asarray(displacement - law.value(parameters, np.asarray(cycle, float)))


def measure_displacement_error(
    start: FloatArray, computed: FloatArray, estimated: FloatArray
) -> float:
    """E_r = ||u - u^|| / ||u|| of the residual displacements from ``start`` on (eq. 22).

    Positions [m], shape (n, 3) each.  1 is the error of moving nothing.  With ``start`` the last
    computed state, u is the displacement of the jump alone: the number to judge a method by.
    Few loose grains rule the norm, and two full runs of the same bed, apart by round-off, differ
    by as much as this measures: it compares methods, and proves none.
    """
    computed = np.asarray(computed, float)
    return _relative_error(computed - start, np.asarray(estimated, float) - start)


def measure_coordinates_error(computed: FloatArray, estimated: FloatArray) -> float:
    """E_r of eq. 22 with u the coordinates themselves, as in Figs 6 and 7 of the paper.

    Positions [m], shape (n, 3) each.  The denominator is the size of the sample and depends on
    its origin, so the number is small for any method, moving nothing included; to be quoted
    only beside `measure_displacement_error`.
    """
    return _relative_error(np.asarray(computed, float), np.asarray(estimated, float))


def _relative_error(computed: FloatArray, estimated: FloatArray) -> float:
    size = float(np.linalg.norm(computed))
    if not size > 0:
        raise UsageError("the relative error has no denominator: nothing moved")
    return float(np.linalg.norm(computed - estimated)) / size


def bound_cycles_for_error(low: float, high: float, error: float, probability: float) -> int:
    """Cycles k that keep the mean error term below ``error`` (eq. 15, Chernoff and Hoeffding).

    k >= (b - a)^2 / (2 eps^2) ln(2 / p), for error terms within [``low``, ``high``] = [a, b] and
    an ``error`` eps, all in the same unit; ``probability`` p is the chance of exceeding it.
    At least 1.

    The bound needs *independent* terms in a *known* interval.  Increments of a bed that
    rearranges are correlated (k counts for less than k) and heavy-tailed (the range seen in k
    cycles is not the range); and it bounds the mean error inside the window, not the error of
    an extrapolation.  Read it as a lower limit of k.
    """
    if not 0 < probability < 1:
        raise UsageError(f"a probability lies between 0 and 1, not at {probability:g}")
    if not (high >= low and isfinite(high - low)):
        raise UsageError(f"error terms cannot lie between {low:g} and {high:g}")
    if not (error > 0 and isfinite(error)):
        raise UsageError(f"the error level must be positive and finite, is {error:g}")
    ratio = (high - low) / error
    cycles = ratio * ratio / 2 * log(2 / probability)
    if not isfinite(cycles):
        raise UsageError(f"no number of cycles brings the mean error term below {error:g}")
    return max(1, ceil(cycles))
