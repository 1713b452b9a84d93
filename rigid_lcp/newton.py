"""Semismooth Newton on Alart and Curnier's form of Coulomb's law: the polish to round-off.

With ``z = r_N - rho u_N`` and ``y = r_T - rho u_T`` (Alart and Curnier, CMAME 92 (1991) 353)

    F = (r_N - max(0, z),  r_T - the nearest point to y of the disc of radius mu max(0, z))

is zero exactly at a solution.  One step solves ``(A + B W) dr = -F``, A and B the derivatives of F
by r and u: contacts open, stick or slide in it, and once these are guessed right the step is
exact but for the direction of sliding.  Where forces are not unique (stick, redundant contacts)
W is singular there; A is shifted by ``shift * B``, which is one proximal-point step on r: the
limit has no error from it, unlike Tikhonov's.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rigid_lcp.body_factorisation import Factorisation, SingularSystem, factorisation
from rigid_lcp.friction_problem import FrictionProblem, FrictionSolution, friction_solution

Floats = NDArray[np.float64]
Flags = NDArray[np.int8]


@njit(cache=True)
def alart_curnier(
    force: Floats, velocity: Floats, mu: Floats, rho: Floats
) -> tuple[Floats, Floats, Floats, Flags]:
    """F and its derivatives A = dF/dr, B = dF/du, and the status of each contact.

    ``force`` and ``velocity`` (nc, dim); ``rho`` (nc,) force per velocity.  Status: 0 open,
    1 stick, 2 slide.
    """
    nc, dim = force.shape
    f = np.empty((nc, dim))
    a = np.zeros((nc, dim, dim))
    b = np.zeros((nc, dim, dim))
    status = np.zeros(nc, dtype=np.int8)
    y = np.empty(dim)
    for c in range(nc):
        z = force[c, 0] - rho[c] * velocity[c, 0]
        if z <= 0.0:
            for i in range(dim):
                f[c, i] = force[c, i]
                a[c, i, i] = 1.0
            continue
        f[c, 0] = rho[c] * velocity[c, 0]
        b[c, 0, 0] = rho[c]
        length = 0.0
        for i in range(1, dim):
            y[i] = force[c, i] - rho[c] * velocity[c, i]
            length += y[i] ** 2
        length = np.sqrt(length)
        radius = mu[c] * z
        if length <= radius:
            status[c] = 1
            for i in range(1, dim):
                f[c, i] = rho[c] * velocity[c, i]
                b[c, i, i] = rho[c]
            continue
        status[c] = 2
        for i in range(1, dim):
            y[i] /= length
        for i in range(1, dim):
            f[c, i] = force[c, i] - radius * y[i]
            a[c, i, 0] = -mu[c] * y[i]
            b[c, i, 0] = mu[c] * y[i] * rho[c]
            for j in range(1, dim):
                turn = radius / length * ((1.0 if i == j else 0.0) - y[i] * y[j])
                a[c, i, j] = (1.0 if i == j else 0.0) - turn
                b[c, i, j] = rho[c] * turn
    return f, a, b, status

def newton(problem, start, tolerance, *, solver=None, iterations=40, shifts=(1e-9,1e-6,1e-4), patience=5, verbose=False):
    nc, dim = problem.contacts, problem.dim
    mu = problem.friction
    solver = solver or factorisation(problem)
    r = np.zeros(nc*dim) if start is None else start.copy()
    diag = (problem.bodies.diagonal if problem.bodies is not None else problem.delassus.diagonal()).reshape(nc, dim)
    rho = 1 / np.maximum(diag.max(axis=1), 1e-9*diag.max())
    best, best_res, since = r, problem.residual(r), 0
    it = 0
    for shift in shifts:
        r, since, ref = best, 0, best_res
        while it < iterations and best_res > tolerance:
            it += 1
            u = problem.velocity(r).reshape(nc, dim)
            f, a, b, st = alart_curnier(r.reshape(nc, dim), u, mu, rho)
            if verbose: print('  N', it, shift, f"{problem.residual(r):.2e}", np.bincount(st, minlength=3))
            try:
                dr = solver.factor(a + shift * problem.rho / rho[:, None, None]  * b, b)(-f.ravel())
            except SingularSystem:
                break
            r = r + dr
            res = problem.residual(r)
            if not np.isfinite(res): break
            since += 1
            if res < best_res:
                best, best_res = r, res
            if best_res < 0.5 * ref:
                since, ref = 0, best_res
            if since >= patience: break
    return best, best_res, it
