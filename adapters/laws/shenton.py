"""Shenton's law of 1985: the fifth root of the cycles, and a constant rate."""

from __future__ import annotations

import numpy as np

from adapters.bed import FloatArray
from adapters.laws.form import check_training_data, fit_two_terms, log_ratio, outer


class Shenton:
    """u(N) = c + a N^0.2 + b N, a and b of one sign.

    Shenton's own constants for track are a : b = 0.69 : 2.7e-6, so b counts from 1e6 cycles on.
    The exponent is fixed: a change of the unit of N only changes a and b.

    Do not use it where b is fitted to a window of fewer than some decades; b N then explodes.
    """

    name = "shenton"
    parameter_names = ("c", "a", "b")
    parameter_units = ("m", "m", "m/cycle")
    minimum_cycles = 3
    first_state = 0

    def fit(self, cycle: FloatArray, displacement: FloatArray) -> FloatArray:
        """Parameters c, a [m] and b [m/cycle], shape (3, ...); see `Law.fit`."""
        cycle, displacement = check_training_data(self, cycle, displacement)
        scaled = cycle / cycle[-1]
        columns = np.stack([scaled**0.2, scaled])
        a, b = fit_two_terms(columns, displacement)
        a, b = a / cycle[-1] ** 0.2, b / cycle[-1]
        c = displacement.mean(axis=0) - a * (cycle**0.2).mean() - b * cycle.mean()
        return np.stack([c, a, b])

    def value(self, parameters: FloatArray, cycle: float | FloatArray) -> FloatArray:
        """u(N) [m]; see `Law.value`."""
        c, a, b = parameters
        return np.asarray(c + outer(np.asarray(cycle, float) ** 0.2, a) + outer(cycle, b))

    def increment(
        self, parameters: FloatArray, start: float, end: float | FloatArray
    ) -> FloatArray:
        """a (end^0.2 - start^0.2) + b (end - start) [m]; see `Law.increment`."""
        _, a, b = parameters
        root = np.asarray(end, float) ** 0.2 - start**0.2
        if start > 0:  # to round-off of the difference where the two nearly agree
            root = start**0.2 * np.expm1(0.2 * log_ratio(start, end))
        return outer(root, a) + outer(np.asarray(end) - start, b)


LAW = Shenton()
