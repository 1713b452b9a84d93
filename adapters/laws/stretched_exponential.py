"""Stretched exponential (Kohlrausch, Williams and Watts): relaxation over many time scales."""

import numpy as np

from adapters.bed import FloatArray
from adapters.laws.form import Shape, ShapedLaw, bound_time_shape


class StretchedExponential(ShapedLaw):
    """u(N) = c + a (1 - exp(-(N / tau)^b)), 0.1 <= b <= 1.

    Compaction of tapped grains reaches its steady state so (Philippe and Bideau 2002); b = 1 is
    one time scale, a small b a long tail that looks like ln N over many decades.

    Do not use it on fewer than about ten cycles: tau, b and a are not separable before the
    bend is seen.
    """

    name = "stretched-exponential"
    formula = "c + a (1 - exp(-(N / tau)^b))"
    parameter_names = ("c", "a", "tau", "b")
    parameter_units = ("m", "m", "cycle", "1")
    minimum_cycles = 4

    def column(self, cycle: FloatArray, theta: FloatArray) -> FloatArray:
        """1 - exp(-(N / tau)^b)."""
        return np.asarray(-np.expm1(-((cycle / theta[0]) ** theta[1])))

    def shapes(self, cycle: FloatArray) -> tuple[Shape, ...]:
        """tau and b."""
        return bound_time_shape(cycle), Shape(0.1, 1.0, 10, logarithmic=False)


LAW = StretchedExponential()
