"""Ways that the plan tries beside the methods."""

from rigid_lcp.friction.attempts.frictionless import frictionless
from rigid_lcp.friction.attempts.proximal_points import (
    POINTS,
    PROXIMAL,
    extrapolated_points,
    proximal_newton,
)
from rigid_lcp.friction.attempts.smoothed_path import smoothed_path
from rigid_lcp.friction.attempts.sticking import (
    heaviness,
    refined,
    seem_loose,
    seem_to_stick,
    sticking,
)

__all__ = [
    "POINTS", "PROXIMAL", "extrapolated_points", "frictionless", "heaviness",
    "proximal_newton", "refined", "seem_loose", "seem_to_stick", "smoothed_path", "sticking",
]  # fmt: skip
