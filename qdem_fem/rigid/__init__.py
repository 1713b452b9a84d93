"""Bodies that are rigid in a run: six freedoms each."""

from qdem_fem.rigid import step
from qdem_fem.rigid.forces import Acting, RigidBodies
from qdem_fem.rigid.holds import find_hold
from qdem_fem.rigid.step import Rigid, rigid_advance

__all__ = [
    "Acting", "Rigid", "RigidBodies", "find_hold", "rigid_advance", "step",
]  # fmt: skip
