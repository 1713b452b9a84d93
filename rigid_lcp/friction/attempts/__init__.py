"""Ways that the plan tries beside the methods."""

from rigid_lcp.friction.attempts.frictionless import solve_frictionless
from rigid_lcp.friction.attempts.proximal_points import (
    POINTS,
    PROXIMAL,
    extrapolate_points,
    solve_proximal,
)
from rigid_lcp.friction.attempts.smoothed_path import follow_smoothed
from rigid_lcp.friction.attempts.sticking import (
    find_heaviness,
    refine_forces,
    seem_loose,
    seem_to_stick,
    solve_sticking,
)

__all__ = [
    "POINTS", "PROXIMAL", "extrapolate_points", "find_heaviness", "follow_smoothed",
    "refine_forces", "seem_loose", "seem_to_stick", "solve_frictionless", "solve_proximal",
    "solve_sticking",
]  # fmt: skip
