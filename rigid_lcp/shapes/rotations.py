"""Rotations in space by unit quaternions ``(w, x, y, z)``; spins in the world frame [rad/s].

A quaternion turns body coordinates to world coordinates: ``v_world = R(q) v_body``.  All
functions take one rotation or a stack of them, (..., 4) with (..., 3).  `make_rotation`, `rotate`
and `rotate_back` take angles (..., 1) [rad] too, and turn vectors (..., 2) of the plane.
Formulas: Shuster, J. Astronaut. Sci. 41 (1993) 439.
"""

import numpy as np
from numpy.typing import ArrayLike

from rigid_lcp.arrays import Floats
from rigid_lcp.errors import SceneError


def normalise(quaternion: ArrayLike) -> Floats:
    """Scale quaternions (..., 4) to length one.

    Raises `SceneError` for one of zero length or with NaN: it names no rotation.
    """
    q = np.asarray(quaternion, dtype=float)
    length = np.linalg.norm(q, axis=-1, keepdims=True)
    if q.shape[-1:] != (4,) or not (np.isfinite(length) & (length > 0)).all():
        raise SceneError(
            "a quaternion is not four finite numbers with a length", where="quaternion",
            remedy="give (w, x, y, z), (1, 0, 0, 0) for a body that is not turned",
        )  # fmt: skip
    return q / length


def multiply_quaternions(left: Floats, right: Floats) -> Floats:
    """``left right``: the rotation ``right`` first, then ``left``; both (..., 4)."""
    w, v = left[..., :1], left[..., 1:]
    s, u = right[..., :1], right[..., 1:]
    scalar = w * s - (v * u).sum(axis=-1, keepdims=True)
    return np.concatenate([scalar, w * u + s * v + np.cross(v, u)], axis=-1)


def make_quaternion(rotation_vector: ArrayLike) -> Floats:
    """Quaternion of a turn by ``|phi|`` [rad] about the axis ``phi / |phi|``; ``phi`` (..., 3)."""
    phi = np.asarray(rotation_vector, dtype=float)
    half = 0.5 * np.linalg.norm(phi, axis=-1, keepdims=True)
    # np.sinc(x) = sin(pi x) / (pi x): exact and smooth at no rotation
    return np.concatenate([np.cos(half), 0.5 * np.sinc(half / np.pi) * phi], axis=-1)


def make_rotation(quaternion: Floats) -> Floats:
    """``R(q)``, (..., 3, 3), of unit quaternions (..., 4); (..., 2, 2) of angles (..., 1)."""
    components = np.moveaxis(np.asarray(quaternion, dtype=float), -1, 0)
    if len(components) == 1:
        c, s = np.cos(components[0]), np.sin(components[0])
        rows = [[c, -s], [s, c]]
    else:
        w, x, y, z = components
        rows = [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def extract_quaternion(matrix: ArrayLike) -> Floats:
    """Unit quaternions (..., 4) of rotation matrices (..., 3, 3), by their largest component.

    The outer product of q with itself is linear in R: its longest column is q without loss of
    digits near half turns (Bar-Itzhack, J. Guid. Control Dyn. 23 (2000) 1085).
    """
    r = np.asarray(matrix, dtype=float)
    (a, b, c), (d, e, f), (g, h, i) = np.moveaxis(r, (-2, -1), (0, 1))
    outer = np.stack([
        np.stack([1 + a + e + i, h - f, c - g, d - b], axis=-1),
        np.stack([h - f, 1 + a - e - i, b + d, c + g], axis=-1),
        np.stack([c - g, b + d, 1 - a + e - i, f + h], axis=-1),
        np.stack([d - b, c + g, f + h, 1 - a - e + i], axis=-1),
    ], axis=-2)  # fmt: skip
    longest = np.argmax(np.einsum("...ii->...i", outer), axis=-1)
    column = np.take_along_axis(outer, longest[..., None, None], axis=-2)[..., 0, :]
    return column / np.linalg.norm(column, axis=-1, keepdims=True)


def rotate(quaternion: Floats, vector: ArrayLike) -> Floats:
    """World coordinates (..., 3) of body vectors (..., 3): ``R(q) v``."""
    return np.einsum("...ij,...j->...i", make_rotation(quaternion), np.asarray(vector, float))


def rotate_back(quaternion: Floats, vector: ArrayLike) -> Floats:
    """Body coordinates (..., 3) of world vectors (..., 3): ``R(q)^T v``."""
    return np.einsum("...ji,...j->...i", make_rotation(quaternion), np.asarray(vector, float))


def find_quaternion_rate(quaternion: Floats, spin: Floats) -> Floats:
    """``dq/dt = (0, w) q / 2``, (..., 4), for Runge-Kutta stages."""
    pure = np.concatenate([np.zeros_like(spin[..., :1]), spin], axis=-1)
    return 0.5 * multiply_quaternions(pure, quaternion)
