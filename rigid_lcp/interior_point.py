"""Coulomb friction by a primal-dual interior point, with or without its non-convex term.

Forces and velocities of a contact are scaled into Lorentz cones, which are their own duals:

    x = (mu r_N, r_T),   s = (u_N / mu + |u_T|, u_T),   x_N >= |x_T|,  s_N >= |s_T|,  x.s = 0

The path ``x o s = sigma e`` (Jordan product) leads to ``r_T = -mu r_N u_T / (u_N / mu + |u_T|)``,
``r_N u_N > 0``: friction that is viscous far from the answer, Coulomb's at its end.  One Newton
step, scaled after Nesterov and Todd (``H`` maps x to s), is a system ``(W + C) dr = b`` with

    C = U H X,  X = diag(mu, 1, 1),  U = d(u)/d(s) = [[mu, -mu s_T / |s_T|], [0, 1]].

Without the term |u_T| (``convex``) U is X and the problem is the convex one of Tasora and
Anitescu (CMAME 200 (2011) 439); then C is symmetric and the method can hardly fail, and its
answer is right where nothing slides.  The term itself makes it Coulomb's law; |s_T| is smoothed
by ``sqrt(s_T^2 + eps^2) - eps`` with eps falling with sigma.  Predictor and corrector: Mehrotra;
cones: Vandenberghe, The CVXOPT linear and quadratic cone program solvers (2010).

Where there is no friction the cone is a half line and r_T stays zero.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rigid_lcp.body_factorisation import Factorisation, SingularSystem, factorisation
from rigid_lcp.friction_problem import FrictionProblem, FrictionSolution, friction_solution

Floats = NDArray[np.float64]

ITERATIONS = 60
STEP_TO_BOUNDARY = 0.99


@njit(cache=True)
def determinant(x):
    return max((x[0] - np.sqrt(np.sum(x[1:] ** 2))) * (x[0] + np.sqrt(np.sum(x[1:] ** 2))), 1e-30 * x[0] ** 2)

@njit(cache=True)
def scale_contacts(x: Floats, s: Floats) -> tuple[Floats, Floats, Floats]:
    """Nesterov-Todd scaling of every contact: eta (nc,), point w (nc, dim), lambda (nc, dim)."""
    nc, dim = x.shape
    eta = np.empty(nc)
    point = np.empty((nc, dim))
    scaled = np.empty((nc, dim))
    for c in range(nc):
        dx = np.sqrt(determinant(x[c]))
        ds = np.sqrt(determinant(s[c]))
        eta[c] = np.sqrt(ds / dx)
        inner = 0.0
        for k in range(dim):
            inner += x[c, k] * s[c, k] / (dx * ds)
        gamma = np.sqrt(0.5 * (1.0 + inner))
        point[c, 0] = (s[c, 0] / ds + x[c, 0] / dx) / (2 * gamma)
        for k in range(1, dim):
            point[c, k] = (s[c, k] / ds - x[c, k] / dx) / (2 * gamma)
    scaled = scale(eta, point, x)
    return eta, point, scaled


@njit(cache=True)
def scale(eta: Floats, point: Floats, z: Floats) -> Floats:
    """``W_c z``: eta (2 v v^T - J) z with v = (w + e) / sqrt(2 (w_0 + 1))."""
    out = np.empty_like(z)
    nc, dim = z.shape
    for c in range(nc):
        inner = (point[c, 0] + 1.0) * z[c, 0]
        for k in range(1, dim):
            inner += point[c, k] * z[c, k]
        inner /= point[c, 0] + 1.0
        out[c, 0] = eta[c] * (inner * (point[c, 0] + 1.0) - z[c, 0])
        for k in range(1, dim):
            out[c, k] = eta[c] * (inner * point[c, k] + z[c, k])
    return out


@njit(cache=True)
def unscale(eta: Floats, point: Floats, z: Floats) -> Floats:
    out = np.empty_like(z)
    nc, dim = z.shape
    for c in range(nc):
        inner = (point[c, 0] + 1.0) * z[c, 0]
        for k in range(1, dim):
            inner -= point[c, k] * z[c, k]
        inner /= point[c, 0] + 1.0
        out[c, 0] = (inner * (point[c, 0] + 1.0) - z[c, 0]) / eta[c]
        for k in range(1, dim):
            out[c, k] = (-inner * point[c, k] + z[c, k]) / eta[c]
    return out


@njit(cache=True)
def jordan_product(a, b):
    out = np.empty_like(a)
    for c in range(a.shape[0]):
        inner = a[c, 0] * b[c, 0]
        for k in range(1, a.shape[1]):
            inner += a[c, k] * b[c, k]
            out[c, k] = a[c, 0] * b[c, k] + b[c, 0] * a[c, k]
        out[c, 0] = inner
    return out


@njit(cache=True)
def jordan_divide(a, b):
    """x with a o x = b"""
    out = np.empty_like(a)
    for c in range(a.shape[0]):
        inner = 0.0
        for k in range(1, a.shape[1]):
            inner += a[c, k] * b[c, k]
        det = determinant(a[c])
        out[c, 0] = (a[c, 0] * b[c, 0] - inner) / det
        for k in range(1, a.shape[1]):
            out[c, k] = (b[c, k] - out[c, 0] * a[c, k]) / a[c, 0]
    return out


@njit(cache=True)
def step_to_boundary(x, dx):
    """Greatest step t with x + t dx in every cone."""
    step = 1e30
    for c in range(x.shape[0]):
        a = dx[c, 0] ** 2
        b = x[c, 0] * dx[c, 0]
        cc = determinant(x[c])
        for k in range(1, x.shape[1]):
            a -= dx[c, k] ** 2
            b -= x[c, k] * dx[c, k]
        # cc + 2 b t + a t^2 = 0, smallest positive root
        disc = b * b - a * cc
        if dx[c, 0] < 0:
            step = min(step, -x[c, 0] / dx[c, 0])
        if disc >= 0:
            root = np.sqrt(disc)
            # stable: roots cc/(-b + root), cc/(-b - root)
            d1 = -b + root
            d2 = -b - root
            if d1 > 0:
                t = cc / d1
                if t > 0:
                    step = min(step, t)
            if d2 > 0:
                t = cc / d2
                if t > 0:
                    step = min(step, t)
    return step


@njit(cache=True)
def coulomb_velocity(s, mu, smooth, share):
    out = s.copy()
    for c in range(s.shape[0]):
        t2 = np.sum(s[c, 1:] ** 2)
        out[c, 0] = mu[c] * (s[c, 0] - share * (t2 / (np.sqrt(t2 + smooth[c] ** 2) + smooth[c])))
    return out


@njit(cache=True)
def coulomb_derivative(s, mu, smooth, share):
    nc, dim = s.shape
    out = np.zeros((nc, dim, dim))
    for c in range(nc):
        t = np.sqrt(np.sum(s[c, 1:] ** 2) + smooth[c] ** 2)
        out[c, 0, 0] = mu[c]
        for k in range(1, dim):
            out[c, k, k] = 1.0
            out[c, 0, k] = -share * mu[c] * s[c, k] / t
    return out

@njit(cache=True)
def local_blocks(derivative, eta, point, mu):
    """C = U H X,  H = eta^2 (2 w w^T - J)"""
    nc, dim = point.shape
    out = np.empty((nc, dim, dim))
    h = np.empty((dim, dim))
    for c in range(nc):
        for i in range(dim):
            for j in range(dim):
                h[i, j] = 2 * point[c, i] * point[c, j]
            h[i, i] += -1.0 if i == 0 else 1.0
        h *= eta[c] ** 2
        h[:, 0] *= mu[c]
        out[c] = derivative[c] @ h
    return out

from rigid_lcp.body_factorisation import multiply_blocks
def interior_point(problem, start, tolerance, *, share=1.0, iterations=ITERATIONS, solver=None, verbose=False, kappa=1.0, floor=1e-12, guard=0, wl=1):
    nc, dim = problem.contacts, problem.dim
    mu = problem.friction
    solver = solver or factorisation(problem)
    q = problem.offset.reshape(nc, dim)
    rho = problem.rho
    speed = np.sqrt(np.mean(q**2) )
    X = np.ones((nc, dim)); X[:, 0] = mu
    I = np.broadcast_to(np.eye(dim), (nc, dim, dim)).copy()
    e = np.zeros((nc, dim)); e[:, 0] = 1
    x = e * rho * speed; s = e * speed
    r = (x / X).ravel()
    best, best_res = None, np.inf
    for it in range(iterations):
        u = problem.velocity(r).reshape(nc, dim)
        gap = np.sum(x * s) / nc
        eps = np.full(nc, kappa * np.sqrt(gap / rho))
        lack = u - coulomb_velocity(s, mu, eps, share)
        res = problem.residual(r)
        if verbose:
            print(it, f"gap {gap/(rho*speed**2):.2e} lack {np.linalg.norm(lack)/np.linalg.norm(q):.2e} res {res:.2e}", end=' ')
        if res < best_res: best, best_res = r.copy(), res
        if res < floor: break
        eta, point, lam = scale_contacts(x, s)
        U = coulomb_derivative(s, mu, eps, share)
        C = local_blocks(U, eta, point, mu)
        try:
            solve = solver.factor(C, I)
        except SingularSystem:
            break
        def direction(target, part_of_lack=1.0):
            part = scale(eta, point, jordan_divide(lam, target))
            b = multiply_blocks(U, part.ravel()) - part_of_lack * lack.ravel()
            dr = solve(b)
            dx = dr.reshape(nc, dim) * X
            ds = part - scale(eta, point, scale(eta, point, dx))
            return dx, ds
        ll = jordan_product(lam, lam)
        dx, ds = direction(-ll)
        a = min(1.0, step_to_boundary(x, dx), step_to_boundary(s, ds))
        mu_aff = np.sum((x + a * dx) * (s + a * ds)) / nc
        sigma = min(1.0, max(mu_aff / gap, 0)) ** 3
        sigma = max(sigma, 1e-6)
        if guard and a < 0.1: sigma = 1.0
        corr = (1.0 if not guard else a if guard==1 else a*a) * jordan_product(scale(eta, point, dx), unscale(eta, point, ds))
        dx, ds = direction(sigma * gap * e - ll - corr, 1 - sigma if wl else 1.0)
        ax, as_ = step_to_boundary(x, dx), step_to_boundary(s, ds)
        a = min(1.0, STEP_TO_BOUNDARY * min(ax, as_))
        if verbose: print(f"sigma {sigma:.1e} step {a:.3f}")
        x = x + a * dx; s = s + a * ds
        r = (x / X).ravel()
        if a < 1e-8: break
    return best, best_res, it
