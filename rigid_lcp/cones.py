"""Coulomb's law as complementarity on cones: projections and the natural map.

With ``K = {r_N >= 0, |r_T| <= mu r_N}`` and its dual ``K* = {s_N >= mu |s_T|}``, a force r and a
relative velocity (or acceleration) u obey Signorini's condition and Coulomb's law (eq. 27) if and
only if ``K* contains u + mu |u_T| n``, orthogonal to r in K (De Saxce and Feng, Math. Comput.
Modelling 28 (1998) 225).  So r is a fixed point of ``r -> P_K(r - rho (u + mu |u_T| n))`` for
every ``rho > 0``, and by how much it is not is the error of a solution.

Arrays are contact after contact, (nc, dim) with columns n, t in 2D and n, t1, t2 in 3D.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@njit(cache=True)
def project_cone(normal: float, tangential: float, mu: float) -> tuple[float, float]:
    """Nearest point of the cone ``t <= mu n`` to ``(n, t)``, ``t = |r_T| >= 0``; returns it."""
    if mu * tangential <= -normal:  # first: with mu = 0 the other test holds below the cone too
        return 0.0, 0.0
    if tangential <= mu * normal:
        return normal, tangential
    nearest = (normal + mu * tangential) / (1.0 + mu * mu)
    return nearest, mu * nearest


@njit(cache=True)
def project_cones(points: Floats, mu: Floats) -> Floats:
    """Project every contact's vector onto its Coulomb cone; ``points`` (nc, dim), ``mu`` (nc,)."""
    projected = np.zeros_like(points)
    for c in range(points.shape[0]):
        squares = 0.0
        for k in range(1, points.shape[1]):
            squares += points[c, k] ** 2
        tangential = np.sqrt(squares)
        normal, allowed = project_cone(points[c, 0], tangential, mu[c])
        projected[c, 0] = normal
        if allowed > 0.0:
            for k in range(1, points.shape[1]):
                projected[c, k] = points[c, k] * (allowed / tangential)
    return projected


@njit(cache=True)
def dual_velocity(velocity: Floats, mu: Floats) -> Floats:
    """``u + mu |u_T| n`` of every contact (De Saxce); ``velocity`` (nc, dim), ``mu`` (nc,)."""
    shifted = velocity.copy()
    for c in range(velocity.shape[0]):
        squares = 0.0
        for k in range(1, velocity.shape[1]):
            squares += velocity[c, k] ** 2
        shifted[c, 0] += mu[c] * np.sqrt(squares)
    return shifted


@njit(cache=True)
def natural_map(force: Floats, velocity: Floats, mu: Floats, rho: float) -> Floats:
    """``r - P_K(r - rho (u + mu |u_T| n))``, (nc, dim): zero at a solution, in units of r."""
    return force - project_cones(force - rho * dual_velocity(velocity, mu), mu)


def natural_residual(force: Floats, velocity: Floats, mu: Floats, rho: float) -> float:
    """Scale-free error of a solution: the norm of the natural map over that of r [-].

    ``rho``: force over velocity that makes the two comparable, ``1 / mean(diag W)``.  Where all
    forces are zero, the velocities that should not be are measured instead: the norm of the map
    over ``rho`` times that of u.  Zero for no contacts.  NaN stays NaN.
    """
    error = float(np.linalg.norm(natural_map(force, velocity, mu, rho)))
    if error == 0.0:
        return 0.0
    scale = float(np.linalg.norm(force)) or rho * float(np.linalg.norm(velocity))
    return error / scale
