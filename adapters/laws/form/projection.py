"""Laws u(N) = c + a phi(N; theta) by least squares: c and a eliminated, theta searched.

Variable projection (Golub and Pereyra 1973): for given shape parameters theta the best c and a
are known in closed form, so only one or two shape parameters are searched, for all series at once.
A grid over their whole range finds the basin, damped Gauss-Newton steps the bottom of it.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from adapters.bed import FloatArray
from adapters.laws.form.contract import check_training_data

Column = Callable[[FloatArray, FloatArray], FloatArray]
"""phi(N, theta): N (k, 1), theta (m, g) to columns (k, g)."""


@dataclass(frozen=True)
class SearchNumbers:
    """The grid, and the damped steps from its best point."""

    grid_rows: int = 200  # cycles that the grid looks at; it only has to find the basin
    chunk: int = 1_000_000  # numbers in one column array: bounds the memory
    steps: int = 60  # at most; a handful suffices but in flat valleys
    gain_small: float = 1e-8  # part of the sum of squares: a step that gains less ends it [-]
    step_small: float = 1e-10  # step of all shape parameters (ln theta or theta) that ends it [-]


SEARCH = SearchNumbers()


@dataclass(frozen=True)
class Shape:
    """Range of one shape parameter and the density of its grid."""

    low: float
    high: float
    count: int
    logarithmic: bool = True  # true: searched in ln theta, as every number of cycles is

    def make_grid(self) -> FloatArray:
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


def centre(array: FloatArray) -> FloatArray:
    """Less its mean along the first axis: this eliminates c."""
    return array - array.mean(axis=0, keepdims=True)


def normalise(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Centred columns (k, ...) over their norms (...), which come second; 0 where one vanishes."""
    norm = np.sqrt((values * values).sum(axis=0))
    unit = np.zeros_like(values)
    np.divide(values, norm, out=unit, where=norm > 0)
    return unit, norm


def fit_shaped(
    column: Column, shapes: tuple[Shape, ...], cycle: FloatArray, displacement: FloatArray
) -> FloatArray:
    """Parameters c, a, theta, shape (2 + m, n), of n series (k, n) at cycles (k,)."""
    width = max(1, SEARCH.chunk // len(cycle))
    parts = [
        fit_chunk(column, shapes, cycle, displacement[:, start : start + width])
        for start in range(0, displacement.shape[1], width)
    ]
    return np.concatenate(parts, axis=1)


def fit_chunk(
    column: Column, shapes: tuple[Shape, ...], cycle: FloatArray, displacement: FloatArray
) -> FloatArray:
    target = centre(displacement)
    searched = search_grid(column, shapes, cycle, target)
    theta = _find_theta(shapes, _search(column, shapes, cycle, target, searched))
    values = column(cycle[:, None], theta)
    found, _ = _project(values, target)
    constant = displacement.mean(axis=0) - found * values.mean(axis=0)
    return np.concatenate([constant[None], found[None], theta])


def _find_theta(shapes: tuple[Shape, ...], searched: FloatArray) -> FloatArray:
    """Shape parameters (m, ...) from the variables that are searched."""
    return np.stack(
        [np.exp(s) if shape.logarithmic else s for shape, s in zip(shapes, searched, strict=True)]
    )


def search_grid(
    column: Column, shapes: tuple[Shape, ...], cycle: FloatArray, target: FloatArray
) -> FloatArray:
    """The grid point that explains most of each series, shape (m, n), as searched variables."""
    grids = np.meshgrid(*(shape.make_grid() for shape in shapes), indexing="ij")
    points = np.stack([grid.ravel() for grid in grids])
    rows = np.unique(np.linspace(0, len(cycle) - 1, min(len(cycle), SEARCH.grid_rows)).astype(int))
    unit, _ = normalise(centre(column(cycle[rows, None], _find_theta(shapes, points))))
    along = np.matmul(unit.T, centre(target[rows]))
    return points[:, np.argmax(along * along, axis=0)]


def _project(values: FloatArray, target: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Amplitudes (n,) and residuals (k, n) of centred series with columns (k, n)."""
    values = centre(values)
    unit, norm = normalise(values)
    along = (unit * target).sum(axis=0)
    found = np.divide(along, norm, out=np.zeros_like(along), where=norm > 0)
    return found, target - found * values


def _search(
    column: Column, shapes: tuple[Shape, ...], cycle: FloatArray, target: FloatArray,
    start: FloatArray,
) -> FloatArray:  # fmt: skip
    """Levenberg-Marquardt steps on the projected residual inside the bounds, all series at once.

    ``start`` and the result: searched variables, (m, n).  No step raises the sum of squares.
    """
    grids = [shape.make_grid() for shape in shapes]
    low = np.array([grid[0] for grid in grids])[:, None]
    high = np.array([grid[-1] for grid in grids])[:, None]
    best, damping = start.copy(), np.full(start.shape[1], 1e-3)
    active = np.flatnonzero((target * target).sum(axis=0) > 0)
    times = cycle[:, None]

    def find_residual(searched: FloatArray, series: FloatArray) -> FloatArray:
        return _project(column(times, _find_theta(shapes, searched)), series)[1]

    for _ in range(SEARCH.steps):
        if not len(active):
            break
        here, series = best[:, active], target[:, active]
        missed = find_residual(here, series)
        square = (missed * missed).sum(axis=0)
        slopes = []
        for index in range(len(shapes)):
            probe = here.copy()
            inside = here[index] + 1e-7 <= high[index]
            probe[index] += np.where(inside, 1e-7, -1e-7)
            change = find_residual(probe, series) - missed
            slope = change / (probe[index] - here[index])
            outward = np.where((slope * missed).sum(axis=0) > 0, low[index], high[index])
            slopes.append(np.where(here[index] == outward, 0.0, slope))  # held by its bound
        step = solve_damped_step(np.stack(slopes), missed, damping[active])
        tried = np.clip(here + step, low, high)
        again = find_residual(tried, series)
        lower = (again * again).sum(axis=0)
        better = lower < square
        moved = np.abs(tried - here).max(axis=0)
        best[:, active] = np.where(better, tried, here)
        damping[active] = np.where(better, damping[active] / 5, damping[active] * 8)
        settled = better & (square - lower <= SEARCH.gain_small * square)
        done = settled | (moved < SEARCH.step_small) | (damping[active] > 1e8)
        active = active[~done]
    return best


def solve_damped_step(slopes: FloatArray, missed: FloatArray, damping: FloatArray) -> FloatArray:
    """-(J'J + lambda diag J'J)^-1 J'r for one or two shape parameters, (m, n); 0 without slope."""
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


class ShapedLaw(ABC):
    """u(N) = c + a phi(N; theta), theta of one or two shape parameters.

    A law says its names and units, `column` and `shapes`; parameters are in the order c, a, theta.
    Fits of different laws minimise the same sum of squares, so their residuals compare.
    """

    name: str
    formula: str
    parameter_names: tuple[str, ...]
    parameter_units: tuple[str, ...]
    minimum_cycles: int
    first_state = 0

    @abstractmethod
    def column(self, cycle: FloatArray, theta: FloatArray) -> FloatArray:
        """phi(N; theta), shape (...), for theta of shape (m, ...); cycles broadcast."""

    @abstractmethod
    def shapes(self, cycle: FloatArray) -> tuple[Shape, ...]:
        """Ranges of theta for data at these cycles."""

    def fit(self, cycle: FloatArray, displacement: FloatArray) -> FloatArray:
        """Parameters, shape (2 + m, ...); see `Law.fit`."""
        cycle, displacement = check_training_data(self, cycle, displacement)
        flat = displacement.reshape(len(cycle), -1)
        found = fit_shaped(self.column, self.shapes(cycle), cycle, flat)
        return found.reshape(-1, *displacement.shape[1:])

    def value(self, parameters: FloatArray, cycle: float | FloatArray) -> FloatArray:
        """u(N) [m]; see `Law.value`."""
        return np.asarray(parameters[0] + self._trend(parameters, cycle))

    def increment(self, parameters: FloatArray, start: float, to: float | FloatArray) -> FloatArray:
        """u(to) - u(start) [m]; see `Law.increment`."""
        return self._trend(parameters, to) - self._trend(parameters, start)

    def _trend(self, parameters: FloatArray, cycle: float | FloatArray) -> FloatArray:
        """a phi: u(N) - c [m]."""
        cycle, parameters = np.asarray(cycle, float), np.asarray(parameters, float)
        tail = parameters.shape[1:]
        times = cycle.reshape((*cycle.shape, *(1,) * len(tail)))
        theta = parameters[2:].reshape((-1, *(1,) * cycle.ndim, *tail))
        return np.asarray(parameters[1] * self.column(times, theta))
