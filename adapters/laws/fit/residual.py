"""How well an estimate meets computed positions: E_r of eq. 22 of Karrech et al. (2007)."""

import numpy as np

from adapters.bed import FloatArray
from adapters.errors import UsageError

FIRST_WINDOW = 20
"""Cycles that are fitted first where no k is given: the paper finds k > 20 enough."""


def compare_displacements(start: FloatArray, computed: FloatArray, estimated: FloatArray) -> float:
    """E_r = ||u - u^|| / ||u|| of the residual displacements from ``start`` on (eq. 22).

    Positions [m], shape (n, 3) each.  1 is the error of moving nothing.  With ``start`` the last
    computed state, u is the displacement of the jump alone: the number to judge a method by.
    Few loose grains rule the norm, and two full runs of the same bed, apart by round-off, differ
    by as much as this measures: it compares methods, and proves none.
    """
    computed = np.asarray(computed, float)
    return _measure_relative_error(computed - start, np.asarray(estimated, float) - start)


def compare_coordinates(computed: FloatArray, estimated: FloatArray) -> float:
    """E_r of eq. 22 with u the coordinates themselves, as in Figs 6 and 7 of the paper.

    Positions [m], shape (n, 3) each.  The denominator is the size of the sample and depends on
    its origin, so the number is small for any method, moving nothing included; to be quoted
    only beside `compare_displacements`.
    """
    return _measure_relative_error(np.asarray(computed, float), np.asarray(estimated, float))


def _measure_relative_error(computed: FloatArray, estimated: FloatArray) -> float:
    size = float(np.linalg.norm(computed))
    if not size > 0:
        raise UsageError("the relative error has no denominator: nothing moved")
    return float(np.linalg.norm(computed - estimated)) / size
