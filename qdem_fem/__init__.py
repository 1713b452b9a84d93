"""QDEM: explicit dynamics of viscoelastic bodies made of linear tetrahedra.

Method: Nishiura, Sakaguchi and Aikawa, Materials 10 (2017) 615.  Start with `Body`, `Material`
and `Simulation`; errors a user can act on are in `qdem_fem.errors`.  A name is loaded when it is
first used, so that help texts cost nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from trackbed.cache_folders import provide_cache_folders

if TYPE_CHECKING:
    from qdem_fem.body import Body
    from qdem_fem.contact_spheres import ContactPlane, SphereContact
    from qdem_fem.contact_surface import SurfaceContact
    from qdem_fem.critical_step import CriticalStep
    from qdem_fem.dynamic_relaxation import StaticAnswer
    from qdem_fem.energies import Energy
    from qdem_fem.errors import QdemError, StepWarning
    from qdem_fem.material import Material
    from qdem_fem.periodic import PeriodicWidth
    from qdem_fem.series import Series, ramp
    from qdem_fem.simulation import History, Simulation

provide_cache_folders(__path__[0])

_HOMES = {
    "Body": "body",
    "ContactPlane": "contact_spheres",
    "CriticalStep": "critical_step",
    "Energy": "energies",
    "History": "simulation",
    "Material": "material",
    "PeriodicWidth": "periodic",
    "QdemError": "errors",
    "Series": "series",
    "Simulation": "simulation",
    "SphereContact": "contact_spheres",
    "SurfaceContact": "contact_surface",
    "StaticAnswer": "dynamic_relaxation",
    "StepWarning": "errors",
    "ramp": "series",
}
__all__ = [
    "Body",
    "ContactPlane",
    "CriticalStep",
    "Energy",
    "History",
    "Material",
    "PeriodicWidth",
    "QdemError",
    "Series",
    "Simulation",
    "SphereContact",
    "StaticAnswer",
    "StepWarning",
    "SurfaceContact",
    "ramp",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'qdem_fem' has no attribute {name!r}")
    value = globals()[name] = getattr(import_module(f"qdem_fem.{_HOMES[name]}"), name)
    return value
