"""State of the bodies: where they are and how fast; plain arrays, advanced by functions.

Generalised velocities are one vector, body after body: (x, y, phi) in 2D, (x, y, z, and the spin
in the world frame) in 3D.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

from rigid_lcp.arrays import Floats
from rigid_lcp.shapes import vectors


@dataclass(frozen=True)
class Motion:
    """Positions and velocities of n bodies, fixed ones included."""

    position: Floats  # centres of mass [m], (n, dim)
    angle: Floats
    """2D: angles [rad], (n,), anticlockwise; 3D: unit quaternions (w, x, y, z), (n, 4)."""
    velocity: Floats  # velocities of the centres of mass [m/s], (n, dim)
    spin: Floats  # spins [rad/s]: (n,) in 2D, (n, 3) in the world frame in 3D

    @property
    def dim(self) -> int:
        """2 or 3."""
        return self.position.shape[1]

    @property
    def rates(self) -> Floats:
        """Generalised velocities (n, 3) in 2D, (n, 6) in 3D [m/s, rad/s]."""
        bodies, dim = self.position.shape
        rates = np.empty((bodies, 3 * (dim - 1)))
        rates[:, :dim], rates[:, dim:] = self.velocity, self.spin.reshape(bodies, 2 * dim - 3)
        return rates


def replace_rates(motion: Motion, rates: Floats) -> Motion:
    """The same places with generalised velocities ``rates`` (n, 3) or (n, 6)."""
    dim = motion.dim
    spin = rates[:, 2] if dim == 2 else rates[:, 3:]
    return Motion(motion.position, motion.angle, rates[:, :dim].copy(), spin.copy())


def displace_motion(motion: Motion, move: Floats) -> Motion:
    """Bodies moved by ``move`` (n, 3) [m, rad] or (n, 6) [m, rotation vector]; same velocities."""
    dim = motion.dim
    turned = motion.angle + move[:, 2] if dim == 2 else _turn_bodies(motion.angle, move)
    return Motion(motion.position + move[:, :dim], turned, motion.velocity, motion.spin)


@njit(cache=True)
def _turn_bodies(quaternion: Floats, move: Floats) -> Floats:
    """Orientations (n, 4) turned by the rotation vectors of moves (n, 6), in the world frame."""
    turned = np.empty(quaternion.shape)
    for body in range(len(move)):
        turn = vectors.make_turn(vectors.read_rates(move, body)[1])
        both = vectors.multiply(turn, vectors.read_turn(quaternion, body))
        turned[body] = vectors.normalise(both)
    return turned
