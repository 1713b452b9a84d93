"""Bodies in motion: equations, time stepping, Runge-Kutta."""

from rigid_lcp.motion.checks import (
    BOUNDS,
    Loads,
    check_loads,
    explain_step_limit,
    require_line,
    require_number_in,
    require_seconds,
    require_whole_in,
)
from rigid_lcp.motion.equations import (
    find_contact_offset,
    find_relative_velocity,
    make_body_space,
    turn_arm,
)
from rigid_lcp.motion.finite_states import explain_overflow, is_finite
from rigid_lcp.motion.passing_bodies import count_parts
from rigid_lcp.motion.runge_kutta import Pace, advance_runge_kutta
from rigid_lcp.motion.state import Motion, replace_rates
from rigid_lcp.motion.step_problem import StepProblem, make_step_problem
from rigid_lcp.motion.time_stepping import make_contact_forces, step_moreau
from rigid_lcp.motion.world import Body, Scene, World, make_world

__all__ = [
    "BOUNDS", "Body", "Loads", "Motion", "Pace", "Scene", "StepProblem", "World",
    "advance_runge_kutta", "check_loads", "count_parts", "explain_overflow", "explain_step_limit",
    "find_contact_offset", "find_relative_velocity", "is_finite", "make_body_space",
    "make_contact_forces", "make_step_problem", "make_world", "replace_rates", "require_line",
    "require_number_in", "require_seconds", "require_whole_in", "step_moreau", "turn_arm",
]  # fmt: skip
