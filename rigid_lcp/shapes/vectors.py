"""Vectors, quaternions and rotation matrices as tuples of numbers, for compiled kernels.

Small arrays would cost more than what is done with them; rows of three numbers are vectors too.
A vector of the plane is one of space with z = 0, so that one kernel serves both.  Formulas and the
order of their sums are those of `rigid_lcp.shapes.rotations`.
"""

import numpy as np
from numba import njit

from rigid_lcp.arrays import Floats

Vector = tuple[float, float, float]
Row = Vector | Floats  # also a row of an array (n, 3)
Quaternion = tuple[float, float, float, float]
Matrix = tuple[Vector, Vector, Vector]


@njit(cache=True, error_model="numpy")
def read(rows: Floats, i: int) -> Vector:
    """Row i of vectors (n, 2) or (n, 3)."""
    return rows[i, 0], rows[i, 1], rows[i, 2] if rows.shape[1] == 3 else 0.0


@njit(cache=True, error_model="numpy")
def read_rates(rates: Floats, i: int) -> tuple[Vector, Vector]:
    """Velocity [m/s] and spin [rad/s] of body i, of generalised velocities (n, 3) or (n, 6)."""
    x = rates[i]
    if len(x) == 3:
        return (x[0], x[1], 0.0), (0.0, 0.0, x[2])
    return (x[0], x[1], x[2]), (x[3], x[4], x[5])


@njit(cache=True, error_model="numpy")
def read_turn(rows: Floats, i: int) -> Quaternion:
    """Row i of quaternions (n, 4)."""
    return rows[i, 0], rows[i, 1], rows[i, 2], rows[i, 3]


@njit(cache=True, error_model="numpy")
def add(a: Row, share: float, b: Row) -> Vector:
    """``a + share b``."""
    return a[0] + share * b[0], a[1] + share * b[1], a[2] + share * b[2]


@njit(cache=True, error_model="numpy")
def subtract(a: Row, b: Row) -> Vector:
    """``a - b``."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@njit(cache=True, error_model="numpy")
def divide(a: Row, b: float) -> Vector:
    """``a / b``."""
    return a[0] / b, a[1] / b, a[2] / b


@njit(cache=True, error_model="numpy")
def dot(a: Row, b: Row) -> float:
    """``a . b``."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True, error_model="numpy")
def project(a: Row, b: Row) -> float:
    """``a . b`` in the order of `numpy.einsum`, so that states are to the bit as it made them."""
    return (a[0] * b[0] + a[2] * b[2]) + a[1] * b[1]


@njit(cache=True, error_model="numpy")
def cross(a: Row, b: Row) -> Vector:
    """``a x b``."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@njit(cache=True, error_model="numpy")
def multiply(left: Quaternion, right: Quaternion) -> Quaternion:
    """``left right``: the rotation ``right`` first, then ``left``."""
    w, v, s, u = left[0], left[1:], right[0], right[1:]
    x = cross(v, u)
    real = w * s - dot(v, u)
    return real, w * u[0] + s * v[0] + x[0], w * u[1] + s * v[1] + x[1], w * u[2] + s * v[2] + x[2]


@njit(cache=True, error_model="numpy")
def make_turn(phi: Vector) -> Quaternion:
    """Quaternion of a turn by ``|phi|`` [rad] about ``phi``."""
    half = 0.5 * np.sqrt(dot(phi, phi))
    angle = np.pi * (half / np.pi)  # rounded as in `numpy.sinc`
    share = 0.5 * (np.sin(angle) / angle if angle > 0.0 else 1.0)
    return np.cos(half), share * phi[0], share * phi[1], share * phi[2]


@njit(cache=True, error_model="numpy")
def normalise(q: Quaternion) -> Quaternion:
    """A quaternion of length one; not finite for one of length zero."""
    squares = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]
    length = np.sqrt(squares) if squares > 0.0 else np.nan
    return q[0] / length, q[1] / length, q[2] / length, q[3] / length


@njit(cache=True, error_model="numpy")
def make_rotation(q: Quaternion) -> Matrix:
    """``R(q)`` by rows, of a unit quaternion."""
    w, x, y, z = q
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )


@njit(cache=True, error_model="numpy")
def rotate(r: Matrix, v: Row) -> Vector:
    """``R v``."""
    return project(r[0], v), project(r[1], v), project(r[2], v)


@njit(cache=True, error_model="numpy")
def rotate_back(r: Matrix, v: Row) -> Vector:
    """``R^T v``."""
    x, y, z = r
    return (
        x[0] * v[0] + y[0] * v[1] + z[0] * v[2],
        x[1] * v[0] + y[1] * v[1] + z[1] * v[2],
        x[2] * v[0] + y[2] * v[1] + z[2] * v[2],
    )
