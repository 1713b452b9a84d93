"""Sums over all nodes on a GPU, of what a march asks behind every window: energy and momentum.

A thread adds every p-th node's part, p threads in all, and the host adds the p sums: in a fixed
order, and with a few of them to be read in place of two fields.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from qdem_fem.kernel.cuda.step import cuda, grid

PARTS = 2048
"""Threads, at most."""


@cuda.jit
def motion_sums(displacement: Any, velocity: Any, mass: Any, sums: Any) -> None:
    """``sums`` (p, 7) over every p-th node: of m v.v, of m u (3), of m v (3), in double precision.

    ``mass`` (n,) [kg]; fields flat, four numbers a node.
    """
    part = cuda.grid(1)
    if part >= sums.shape[0]:
        return
    energy, ux, uy, uz, vx, vy, vz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for node in range(part, mass.size, sums.shape[0]):
        m, at = mass[node], 4 * node
        px, py, pz = m * velocity[at], m * velocity[at + 1], m * velocity[at + 2]
        energy += px * velocity[at] + py * velocity[at + 1] + pz * velocity[at + 2]
        ux += m * displacement[at]
        uy += m * displacement[at + 1]
        uz += m * displacement[at + 2]
        vx, vy, vz = vx + px, vy + py, vz + pz
    sums[part, 0] = energy
    sums[part, 1], sums[part, 2], sums[part, 3] = ux, uy, uz
    sums[part, 4], sums[part, 5], sums[part, 6] = vx, vy, vz


def motion_summed(displacement: Any, velocity: Any, mass: Any) -> NDArray[np.float64]:
    """`motion_sums` of all nodes, (7,), on the host."""
    sums = cuda.device_array((min(PARTS, mass.size), 7))
    motion_sums[grid(sums.shape[0])](displacement, velocity, mass, sums)
    found: NDArray[np.float64] = sums.copy_to_host().sum(axis=0)
    return found
