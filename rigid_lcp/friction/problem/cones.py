"""Coulomb's law as complementarity on cones: the natural map and the error of a solution.

With ``K = {r_N >= 0, |r_T| <= mu r_N}`` and its dual ``K* = {s_N >= mu |s_T|}``, a force r and a
relative velocity (or acceleration) u obey Signorini's condition and Coulomb's law (eq. 27) if and
only if ``K* contains u + mu |u_T| n``, orthogonal to r in K (De Saxce and Feng, Math. Comput.
Modelling 28 (1998) 225).  So r is a fixed point of ``r -> P_K(r - rho (u + mu |u_T| n))`` for
every ``rho > 0``, and by how much it is not is the error of a solution.

Arrays are contact after contact, (nc, dim) with columns n, t in 2D and n, t1, t2 in 3D.
"""

import numpy as np
from numba import njit

from rigid_lcp.arrays import Floats


@njit(cache=True)
def find_natural_map(force: Floats, velocity: Floats, mu: Floats, rho: float) -> Floats:
    """``r - P_K(r - rho (u + mu |u_T| n))``, (nc, dim): zero at a solution, in units of r.

    With ``a = r - rho u`` the point to project is ``(a_N - mu |rho u_T|, a_T)``.  Where it lies is
    found by ``a_N + mu (|a_T| - |rho u_T|)``, the lengths subtracted by their squares: added one
    by one the terms of a great mu would swallow a_N, and with it the approach of the bodies.
    """
    error = np.empty_like(force)
    for c in range(force.shape[0]):
        here = slip = change = 0.0
        for k in range(1, force.shape[1]):
            speed = rho * velocity[c, k]
            here += (force[c, k] - speed) ** 2
            slip += speed**2
            change += force[c, k] * (force[c, k] - 2.0 * speed)
        here, slip = np.sqrt(here), np.sqrt(slip)
        longer = change / (here + slip) if here + slip > 0.0 else 0.0
        push = rho * velocity[c, 0]
        height = force[c, 0] - push + mu[c] * longer
        if height <= 0.0:  # in the polar cone: nearest is the apex
            for k in range(force.shape[1]):
                error[c, k] = force[c, k]
        elif here <= mu[c] * (force[c, 0] - push - mu[c] * slip):  # in the cone: it stays
            error[c, 0] = push + mu[c] * slip
            for k in range(1, force.shape[1]):
                error[c, k] = rho * velocity[c, k]
        else:
            nearest = height / (1.0 + mu[c] ** 2)
            error[c, 0] = force[c, 0] - nearest
            share = mu[c] * nearest / here if here > 0.0 else 0.0
            for k in range(1, force.shape[1]):
                error[c, k] = force[c, k] - share * (force[c, k] - rho * velocity[c, k])
    return error


def find_natural_residual(force: Floats, velocity: Floats, mu: Floats, rho: float) -> float:
    """Scale-free error of a solution: the norm of the natural map over that of r [-].

    ``rho``: force over velocity that makes the two comparable, ``1 / mean(diag W)``.  Where all
    forces are zero, the velocities that should not be are measured instead: the norm of the map
    over ``rho`` times that of u.  Zero for no contacts; not finite where a number is not.

    A contact that carries and approaches all the same shows ``rho |u_N| / (1 + mu^2)^(1/2)`` of
    it: at mu = 1000 a residual of 1e-12 means approach to 1e-9.
    """
    found: float = _find_natural_residual(
        np.ascontiguousarray(force, float), np.ascontiguousarray(velocity, float), mu, rho
    )
    return found


@njit(cache=True)
def _find_natural_residual(force: Floats, velocity: Floats, mu: Floats, rho: float) -> float:
    push = rho * velocity
    largest = 0.0
    for c in range(force.shape[0]):
        for k in range(force.shape[1]):
            if not (np.isfinite(force[c, k]) and np.isfinite(push[c, k])):
                return np.nan
            largest = max(largest, abs(force[c, k]), abs(push[c, k]))
    if largest == 0.0:
        return 0.0
    scaled, push = force / largest, push / largest  # squares neither vanish nor overflow
    error = np.sqrt(np.sum(find_natural_map(scaled, push, mu, 1.0) ** 2))
    size = np.sqrt(np.sum(scaled**2))
    return error / (size if size > 0.0 else np.sqrt(np.sum(push**2)))


def norm(values: Floats) -> float:
    """Euclidean norm of all numbers of an array; their squares may vanish or overflow."""
    largest = float(np.abs(values).max(initial=0.0))
    if largest == 0.0 or not np.isfinite(largest):
        return largest
    return largest * float(np.linalg.norm(values / largest))
