"""The problem: definition, checks, residual, proofs that it has no solution."""

from rigid_lcp.friction.problem.checks import (
    check_factors,
    require_finite,
    require_number,
    require_one_a_contact,
    require_range,
    require_start,
    require_whole,
)
from rigid_lcp.friction.problem.cones import find_natural_map, find_natural_residual, norm
from rigid_lcp.friction.problem.definition import (
    BODY_SIZE,
    FORCE_ROUND_OFF,
    MOST_FRICTION,
    SHARE_LEFT,
    BodySpace,
    FrictionProblem,
    FrictionSolution,
    Status,
    judge_forces,
    make_problem,
)
from rigid_lcp.friction.problem.proofs import gives_energy, prove_forces_insufficient

__all__ = [
    "BODY_SIZE", "FORCE_ROUND_OFF", "MOST_FRICTION", "SHARE_LEFT", "BodySpace", "FrictionProblem",
    "FrictionSolution", "Status", "check_factors", "find_natural_map", "find_natural_residual",
    "gives_energy", "judge_forces", "make_problem", "norm", "prove_forces_insufficient",
    "require_finite", "require_number", "require_one_a_contact", "require_range", "require_start",
    "require_whole",
]  # fmt: skip
