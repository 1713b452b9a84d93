"""Oblique impact of an elastic sphere with partial slip: what Maw, Barber and Fawcett computed.

Part of a contact sticks while its rim slips, which no engine here resolves.  The half-space is
replaced by a row of springs that know nothing of one another (method of dimensionality reduction):
a rigid parabola g(x) = x^2/R pressed delta deep into springs of stiffness E* dx along the normal
and G dx along the tangent, each with Coulomb's law of its own, has the very forces of Hertz, of
Cattaneo and Mindlin, and of any history of both (Popov and Hess 2015, Method of Dimensionality
Reduction in Contact Mechanics and Friction, chapters 3 and 5; the impact: Lyashenko and Popov 2015,
Scientific Reports 5, 8479).  1/G = 1/(4 G*) with the project's G* (eq. 6), so that sticking springs
have k_t = 2 a G = 8 a G*.

Elastic, one plane of motion.  In units of m*, V_n and the stiffness of eq. 5, R = 1, E* = 3/4.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from adapters.contact_law import CONTACT_TIME_FACTOR
from adapters.state import FloatArray
from validation.chung_ooi_reference import LIGHTNESS

MODULUS = 0.75
"""E* that makes F_n = delta^(3/2) for R = 1."""


def springs_sheared(
    stretch: FloatArray, advance: FloatArray, grip: FloatArray, stiffness: float
) -> FloatArray:
    """Stretch of every spring after its foot moved by ``advance``, cut where Coulomb's limit is.

    ``stretch`` of shape (n, springs), ``advance`` (n, 1); ``grip`` mu E* (delta - x^2), the most a
    spring bears for each unit of length, zero out of contact, shape (springs,); ``stiffness`` G.
    """
    limit = grip / stiffness
    return np.clip(stretch + advance, -limit, limit)


def partial_slip_impulse(
    slip: FloatArray,
    friction: float,
    stiffness_ratio: float,
    steps: int = 4000,
    springs: int = 400,
) -> FloatArray:
    """Tangential impulse over m* V_n of elastic impacts with partial slip.

    ``slip`` of the contact point over V_n, shape (n,); ``friction`` mu; ``stiffness_ratio``
    6 G*/E*, as in `validation.chung_ooi_reference.friction_impulse`.
    """
    stiffness = MODULUS * stiffness_ratio * 2 / 3  # G = 4 G*
    deepest = 1.25**0.4
    dx = sqrt(deepest) / springs
    x = (np.arange(springs) + 0.5) * dx
    dt = CONTACT_TIME_FACTOR * deepest / steps
    slip = np.array(slip, dtype=float)
    stretch, impulse = np.zeros((len(slip), springs)), np.zeros_like(slip)
    overlap, speed = 0.5 * dt, 1.0
    while overlap > 0:
        grip = friction * MODULUS * np.maximum(overlap - x**2, 0.0)
        stretch = springs_sheared(stretch, slip[:, None] * dt, grip, stiffness)
        force = 2 * stiffness * dx * stretch.sum(axis=1)
        impulse += force * dt
        slip -= LIGHTNESS * force * dt
        speed -= overlap**1.5 * dt
        overlap += speed * dt
    return impulse
