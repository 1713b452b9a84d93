"""A law with one or two shape parameters besides its linear ones: what such laws share."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

from adapters.bed import FloatArray
from adapters.laws.form.contract import check_training_data
from adapters.laws.form.projection import Shape, fit_shaped


class ShapedLaw(ABC):
    """u(N) = c + sum_j a_j phi_j(N; theta), a_j of one sign; see `projection` for the fit.

    A law says its names and units, `columns` and `shapes`; parameters are in the order c, a_j,
    theta.  Fits of different laws minimise the same sum of squares, so their residuals compare.
    """

    name: str
    parameter_names: tuple[str, ...]
    parameter_units: tuple[str, ...]
    minimum_cycles: int
    first_state = 0
    amplitude_count = 1
    """p: how many a_j there are."""

    @abstractmethod
    def columns(self, cycle: FloatArray, theta: FloatArray) -> FloatArray:
        """phi_j(N; theta), shape (p, ...), for theta of shape (m, ...); cycles broadcast."""

    @abstractmethod
    def shapes(self, cycle: FloatArray) -> tuple[Shape, ...]:
        """Ranges of theta for data at these cycles."""

    def fit(self, cycle: FloatArray, displacement: FloatArray) -> FloatArray:
        """Parameters, shape (1 + p + m, ...); see `Law.fit`."""
        cycle, displacement = check_training_data(self, cycle, displacement)
        flat = displacement.reshape(len(cycle), -1)
        found = fit_shaped(self.columns, self.shapes(cycle), cycle, flat)
        return found.reshape(-1, *displacement.shape[1:])

    def value(self, parameters: FloatArray, cycle: float | FloatArray) -> FloatArray:
        """u(N) [m]; see `Law.value`."""
        return np.asarray(parameters[0] + self._trend(parameters, cycle))

    def increment(
        self, parameters: FloatArray, start: float, end: float | FloatArray
    ) -> FloatArray:
        """u(end) - u(start) [m]; see `Law.increment`."""
        return self._trend(parameters, end) - self._trend(parameters, start)

    def _trend(self, parameters: FloatArray, cycle: float | FloatArray) -> FloatArray:
        """sum_j a_j phi_j: u(N) - c [m]."""
        cycle, parameters = np.asarray(cycle, float), np.asarray(parameters, float)
        last = 1 + self.amplitude_count
        tail = parameters.shape[1:]
        times = cycle.reshape((*cycle.shape, *(1,) * len(tail)))
        theta = parameters[last:].reshape((-1, *(1,) * cycle.ndim, *tail))
        values = self.columns(times, theta)
        each = parameters[1:last].reshape((-1, *(1,) * cycle.ndim, *tail))
        return np.asarray((each * values).sum(axis=0))
