"""The problem: definition, checks, residual, proofs that it has no solution."""

from rigid_lcp.friction.problem.checks import (
    check_factors,
    in_range,
    require_finite,
    require_number,
    require_one_a_contact,
    require_start,
    require_whole,
)
from rigid_lcp.friction.problem.cones import length, natural_map, natural_residual
from rigid_lcp.friction.problem.definition import (
    BODY_SIZE,
    FORCE_ROUND_OFF,
    MOST_FRICTION,
    SHARE_LEFT,
    BodySpace,
    FrictionProblem,
    FrictionSolution,
    Status,
    friction_problem,
    judge_forces,
)
from rigid_lcp.friction.problem.proofs import gives_energy, prove_forces_insufficient

__all__ = [
    "BODY_SIZE", "FORCE_ROUND_OFF", "MOST_FRICTION", "SHARE_LEFT", "BodySpace",
    "FrictionProblem", "FrictionSolution", "Status", "check_factors", "friction_problem",
    "gives_energy", "in_range", "judge_forces", "length", "natural_map", "natural_residual",
    "prove_forces_insufficient", "require_finite", "require_number",
    "require_one_a_contact", "require_start", "require_whole",
]  # fmt: skip
