"""Linear systems of the interior point: factors by bodies, Lorentz cones."""

from rigid_lcp.friction.linear.factorisation import (
    Factorisation,
    SingularSystem,
    Solve,
    choose_factorisation,
)
from rigid_lcp.friction.linear.lorentz_cones import (
    divide_cones,
    find_cone_step,
    find_scaling,
    multiply_cones,
    scale_cones,
    square_scaling,
)

__all__ = [
    "Factorisation", "SingularSystem", "Solve", "choose_factorisation", "divide_cones",
    "find_cone_step", "find_scaling", "multiply_cones", "scale_cones", "square_scaling",
]  # fmt: skip
