"""QDEM: explicit dynamics of viscoelastic bodies made of linear tetrahedra.

Method: Nishiura, Sakaguchi and Aikawa, Materials 10 (2017) 615.  Start with `Body`, `Material`
and `Simulation`.
"""

from qdem_fem.body import Body
from qdem_fem.errors import QdemError
from qdem_fem.material import Material
from qdem_fem.series import Series, ramp
from qdem_fem.simulation import Energy, History, Simulation

__all__ = [
    "Body",
    "Energy",
    "History",
    "Material",
    "QdemError",
    "Series",
    "Simulation",
    "ramp",
]
