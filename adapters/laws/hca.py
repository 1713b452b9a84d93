"""Law of the high-cycle accumulation model: logarithm from cycle tau on, and a constant rate."""

from __future__ import annotations

import numpy as np

from adapters.bed import FloatArray
from adapters.laws.form import Shape, ShapedLaw, bound_time_shape


class HighCycleAccumulation(ShapedLaw):
    """u(N) = c + a ln(1 + N / tau) + b N, a and b of one sign (Niemunis et al. 2005).

    Their f_N = C1 [ln(1 + C2 N) + C3 N] with a = C1, tau = 1 / C2, b = C1 C3.  Unlike the law
    `log-linear` it has a value at N = 0.

    Do not use it to predict far from a short window: a small b that the window barely shows rules
    the prediction.
    """

    name = "hca"
    parameter_names = ("c", "a", "b", "tau")
    parameter_units = ("m", "m", "m/cycle", "cycle")
    minimum_cycles = 4
    amplitude_count = 2

    def columns(self, cycle: FloatArray, theta: FloatArray) -> FloatArray:
        """ln(1 + N / tau) and N."""
        slowing = np.log1p(cycle / theta[0])
        return np.stack([slowing, np.broadcast_to(cycle, slowing.shape)])

    def shapes(self, cycle: FloatArray) -> tuple[Shape, ...]:
        """tau."""
        return (bound_time_shape(cycle),)


LAW = HighCycleAccumulation()
