"""Bodies made of tetrahedra: nodes, masses, conditions, frames, assembly."""

from qdem_fem.bodies.assembly import EVERY, NOTHING, Assembly, Given
from qdem_fem.bodies.conditions import COMPONENTS, Conditions, Held, NodalLoad, Roller, remove_held
from qdem_fem.bodies.deformable import Body, Rigid
from qdem_fem.bodies.discretisation import (
    LOCKING,
    Discretisation,
    estimate_bending,
    estimate_discretisation,
    is_locking,
)
from qdem_fem.bodies.mass_scaling import find_element_step, find_mass_scaling_factor
from qdem_fem.bodies.quadratic import QuadraticBody
from qdem_fem.bodies.rigid_mass import (
    RigidMass,
    fit_rigid_displacement,
    fit_rigid_velocity,
    make_cross_matrix,
    make_stiffness_six,
    make_turn_matrix,
)

__all__ = [
    "COMPONENTS", "EVERY", "LOCKING", "NOTHING", "Assembly", "Body", "Conditions",
    "Discretisation", "Given", "Held", "NodalLoad", "QuadraticBody", "Rigid", "RigidMass", "Roller",
    "estimate_bending", "estimate_discretisation", "find_element_step",
    "find_mass_scaling_factor", "fit_rigid_displacement", "fit_rigid_velocity",
    "is_locking", "make_cross_matrix", "make_stiffness_six", "make_turn_matrix", "remove_held",
]  # fmt: skip
