"""Rigid contact: hard, sharp-edged grains whose forces come from complementarity.

Method: Schwager and Poeschel, Rigid body dynamics of railway ballast (2002).  Start with
`solve_friction` for a friction problem of your own, or with `Scene` and `Simulation` for grains;
errors a user can act on are in `rigid_lcp.errors`.  A name is loaded when it is first used.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from trackbed.cache_folders import provide_cache_folders

if TYPE_CHECKING:
    from rigid_lcp.collision import collide
    from rigid_lcp.errors import RigidError
    from rigid_lcp.friction.auto import solve_friction
    from rigid_lcp.friction.files import read_problem
    from rigid_lcp.friction.problem import BodySpace, FrictionProblem, FrictionSolution
    from rigid_lcp.motion import Scene
    from rigid_lcp.scene import Simulation
    from rigid_lcp.shapes import Disc, HalfSpace, Polygon, Polyhedron, Sphere, make_box
    from rigid_lcp.wear import Breakage, Wear

provide_cache_folders(__path__[0])

_ROOMS = {
    "collision": ("collide",),
    "errors": ("RigidError",),
    "friction.auto": ("solve_friction",),
    "friction.files": ("read_problem",),
    "friction.problem": ("BodySpace", "FrictionProblem", "FrictionSolution"),
    "motion": ("Scene",),
    "scene": ("Simulation",),
    "shapes": ("Disc", "HalfSpace", "Polygon", "Polyhedron", "Sphere", "make_box"),
    "wear": ("Breakage", "Wear"),
}
_HOMES = {name: room for room, names in _ROOMS.items() for name in names}
__all__ = [
    "BodySpace", "Breakage", "Disc", "FrictionProblem", "FrictionSolution", "HalfSpace", "Polygon",
    "Polyhedron", "RigidError", "Scene", "Simulation", "Sphere", "Wear", "collide", "make_box",
    "read_problem", "solve_friction",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'rigid_lcp' has no attribute {name!r}")
    value = globals()[name] = getattr(import_module(f"rigid_lcp.{_HOMES[name]}"), name)
    return value
