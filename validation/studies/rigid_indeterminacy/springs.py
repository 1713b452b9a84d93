"""Grains on stiff springs, integrated in time: the molecular dynamics that rigid forces limit to.

The geometry is the real one, overlaps and turning normals included, and the detection, the
equations and the integrator are not those of `rigid_lcp`.  Normal springs ``f_N = -k g`` in
overlap; tangential springs with memory, cut at Coulomb's limit (Cundall and Strack, Geotechnique
29 (1979) 47).  A drag on every body brings it to rest; only the state at rest is used.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np
from numba import njit

from rigid_lcp.arrays import Floats, Ints
from validation.bench.rigid.static_grains import Grains

STEP = 0.15
"""Step in units of ``(m_min / k)^1/2``: a contact's period has 30 of them or more."""
DRAG = 0.25
"""Drag in units of ``(k / m_max)^1/2``."""
LOOK = 200
"""Steps between looks at the forces out of balance."""


@dataclass(frozen=True)
class Rest:
    """Where the springs came to rest."""

    force: Floats
    """Forces on body a along (n, t), (nc, 2) [N]."""
    steps: int
    imbalance: float
    """Greatest force out of balance over the weight [-]."""
    displacement: Floats
    """From where the grains touched, (3 n,) [m, rad]."""


def settle_springs(
    grains: Grains, stiffness: float, friction: float, *, tangential: float = 1.0,
    ramp: int = 0, tolerance: float = 1e-12, steps_max: int = 400_000, damping: float = 0.0,
) -> Rest:  # fmt: skip
    """The grains under gravity on springs of ``stiffness`` [N/m], until they rest.

    ``tangential``: stiffness of the tangential springs over that of the normal ones; ``ramp``:
    steps in which gravity grows from nothing (0: at once).  Stops when no force out of balance is
    above ``tolerance`` of the weight, or after ``steps_max``.  ``damping``: of dashpots along the
    normals, in units of ``(k m)^1/2`` with the mean mass m.
    """
    h = STEP * sqrt(
        float(min(grains.mass.min(), (grains.inertia / find_arms(grains)).min())) / stiffness
    )
    drag = DRAG * sqrt(stiffness / float(grains.mass.max()))
    n = len(grains.mass)
    state = np.zeros((n + 1, 6))
    state[:n, :2] = grains.centre
    force, shear = np.zeros((len(grains.body_a), 2)), np.zeros(len(grains.body_a))
    steps, imbalance = advance_springs(
        state, shear, force, grains.mass, grains.inertia, grains.gravity, grains.body_a,
        grains.body_b, grains.place_a, grains.radius_a, grains.place_b, grains.radius_b,
        grains.face, friction, stiffness, tangential * stiffness, h, drag,
        damping * sqrt(stiffness * float(grains.mass.mean())), ramp, tolerance * grains.weight,
        steps_max,
    )  # fmt: skip
    state[:n, :2] -= grains.centre
    moved = state[:n, :3].ravel()
    return Rest(force, int(steps), float(imbalance) / grains.weight, moved)


def find_arms(grains: Grains) -> Floats:
    """Square of the longest arm of a contact on every body [m^2], (n,)."""
    longest = np.full(len(grains.mass) + 1, 1e-300)
    reach_a = np.linalg.norm(grains.place_a, axis=1) + grains.radius_a
    reach_b = np.linalg.norm(grains.place_b, axis=1) + grains.radius_b
    np.maximum.at(longest, grains.body_a, reach_a**2)
    np.maximum.at(longest, grains.body_b, reach_b**2)
    return longest[:-1]


@njit(cache=True)
def advance_springs(
    state: Floats, shear: Floats, force: Floats, mass: Floats, inertia: Floats, gravity: Floats,
    body_a: Ints, body_b: Ints, place_a: Floats, radius_a: Floats, place_b: Floats,
    radius_b: Floats, face: Floats, friction: float, kn: float, kt: float, h: float, drag: float,
    dashpot: float, ramp: int, allowed: float, steps_max: int,
) -> tuple[int, float]:  # fmt: skip
    """Semi-implicit Euler steps of length ``h`` [s] until rest; steps and imbalance [N].

    ``state`` (n + 1, 6): x, y, angle and their rates; changed, as are ``shear`` (nc,) [m] and
    ``force`` (nc, 2) [N].
    """
    n = len(mass)
    total = np.zeros((n + 1, 3))
    worst = np.inf
    for step in range(steps_max):
        pull = min(1.0, (step + 1.0) / ramp) if ramp > 0 else 1.0
        total[:, :] = 0.0
        for b in range(n):
            total[b, 0], total[b, 1] = pull * gravity[0] * mass[b], pull * gravity[1] * mass[b]
        for c in range(len(body_a)):
            a, b = body_a[c], body_b[c]
            ca, sa = np.cos(state[a, 2]), np.sin(state[a, 2])
            cb, sb = np.cos(state[b, 2]), np.sin(state[b, 2])
            ax = state[a, 0] + ca * place_a[c, 0] - sa * place_a[c, 1]
            ay = state[a, 1] + sa * place_a[c, 0] + ca * place_a[c, 1]
            bx = state[b, 0] + cb * place_b[c, 0] - sb * place_b[c, 1]
            by = state[b, 1] + sb * place_b[c, 0] + cb * place_b[c, 1]
            if face[c, 0] != 0.0 or face[c, 1] != 0.0:
                nx, ny = cb * face[c, 0] - sb * face[c, 1], sb * face[c, 0] + cb * face[c, 1]
                gap = (ax - bx) * nx + (ay - by) * ny - radius_a[c]
            else:
                distance = np.hypot(ax - bx, ay - by)
                nx, ny = (ax - bx) / distance, (ay - by) / distance
                gap = distance - radius_a[c] - radius_b[c]
            px, py = ax - (radius_a[c] + 0.5 * gap) * nx, ay - (radius_a[c] + 0.5 * gap) * ny
            rax, ray = px - state[a, 0], py - state[a, 1]
            rbx, rby = px - state[b, 0], py - state[b, 1]
            ux = state[a, 3] - state[a, 5] * ray - state[b, 3] + state[b, 5] * rby
            uy = state[a, 4] + state[a, 5] * rax - state[b, 4] - state[b, 5] * rbx
            push = max(-kn * gap - dashpot * (ux * nx + uy * ny), 0.0) if gap < 0.0 else 0.0
            shear[c] += h * (uy * nx - ux * ny)
            rub = -kt * shear[c]
            if abs(rub) > friction * push:
                rub = np.sign(rub) * friction * push
                shear[c] = -rub / kt
            force[c, 0], force[c, 1] = push, rub
            fx, fy = push * nx - rub * ny, push * ny + rub * nx
            total[a, 0] += fx
            total[a, 1] += fy
            total[a, 2] += rax * fy - ray * fx
            total[b, 0] -= fx
            total[b, 1] -= fy
            total[b, 2] -= rbx * fy - rby * fx
        if step % LOOK == LOOK - 1 and step >= ramp:
            worst = 0.0
            for b in range(n):
                worst = max(worst, abs(total[b, 0]), abs(total[b, 1]))
            if worst <= allowed:
                return step + 1, worst
        for b in range(n):
            for k in range(3):
                inert = mass[b] if k < 2 else inertia[b]
                state[b, 3 + k] += h * (total[b, k] / inert - drag * state[b, 3 + k])
                state[b, k] += h * state[b, 3 + k]
    return steps_max, worst
