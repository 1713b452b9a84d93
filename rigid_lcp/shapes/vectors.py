"""Vectors, quaternions and rotation matrices as tuples of numbers: what compiled kernels reckon by.

A vector of the plane is one of space with z = 0, so that one kernel serves both.  Quaternions as in
`rigid_lcp.shapes.rotations`, to the order of the sums.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from rigid_lcp.arrays import Floats

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Matrix = tuple[Vector, Vector, Vector]


@njit(cache=True)
def read(rows: Floats, i: int) -> Vector:
    """Row i of vectors (n, 2) or (n, 3)."""
    return rows[i, 0], rows[i, 1], rows[i, 2] if rows.shape[1] == 3 else 0.0


@njit(cache=True)
def read_spin(rates: Floats, i: int) -> Vector:
    """Spin of body i [rad/s], of generalised velocities (n, 3) in the plane, (n, 6) in space."""
    if rates.shape[1] == 3:
        return 0.0, 0.0, rates[i, 2]
    return rates[i, 3], rates[i, 4], rates[i, 5]


@njit(cache=True)
def read_velocity(rates: Floats, i: int) -> Vector:
    """Velocity of body i [m/s], of generalised velocities."""
    return rates[i, 0], rates[i, 1], rates[i, 2] if rates.shape[1] == 6 else 0.0


@njit(cache=True)
def add(a: Vector, share: float, b: Vector) -> Vector:
    """``a + share b``."""
    return a[0] + share * b[0], a[1] + share * b[1], a[2] + share * b[2]


@njit(cache=True)
def dot(a: Vector, b: Vector) -> float:
    """``a . b``."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True)
def project(a: Vector, b: Vector) -> float:
    """``a . b``, summed as `numpy.einsum` does: so states are to the bit those of NumPy's code."""
    return (a[0] * b[0] + a[2] * b[2]) + a[1] * b[1]


@njit(cache=True)
def cross(a: Vector, b: Vector) -> Vector:
    """``a x b``."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@njit(cache=True)
def multiply(left: Quaternion, right: Quaternion) -> Quaternion:
    """``left right``: the rotation ``right`` first, then ``left``."""
    w, v, s, u = left[0], left[1:], right[0], right[1:]
    x = cross(v, u)
    return (
        w * s - dot(v, u),
        w * u[0] + s * v[0] + x[0], w * u[1] + s * v[1] + x[1], w * u[2] + s * v[2] + x[2],
    )  # fmt: skip


@njit(cache=True)
def make_turn(phi: Vector) -> Quaternion:
    """Quaternion of a turn by ``|phi|`` [rad] about ``phi``."""
    half = 0.5 * np.sqrt(dot(phi, phi))
    angle = np.pi * (half / np.pi)  # rounded as in `numpy.sinc`
    share = 0.5 * (np.sin(angle) / angle if angle > 0.0 else 1.0)
    return np.cos(half), share * phi[0], share * phi[1], share * phi[2]


@njit(cache=True)
def normalise(q: Quaternion) -> Quaternion:
    """A quaternion of length one; not finite for one of length zero."""
    squares = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]
    length = np.sqrt(squares) if squares > 0.0 else np.nan
    return q[0] / length, q[1] / length, q[2] / length, q[3] / length


@njit(cache=True)
def make_rotation(q: Quaternion) -> Matrix:
    """``R(q)`` by rows, of a unit quaternion."""
    w, x, y, z = q
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )


@njit(cache=True)
def rotate(r: Matrix, v: Vector) -> Vector:
    """``R v``."""
    return project(r[0], v), project(r[1], v), project(r[2], v)


@njit(cache=True)
def rotate_back(r: Matrix, v: Vector) -> Vector:
    """``R^T v``."""
    return (
        r[0][0] * v[0] + r[1][0] * v[1] + r[2][0] * v[2],
        r[0][1] * v[0] + r[1][1] * v[1] + r[2][1] * v[2],
        r[0][2] * v[0] + r[1][2] * v[1] + r[2][2] * v[2],
    )
