"""Power law: settlement grows as N^b, slower than in proportion, without an end."""

import numpy as np

from adapters.bed import FloatArray
from adapters.laws.form import Shape, ShapedLaw


class Power(ShapedLaw):
    """u(N) = c + a N^b, 0.02 <= b <= 1 (Monismith et al. 1975; Li and Selig 1996).

    b tends to 0 for the logarithm and is 1 for a constant rate, so the fitted b says where between
    the two a bed is.  c frees b from the origin of u; a depends on the unit of N, b does not.

    Do not use it to predict far from noisy data: an error db of b costs a factor r^db at r
    times the last cycle.
    """

    name = "power"
    formula = "c + a N^b"
    parameter_names = ("c", "a", "b")
    parameter_units = ("m", "m", "1")
    minimum_cycles = 3

    def column(self, cycle: FloatArray, theta: FloatArray) -> FloatArray:
        """N^b."""
        return np.asarray(cycle ** theta[0])

    def shapes(self, cycle: FloatArray) -> tuple[Shape, ...]:
        """b."""
        return (Shape(0.02, 1.0, 25, logarithmic=False),)


LAW = Power()
