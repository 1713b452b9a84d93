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
    from rigid_lcp.errors import RigidError
    from rigid_lcp.friction_problem import BodySpace, FrictionProblem, FrictionSolution
    from rigid_lcp.frictionless import lcp
    from rigid_lcp.scene import Scene
    from rigid_lcp.shapes_2d import Disc, HalfSpace, Polygon
    from rigid_lcp.shapes_3d import Polyhedron, Sphere, box
    from rigid_lcp.simulation import Simulation
    from rigid_lcp.solver import solve_friction
    from rigid_lcp.wear import Wear

provide_cache_folders(__path__[0])

_HOMES = {
    "BodySpace": "friction_problem",
    "Breakage": "breakage",
    "Disc": "shapes_2d",
    "FrictionProblem": "friction_problem",
    "FrictionSolution": "friction_problem",
    "HalfSpace": "shapes_2d",
    "Polygon": "shapes_2d",
    "Polyhedron": "shapes_3d",
    "RigidError": "errors",
    "Scene": "scene",
    "Simulation": "simulation",
    "Sphere": "shapes_3d",
    "Wear": "wear",
    "box": "shapes_3d",
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
