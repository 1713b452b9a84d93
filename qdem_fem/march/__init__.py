"""Time: state, leapfrog, energies, checkpoints, static answers; `Simulation` is here."""

from qdem_fem.march.checkpoint import read_checkpoint, write_checkpoint
from qdem_fem.march.dynamic_relaxation import StaticAnswer
from qdem_fem.march.energies import Energy, split_motion
from qdem_fem.march.kinetic_damping import Damping, Rest, find_rest
from qdem_fem.march.options import Contact
from qdem_fem.march.rigid_motions import check_held
from qdem_fem.march.simulation import History, Simulation

__all__ = [
    "Contact", "Damping", "Energy", "History", "Rest", "Simulation", "StaticAnswer",
    "check_held", "find_rest", "read_checkpoint", "split_motion", "write_checkpoint",
]  # fmt: skip
