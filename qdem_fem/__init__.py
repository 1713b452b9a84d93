"""QDEM: explicit dynamics of viscoelastic bodies made of linear or quadratic tetrahedra.

Method: Nishiura, Sakaguchi and Aikawa, Materials 10 (2017) 615.  Start with `Body`, `Material` and
`Simulation`; errors a user can act on are in `qdem_fem.files.errors`.  A name is loaded when it is
first used, so that help texts cost nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from trackbed.cache_folders import provide_cache_folders

if TYPE_CHECKING:
    from qdem_fem.bodies import Body, QuadraticBody
    from qdem_fem.contact import CriticalStep
    from qdem_fem.contact.search import PeriodicWidth
    from qdem_fem.contact.spheres import ContactPlane, SphereContact
    from qdem_fem.contact.surface import SurfaceContact
    from qdem_fem.element import Material
    from qdem_fem.files import QdemError, SceneWarning, Series, StepWarning, make_ramp
    from qdem_fem.march import Energy, History, Simulation, StaticAnswer

provide_cache_folders(__path__[0])

_ROOMS = {
    "bodies": ("Body", "QuadraticBody"),
    "contact": ("CriticalStep",),
    "contact.search": ("PeriodicWidth",),
    "contact.spheres": ("ContactPlane", "SphereContact"),
    "contact.surface": ("SurfaceContact",),
    "element": ("Material",),
    "files": ("QdemError", "SceneWarning", "Series", "StepWarning", "make_ramp"),
    "march": ("Energy", "History", "Simulation", "StaticAnswer"),
}
_HOMES = {name: room for room, names in _ROOMS.items() for name in names}
__all__ = [
    "Body", "ContactPlane", "CriticalStep", "Energy", "History", "Material", "PeriodicWidth",
    "QdemError", "QuadraticBody", "SceneWarning", "Series", "Simulation", "SphereContact",
    "StaticAnswer", "StepWarning", "SurfaceContact", "make_ramp",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'qdem_fem' has no attribute {name!r}")
    value = globals()[name] = getattr(import_module(f"qdem_fem.{_HOMES[name]}"), name)
    return value
