"""Bodies in motion: equations, time stepping, Runge-Kutta."""

from rigid_lcp.motion.checks import (
    BOUNDS,
    Loads,
    check_loads,
    require_line,
    require_number_in,
    require_seconds,
    require_whole_in,
    too_many_steps,
)
from rigid_lcp.motion.equations import (
    body_space,
    find_contact_offset,
    relative_velocity,
    turn_arm,
)
from rigid_lcp.motion.finite_states import is_finite, too_much
from rigid_lcp.motion.runge_kutta import Pace, advance_runge_kutta
from rigid_lcp.motion.state import Motion, replace_rates
from rigid_lcp.motion.time_stepping import contact_forces, step_moreau
from rigid_lcp.motion.world import Body, Scene, World, make_world

__all__ = [
    "BOUNDS", "Body", "Loads", "Motion", "Pace", "Scene", "World", "advance_runge_kutta",
    "body_space", "check_loads", "contact_forces", "find_contact_offset", "is_finite",
    "make_world", "relative_velocity", "replace_rates", "require_line", "require_number_in",
    "require_seconds", "require_whole_in", "step_moreau", "too_many_steps", "too_much", "turn_arm",
]  # fmt: skip
