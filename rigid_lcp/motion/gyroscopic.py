"""Rotation of free bodies in space: gyroscopic torques, and a step that keeps what they keep.

``I(q) w' = torque - w x I(q) w`` with the inertia tensor ``I(q) = R(q) I_body R(q)^T`` and the
spin w in the world frame.
"""

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

from rigid_lcp import shapes
from rigid_lcp.arrays import Floats
from rigid_lcp.shapes import vectors


def find_principal_axes(inertia: ArrayLike) -> tuple[Floats, Floats]:
    """Principal moments (..., 3) in ascending order [kg m^2], and quaternions (..., 4) that turn
    their axes to body coordinates, of tensors (..., 3, 3) in the body frame [kg m^2]."""
    moments, axes = np.linalg.eigh(np.asarray(inertia, dtype=float))
    return moments, shapes.extract_quaternion(axes * np.sign(np.linalg.det(axes))[..., None, None])


def turn_inertia(inertia: Floats, quaternion: Floats) -> Floats:
    """``R I R^T``, (..., 3, 3), of body tensors (..., 3, 3) [kg m^2]."""
    inertia = np.broadcast_to(inertia, (*quaternion.shape[:-1], 3, 3))
    placed: Floats = _turn_tensors(inertia.reshape(-1, 3, 3), quaternion.reshape(-1, 4))
    return placed.reshape(inertia.shape)


@njit(cache=True, error_model="numpy")
def _turn_tensors(inertia: Floats, quaternion: Floats) -> Floats:
    placed = np.zeros(inertia.shape)
    for body in range(len(inertia)):
        turn = vectors.make_rotation(vectors.read_turn(quaternion, body))
        for i, j, k, m in np.ndindex(3, 3, 3, 3):
            placed[body, i, m] += turn[i][j] * inertia[body, j, k] * turn[m][k]
    return placed


def find_spin_acceleration(inertia: Floats, quaternion: Floats, spin: Floats) -> Floats:
    """``-I^-1 (w x I w)`` [rad/s^2], (..., 3): how the spin of a free body changes (eq. 17)."""
    placed = turn_inertia(inertia, quaternion)
    torque = find_gyroscopic_torque(placed.reshape(-1, 3, 3), spin.reshape(-1, 3))
    change = np.linalg.solve(placed, torque.reshape(*spin.shape, 1))
    return np.asarray(change[..., 0], dtype=float)


@njit(cache=True, error_model="numpy")
def find_gyroscopic_torque(placed: Floats, spin: Floats) -> Floats:
    """``-w x I w`` [N m], (n, 3), of tensors in the world frame (n, 3, 3) [kg m^2]."""
    torque = np.empty(spin.shape)
    for body in range(len(spin)):
        w, rows = vectors.read(spin, body), placed[body]
        tensor = vectors.read(rows, 0), vectors.read(rows, 1), vectors.read(rows, 2)
        torque[body] = vectors.cross(vectors.rotate(tensor, w), w)
    return torque


def rotate_freely(
    principal: tuple[Floats, Floats], quaternion: Floats, spin: Floats, seconds: float
) -> tuple[Floats, Floats]:
    """Orientation (..., 4) and spin (..., 3) of free bodies after ``seconds`` [s], in one step;
    ``principal``: their `find_principal_axes`.

    The kinetic energy ``sum L_i^2 / 2 I_i`` is split into that of a sphere with the middle moment
    and one rest for the first and for the third axis; each part turns the body about one axis,
    exactly (symplectic splitting; Touma and Wisdom, Astron. J. 107 (1994) 1189).  It keeps the
    angular momentum; what it lacks of the energy, of third order in the step, is added by
    `find_energy_turn`.  So both are kept to round-off, the error is of second order, and spheres,
    cubes and all bodies with two equal moments move exactly.
    """
    moments, axes = principal
    turned, spun = _rotate_bodies(
        moments.reshape(-1, 3), axes.reshape(-1, 4), quaternion.reshape(-1, 4), spin.reshape(-1, 3),
        seconds,
    )  # fmt: skip
    return shapes.normalise(turned.reshape(quaternion.shape)), spun.reshape(spin.shape)


@njit(cache=True, error_model="numpy")
def _rotate_bodies(
    moments: Floats, axes: Floats, quaternion: Floats, spin: Floats, seconds: float
) -> tuple[Floats, Floats]:
    turned, spun = np.empty(quaternion.shape), np.empty(spin.shape)
    for body in range(len(spin)):
        m, own = vectors.read(moments, body), vectors.read_turn(axes, body)
        frame = vectors.normalise(vectors.multiply(vectors.read_turn(quaternion, body), own))
        placed = vectors.make_rotation(frame)
        w = vectors.rotate_back(placed, vectors.read(spin, body))
        momentum = (m[0] * w[0], m[1] * w[1], m[2] * w[2])
        twice_energy = momentum[0] ** 2 / m[0] + momentum[1] ** 2 / m[1] + momentum[2] ** 2 / m[2]
        world = vectors.rotate(placed, momentum)
        for axis, share in ((0, 0.5), (2, 1.0), (0, 0.5)):
            angle = share * seconds * (1.0 / m[axis] - 1.0 / m[1]) * momentum[axis]
            step = vectors.make_turn((angle, 0.0, 0.0) if axis == 0 else (0.0, 0.0, angle))
            frame = vectors.multiply(frame, step)
            momentum = vectors.rotate_back(vectors.make_rotation(step), momentum)
        back = find_energy_turn(m, momentum, twice_energy, seconds)
        frame = vectors.multiply(frame, vectors.make_turn(back))
        share = seconds / m[1]
        turn = vectors.make_turn((share * world[0], share * world[1], share * world[2]))
        frame = vectors.normalise(vectors.multiply(turn, frame))
        placed = vectors.make_rotation(frame)
        w = vectors.rotate_back(placed, world)
        spun[body] = vectors.rotate(placed, (w[0] / m[0], w[1] / m[1], w[2] / m[2]))
        turned[body] = vectors.multiply(frame, (own[0], -own[1], -own[2], -own[3]))
    return turned, spun


@njit(cache=True, error_model="numpy")
def find_energy_turn(
    moments: vectors.Vector, momentum: vectors.Vector, twice_energy: float, seconds: float
) -> vectors.Vector:
    """Rotation vector, in the principal frame, by which a frame turns to a given energy.

    The angular momentum L stays in the world, and so slides along its sphere in the frame,
    towards where ``L . I^-1 L`` grows fastest:

        L(t) = cos t L + sin t |L| g,   g || w - (w . L) L / |L|^2,   L(t) . I^-1 L(t) = 2 E

    ``moments`` [kg m^2], ``twice_energy`` [J].  The angle t, of third order in the step of
    ``seconds`` [s], is at most ``(|w| seconds)^2``, so that round-off turns no body at rest, and a
    tenth of that between L and w: about a principal axis the energy has no slope.
    """
    m, size = moments, np.sqrt(vectors.dot(momentum, momentum))
    if size == 0.0:
        return 0.0, 0.0, 0.0
    along = vectors.divide(momentum, size)
    spin = (momentum[0] / m[0], momentum[1] / m[1], momentum[2] / m[2])
    slope = vectors.add(spin, -vectors.dot(spin, along), along)
    steep, speed = np.sqrt(vectors.dot(slope, slope)), np.sqrt(vectors.dot(spin, spin))
    if steep == 0.0:
        return 0.0, 0.0, 0.0
    g = vectors.divide(slope, steep)
    # 2 E(t) = c + (a - c) cos^2 t + 2 b sin t cos t
    a = size**2 * (along[0] ** 2 / m[0] + along[1] ** 2 / m[1] + along[2] ** 2 / m[2])
    b = size**2 * (along[0] * g[0] / m[0] + along[1] * g[1] / m[1] + along[2] * g[2] / m[2])
    c = size**2 * (g[0] ** 2 / m[0] + g[1] ** 2 / m[1] + g[2] ** 2 / m[2])
    angle, most = 0.0, min(0.1 * steep / speed, (speed * seconds) ** 2)
    for _ in range(4):  # Newton, from an angle of third order in the step
        sine, cosine = np.sin(angle), np.cos(angle)
        missing = twice_energy - (a * cosine**2 + 2 * b * sine * cosine + c * sine**2)
        rise = 2 * (c - a) * sine * cosine + 2 * b * (cosine**2 - sine**2)
        angle = min(max(angle + (missing / rise if rise != 0.0 else 0.0), -most), most)
    turn = vectors.cross(g, along)
    return angle * turn[0], angle * turn[1], angle * turn[2]
