"""Rotation of free bodies in space: gyroscopic torques, and a step that keeps what they keep.

``I(q) w' = torque - w x I(q) w`` with the inertia tensor ``I(q) = R(q) I_body R(q)^T`` and the
spin w in the world frame.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from rigid_lcp import shapes
from rigid_lcp.arrays import Floats


def find_principal_axes(inertia: ArrayLike) -> tuple[Floats, Floats]:
    """Principal moments (..., 3) in ascending order [kg m^2], and quaternions (..., 4) that turn
    their axes to body coordinates, of tensors (..., 3, 3) in the body frame [kg m^2]."""
    moments, axes = np.linalg.eigh(np.asarray(inertia, dtype=float))
    return moments, shapes.extract_quaternion(axes * np.sign(np.linalg.det(axes))[..., None, None])


def turn_inertia(inertia: Floats, quaternion: Floats) -> Floats:
    """``R I R^T``, (..., 3, 3), of body tensors (..., 3, 3) [kg m^2]."""
    turn = shapes.make_rotation(quaternion)
    return np.einsum("...ij,...jk,...lk->...il", turn, inertia, turn)


def find_spin_acceleration(inertia: Floats, quaternion: Floats, spin: Floats) -> Floats:
    """``-I^-1 (w x I w)`` [rad/s^2], (..., 3): how the spin of a free body changes (eq. 17)."""
    placed = turn_inertia(inertia, quaternion)
    torque = -np.cross(spin, np.einsum("...ij,...j->...i", placed, spin))
    return np.asarray(np.linalg.solve(placed, torque[..., None])[..., 0], dtype=float)


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
    frame = shapes.normalise(shapes.multiply_quaternions(quaternion, axes))
    momentum = moments * shapes.rotate_back(frame, spin)
    twice_energy = (momentum**2 / moments).sum(axis=-1)
    world_momentum = shapes.rotate(frame, momentum)
    rest = 1.0 / moments - 1.0 / moments[..., 1:2]
    for axis, share in ((0, 0.5), (2, 1.0), (0, 0.5)):
        turn = np.zeros_like(momentum)
        turn[..., axis] = share * seconds * rest[..., axis] * momentum[..., axis]
        step = shapes.make_quaternion(turn)
        frame = shapes.multiply_quaternions(frame, step)
        momentum = shapes.rotate_back(step, momentum)
    back = find_energy_turn(moments, momentum, twice_energy, seconds)
    frame = shapes.multiply_quaternions(frame, shapes.make_quaternion(back))
    frame = shapes.turn_quaternion(frame, seconds / moments[..., 1:2] * world_momentum)
    spin = shapes.rotate(frame, shapes.rotate_back(frame, world_momentum) / moments)
    body = shapes.multiply_quaternions(frame, axes * [1.0, -1.0, -1.0, -1.0])
    return shapes.normalise(body), spin


def find_energy_turn(
    moments: Floats, momentum: Floats, twice_energy: Floats, seconds: float
) -> Floats:
    """Rotation vectors (..., 3), in the principal frame, by which a frame turns to a given energy.

    The angular momentum L (..., 3) stays in the world, and so slides along its sphere in the frame,
    towards where ``L . I^-1 L`` grows fastest:

        L(t) = cos t L + sin t |L| g,   g || w - (w . L) L / |L|^2,   L(t) . I^-1 L(t) = 2 E

    ``moments`` (..., 3) [kg m^2], ``twice_energy`` (...,) [J].  The angle t, of third order in the
    step of ``seconds`` [s], is at most ``(|w| seconds)^2``, so that round-off turns no body at
    rest, and a tenth of that between L and w: about a principal axis the energy has no slope.
    """
    size = np.linalg.norm(momentum, axis=-1, keepdims=True)
    along = momentum / np.where(size == 0, 1.0, size)
    spin = momentum / moments
    slope = spin - (spin * along).sum(axis=-1, keepdims=True) * along
    steep = np.linalg.norm(slope, axis=-1, keepdims=True)
    uphill = slope / np.where(steep == 0, 1.0, steep)
    # 2 E(t) = c + (a - c) cos^2 t + 2 b sin t cos t
    a, b, c = (
        size[..., 0] ** 2 * (first * second / moments).sum(axis=-1)
        for first, second in ((along, along), (along, uphill), (uphill, uphill))
    )
    angle = np.zeros_like(a)
    speed = np.linalg.norm(spin, axis=-1)
    most = np.minimum(0.1 * steep[..., 0] / np.maximum(speed, 1e-300), (speed * seconds) ** 2)
    for _ in range(4):  # Newton, from an angle of third order in the step
        sine, cosine = np.sin(angle), np.cos(angle)
        missing = twice_energy - (a * cosine**2 + 2 * b * sine * cosine + c * sine**2)
        rise = 2 * (c - a) * sine * cosine + 2 * b * (cosine**2 - sine**2)
        angle = np.clip(angle + missing / np.where(rise == 0, np.inf, rise), -most, most)
    return np.asarray(angle[..., None] * np.cross(uphill, along))
