"""Linear systems of Newton's steps: factors by bodies, Lorentz cones, a time limit."""

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
from rigid_lcp.friction.linear.time_limit import (
    NO_LIMIT,
    SLOWEST,
    Clock,
    TimedFactorisation,
)

__all__ = [
    "NO_LIMIT", "SLOWEST", "Clock", "Factorisation", "SingularSystem", "Solve",
    "TimedFactorisation", "choose_factorisation", "divide_cones", "find_cone_step", "find_scaling",
    "multiply_cones", "scale_cones", "square_scaling",
]  # fmt: skip
