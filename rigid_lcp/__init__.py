"""Rigid contact: hard, sharp-edged grains whose forces come from complementarity.

Method: Schwager and Poeschel, Rigid body dynamics of railway ballast (2002).  Start with
`solve_friction` for a friction problem of your own, or with `Scene` and `Simulation` for grains;
errors a user can act on are in `rigid_lcp.errors`.  A name is loaded when it is first used.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from trackbed.cache_folders import provide_cache_folders

if TYPE_CHECKING:
    from rigid_lcp.breakage import Breakage
    from rigid_lcp.collisions import collide
    from rigid_lcp.disc import Disc
    from rigid_lcp.errors import RigidError
    from rigid_lcp.friction_problem import BodySpace, FrictionProblem, FrictionSolution
    from rigid_lcp.frictionless import lcp
    from rigid_lcp.half_space import HalfSpace
    from rigid_lcp.polygon import Polygon
    from rigid_lcp.polyhedron import Polyhedron, box
    from rigid_lcp.scene import Scene
    from rigid_lcp.simulation import Simulation
    from rigid_lcp.solver import solve_friction
    from rigid_lcp.sphere import Sphere
    from rigid_lcp.wear import Wear

provide_cache_folders(__path__[0])

_HOMES = {
    "BodySpace": "friction_problem",
    "Breakage": "breakage",
    "Disc": "disc",
    "FrictionProblem": "friction_problem",
    "FrictionSolution": "friction_problem",
    "HalfSpace": "half_space",
    "Polygon": "polygon",
    "Polyhedron": "polyhedron",
    "RigidError": "errors",
    "Scene": "scene",
    "Simulation": "simulation",
    "Sphere": "sphere",
    "Wear": "wear",
    "box": "polyhedron",
    "collide": "collisions",
    "lcp": "frictionless",
    "solve_friction": "solver",
}
__all__ = [
    "BodySpace",
    "Breakage",
    "Disc",
    "FrictionProblem",
    "FrictionSolution",
    "HalfSpace",
    "Polygon",
    "Polyhedron",
    "RigidError",
    "Scene",
    "Simulation",
    "Sphere",
    "Wear",
    "box",
    "collide",
    "lcp",
    "solve_friction",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'rigid_lcp' has no attribute {name!r}")
    value = globals()[name] = getattr(import_module(f"rigid_lcp.{_HOMES[name]}"), name)
    return value
