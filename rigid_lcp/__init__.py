"""Rigid contact: hard, sharp-edged grains whose forces come from complementarity.

Method: Schwager and Poeschel, Rigid body dynamics of railway ballast (2002).  Start with
`solve_friction` for a friction problem of your own, or with `Scene` and `Simulation` for grains;
errors a user can act on are in `rigid_lcp.errors`.  A name is loaded when it is first used.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rigid_lcp.errors import RigidError
    from rigid_lcp.friction_problem import BodySpace, FrictionProblem, FrictionSolution
    from rigid_lcp.solver import solve_friction

_HOMES = {
    "BodySpace": "friction_problem",
    "FrictionProblem": "friction_problem",
    "FrictionSolution": "friction_problem",
    "RigidError": "errors",
    "solve_friction": "solver",
}
__all__ = ["BodySpace", "FrictionProblem", "FrictionSolution", "RigidError", "solve_friction"]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'rigid_lcp' has no attribute {name!r}")
    value = globals()[name] = getattr(import_module(f"rigid_lcp.{_HOMES[name]}"), name)
    return value
