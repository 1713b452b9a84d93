"""Bodies made of tetrahedra: nodes, masses, conditions, frames, assembly."""

from qdem_fem.bodies import absorbing_step
from qdem_fem.bodies.absorbing import Absorbers, face_tensors
from qdem_fem.bodies.absorbing_step import Absorber, begin_absorber, end_absorber
from qdem_fem.bodies.assembly import EVERY, NO_CONSTRAINTS, NO_LOADS, NO_PROBES, Assembly
from qdem_fem.bodies.conditions import COMPONENTS, Absorbing, Conditions, Held, NodalLoad, Roller
from qdem_fem.bodies.deformable import Body, Rigid
from qdem_fem.bodies.mass_scaling import find_element_step, find_mass_scaling_factor
from qdem_fem.bodies.motion import Motion
from qdem_fem.bodies.rigid_mass import (
    RigidMass,
    cross_matrix,
    rigid_displacement_fit,
    rigid_velocity_fit,
    stiffness_six,
    turn_matrix,
)

__all__ = [
    "COMPONENTS", "EVERY", "NO_CONSTRAINTS", "NO_LOADS", "NO_PROBES", "Absorber", "Absorbers",
    "Absorbing", "Assembly", "Body", "Conditions", "Held", "Motion", "NodalLoad", "Rigid",
    "RigidMass", "Roller", "absorbing_step", "begin_absorber", "cross_matrix", "end_absorber",
    "face_tensors", "find_element_step", "find_mass_scaling_factor", "rigid_displacement_fit",
    "rigid_velocity_fit", "stiffness_six", "turn_matrix",
]  # fmt: skip
