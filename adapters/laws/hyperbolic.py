"""Hyperbolic law: settlement that ends, half of it within tau cycles."""

import numpy as np

from adapters.bed import FloatArray
from adapters.laws.form import Shape, ShapedLaw, bound_time_shape


class Hyperbolic(ShapedLaw):
    """u(N) = c + a N / (tau + N): Kondner's curve (1963), its rate falls as N^-2 in the end.

    For beds that shake down.  Do not use it where the settlement still grows with ln N at the end
    of the data: it then ends the growth within about one more decade, whatever the bed does.
    """

    name = "hyperbolic"
    formula = "c + a N / (tau + N)"
    parameter_names = ("c", "a", "tau")
    parameter_units = ("m", "m", "cycle")
    minimum_cycles = 3

    def column(self, cycle: FloatArray, theta: FloatArray) -> FloatArray:
        """N / (tau + N)."""
        return np.asarray(cycle / (theta[0] + cycle))

    def shapes(self, cycle: FloatArray) -> tuple[Shape, ...]:
        """tau."""
        return (bound_time_shape(cycle),)


LAW = Hyperbolic()
