"""Inverse logarithm (the Chicago group): the slowest of the laws that end."""

import numpy as np

from adapters.bed import FloatArray
from adapters.laws.form import Shape, ShapedLaw, bound_time_shape


class InverseLog(ShapedLaw):
    """u(N) = c + a (1 - 1 / (1 + B ln(1 + N / tau))).

    Density of tapped grains approaches its limit so (Knight et al. 1995): each grain needs a void
    of its own size, and those become rare exponentially.  A small B is the logarithmic law.

    Do not read a as the settlement at the end of the track's life: half of what is left at
    N is still left at N^2.
    """

    name = "inverse-log"
    formula = "c + a (1 - 1 / (1 + B ln(1 + N / tau)))"
    parameter_names = ("c", "a", "tau", "B")
    parameter_units = ("m", "m", "cycle", "1")
    minimum_cycles = 4

    def column(self, cycle: FloatArray, theta: FloatArray) -> FloatArray:
        """B ln(1 + N / tau) / (1 + B ln(1 + N / tau))."""
        growth = theta[1] * np.log1p(cycle / theta[0])
        return np.asarray(growth / (1 + growth))

    def shapes(self, cycle: FloatArray) -> tuple[Shape, ...]:
        """tau and B."""
        return bound_time_shape(cycle), Shape(0.01, 10.0, 10)


LAW = InverseLog()
