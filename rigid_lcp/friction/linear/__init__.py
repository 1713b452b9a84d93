"""Linear systems of the interior point: factors by bodies, Lorentz cones."""

from rigid_lcp.friction.linear.factorisation import (
    Factorisation,
    SingularSystem,
    Solve,
    factorisation,
)
from rigid_lcp.friction.linear.lorentz_cones import (
    cone_divide,
    cone_product,
    cone_scale,
    cone_scaling,
    cone_scaling_square,
    cone_step,
)

__all__ = [
    "Factorisation", "SingularSystem", "Solve", "cone_divide", "cone_product", "cone_scale",
    "cone_scaling", "cone_scaling_square", "cone_step", "factorisation",
]  # fmt: skip
