"""Least squares for u(N) = c + sum_j a_j phi_j(N; theta): c and a_j eliminated, theta searched.

Variable projection (Golub and Pereyra 1973): for given shape parameters theta the best c and a_j
are known in closed form, so only one or two shape parameters are searched, for all series at once.
A grid over their whole range finds the basin, damped Gauss-Newton steps the bottom of it.

Amplitudes a_j of one series have one sign: a bed that settles by two mechanisms does not settle by
the difference of two large opposite ones.  The sign itself is free, so heave is fitted as well.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from adapters.bed import FloatArray

Columns = Callable[[FloatArray, FloatArray], FloatArray]
"""phi(N, theta): N (k, 1), theta (m, g) to columns (p, k, g)."""

GRID_ROWS = 200
"""Cycles that the grid looks at; it only has to find the basin."""
CHUNK = 1_000_000
"""Numbers in one column array: bounds the memory."""
STEPS = 60
"""Damped steps at most; a handful suffices but in flat valleys."""
GAIN_SMALL = 1e-8
"""A step that lowers the sum of squares by less than this share ends a search."""
STEP_SMALL = 1e-10
"""A step of all shape parameters below this (in ln theta or theta) ends a search."""


@dataclass(frozen=True)
class Shape:
    """Range of one shape parameter and the density of its grid."""

    low: float
    high: float
    count: int
    logarithmic: bool = True
    """True: searched in ln theta, as every number of cycles is."""

    def searched(self) -> FloatArray:
        """Grid in the variable that is searched, shape (count,)."""
        if self.logarithmic:
            return np.linspace(np.log(self.low), np.log(self.high), self.count)
        return np.linspace(self.low, self.high, self.count)


def bound_time_shape(cycle: FloatArray) -> Shape:
    """Range of a characteristic number of cycles: a tenth of the first to 100 times the last one.

    Beyond either end the laws no longer change their shape over the data.  The range scales with
    the cycles: the fit does not depend on their unit.
    """
    first, last = float(cycle[cycle > 0][0]), float(cycle[-1])
    return Shape(0.1 * first, 100 * last, 1 + round(5 * float(np.log10(1000 * last / first))))


def orthonormal(columns: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Gram-Schmidt on one or two centred columns, shape (p, k, ...).

    Returns q, as ``columns``, and r of shape (3, ...): the norm of the first, the second's part
    along it, and the norm of the rest.  A column that vanishes, or is the other one to round-off,
    gets q = 0 and norm 0.
    """
    first = columns[0]
    norm = np.sqrt((first * first).sum(axis=0))
    q = np.zeros_like(columns)
    np.divide(first, norm, out=q[0], where=norm > 0)
    triangle = np.zeros((3, *norm.shape))
    triangle[0] = norm
    if len(columns) == 2:
        along = (q[0] * columns[1]).sum(axis=0)
        rest = columns[1] - along * q[0]
        size = np.sqrt((columns[1] ** 2).sum(axis=0))
        left = np.sqrt((rest * rest).sum(axis=0))
        left = np.where(left > len(first) * np.finfo(float).eps * size, left, 0.0)
        np.divide(rest, left, out=q[1], where=left > 0)
        triangle[1], triangle[2] = along, left
    return q, triangle


def amplitudes(projection: FloatArray, triangle: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Amplitudes of one sign and how much of the sum of squares they explain.

    ``projection`` q_j . u, shape (p, ...); ``triangle`` of `orthonormal`.  Where the best two
    amplitudes differ in sign, the constrained minimum has one of them zero: the better single one.
    """
    r00, r01, r11 = triangle
    y0 = projection[0]
    with np.errstate(divide="ignore", invalid="ignore"):
        single = np.where(r00 > 0, y0 / r00, 0.0)
        if len(projection) == 1:
            return single[None], y0 * y0
        y1 = projection[1]
        second = np.where(r11 > 0, y1 / r11, 0.0)
        first = np.where(r00 > 0, (y0 - r01 * second) / r00, 0.0)
        size = r01 * r01 + r11 * r11
        onto = r01 * y0 + r11 * y1
        alone = np.where(size > 0, onto / size, 0.0)
    both = (first * second >= 0) & (r11 > 0)
    prefer = y0 * y0 >= onto * alone
    a0 = np.where(both, first, np.where(prefer, single, 0.0))
    a1 = np.where(both, second, np.where(prefer, 0.0, alone))
    gain = np.where(both, y0 * y0 + y1 * y1, np.where(prefer, y0 * y0, onto * alone))
    return np.stack([a0, a1]), gain


def centred(array: FloatArray, axis: int) -> FloatArray:
    """Less its mean along ``axis``: this eliminates c."""
    return array - array.mean(axis=axis, keepdims=True)


def fit_two_terms(columns: FloatArray, displacement: FloatArray) -> FloatArray:
    """Amplitudes of one sign, shape (2, ...), for columns (2, k) without shape parameters."""
    q, triangle = orthonormal(centred(columns, 1)[..., None])
    flat = displacement.reshape(len(displacement), -1)
    found, _ = amplitudes(q[..., 0] @ flat, triangle)
    return found.reshape(2, *displacement.shape[1:])


def fit_shaped(
    columns: Columns, shapes: tuple[Shape, ...], cycle: FloatArray, displacement: FloatArray
) -> FloatArray:
    """Parameters c, a_j, theta, shape (1 + p + m, n), of n series (k, n) at cycles (k,)."""
    width = max(1, CHUNK // len(cycle))
    parts = [
        fit_chunk(columns, shapes, cycle, displacement[:, start : start + width])
        for start in range(0, displacement.shape[1], width)
    ]
    return np.concatenate(parts, axis=1)


def fit_chunk(
    columns: Columns, shapes: tuple[Shape, ...], cycle: FloatArray, displacement: FloatArray
) -> FloatArray:
    target = centred(displacement, 0)
    searched = search_grid(columns, shapes, cycle, target)
    searched = _search(columns, shapes, cycle, target, searched)
    theta = _theta(shapes, searched)
    shape_values = columns(cycle[:, None], theta)
    found, _ = _projected(shape_values, target)
    constant = displacement.mean(axis=0) - (found * shape_values.mean(axis=1)).sum(axis=0)
    return np.concatenate([constant[None], found, theta])


def _theta(shapes: tuple[Shape, ...], searched: FloatArray) -> FloatArray:
    """Shape parameters (m, ...) from the variables that are searched."""
    return np.stack(
        [np.exp(s) if shape.logarithmic else s for shape, s in zip(shapes, searched, strict=True)]
    )


def search_grid(
    columns: Columns, shapes: tuple[Shape, ...], cycle: FloatArray, target: FloatArray
) -> FloatArray:
    """The grid point that explains most of each series, shape (m, n), as searched variables."""
    grids = np.meshgrid(*(shape.searched() for shape in shapes), indexing="ij")
    points = np.stack([grid.ravel() for grid in grids])
    rows = np.unique(np.linspace(0, len(cycle) - 1, min(len(cycle), GRID_ROWS)).astype(int))
    few = centred(target[rows], 0)
    values = columns(cycle[rows, None], _theta(shapes, points))
    q, triangle = orthonormal(centred(values, 1))
    projection = np.matmul(np.swapaxes(q, 1, 2), few)
    _, gain = amplitudes(projection, triangle[..., None])
    return points[:, np.argmax(gain, axis=0)]


def _projected(values: FloatArray, target: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Amplitudes (p, n) and residuals (k, n) of centred series with columns (p, k, n) each."""
    values = centred(values, 1)
    q, triangle = orthonormal(values)
    found, _ = amplitudes((q * target).sum(axis=1), triangle)
    return found, target - (found[:, None] * values).sum(axis=0)


def _search(
    columns: Columns,
    shapes: tuple[Shape, ...],
    cycle: FloatArray,
    target: FloatArray,
    start: FloatArray,
) -> FloatArray:
    """Levenberg-Marquardt steps on the projected residual inside the bounds, all series at once.

    ``start`` and the result: searched variables, shape (m, n).  A step is taken only where it
    lowers the sum of squares, so the result is never worse than the grid's.
    """
    grids = [shape.searched() for shape in shapes]
    low = np.array([grid[0] for grid in grids])[:, None]
    high = np.array([grid[-1] for grid in grids])[:, None]
    best, damping = start.copy(), np.full(start.shape[1], 1e-3)
    active = np.flatnonzero((target * target).sum(axis=0) > 0)
    times = cycle[:, None]

    def residual(searched: FloatArray, series: FloatArray) -> FloatArray:
        return _projected(columns(times, _theta(shapes, searched)), series)[1]

    for _ in range(STEPS):
        if not len(active):
            break
        here, series = best[:, active], target[:, active]
        missed = residual(here, series)
        square = (missed * missed).sum(axis=0)
        slopes = []
        for index in range(len(shapes)):
            probe = here.copy()
            inside = here[index] + 1e-7 <= high[index]
            probe[index] += np.where(inside, 1e-7, -1e-7)
            change = residual(probe, series) - missed
            slope = change / (probe[index] - here[index])
            outward = np.where((slope * missed).sum(axis=0) > 0, low[index], high[index])
            slopes.append(np.where(here[index] == outward, 0.0, slope))  # held by its bound
        step = solve_damped_step(np.stack(slopes), missed, damping[active])
        tried = np.clip(here + step, low, high)
        again = residual(tried, series)
        lower = (again * again).sum(axis=0)
        better = lower < square
        moved = np.abs(tried - here).max(axis=0)
        best[:, active] = np.where(better, tried, here)
        damping[active] = np.where(better, damping[active] / 5, damping[active] * 8)
        settled = better & (square - lower <= GAIN_SMALL * square)
        done = settled | (moved < STEP_SMALL) | (damping[active] > 1e8)
        active = active[~done]
    return best


def solve_damped_step(slopes: FloatArray, missed: FloatArray, damping: FloatArray) -> FloatArray:
    """-(J'J + lambda diag J'J)^-1 J'r for one or two shape parameters, shape (m, n).

    A parameter without any slope stays where it is.
    """
    gradient = (slopes * missed).sum(axis=1)
    square = (slopes * slopes).sum(axis=1)
    diagonal = np.where(square > 0, square, 1.0) * (1 + damping)
    if len(slopes) == 1:
        return -gradient / diagonal
    mixed = (slopes[0] * slopes[1]).sum(axis=0)
    determinant = diagonal[0] * diagonal[1] - mixed * mixed
    return np.stack(
        [
            (mixed * gradient[1] - diagonal[1] * gradient[0]) / determinant,
            (mixed * gradient[0] - diagonal[0] * gradient[1]) / determinant,
        ]
    )
