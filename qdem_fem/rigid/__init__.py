"""Bodies that are rigid in a run: six freedoms each."""

from qdem_fem.rigid import step
from qdem_fem.rigid.bodies import Acting, RigidBodies
from qdem_fem.rigid.step import Rigid, advance_rigid

__all__ = ["Acting", "Rigid", "RigidBodies", "advance_rigid", "step"]
