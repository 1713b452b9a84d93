"""Semismooth Newton steps in contact space: what a user writes in an afternoon on scipy.

The rival of our own solver, on purpose plain: Newton's method on the natural map
``F(r) = r - P_K(r - rho (u + mu |u_T| n))`` with its derivative by blocks, W scaled and shifted by
1e-9, SuperLU, and steps halved until |F| falls, taken whole where no half does.  Nothing of
`rigid_lcp` but the problem is used.
"""

from __future__ import annotations

import time

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

from rigid_lcp.friction.problem.definition import FrictionProblem

Floats = NDArray[np.float64]
SHIFT = 1e-9
"""Added to the scaled diagonal of W in the derivative only, as W is singular."""
STEPS, HALVINGS = 60, 12


def polish_forces(
    problem: FrictionProblem, force: Floats, tolerance: float, budget_s: float
) -> tuple[Floats, int]:
    """Better a point r (nc * dim,) until its residual is small, steps stall, or time is up.

    Returns the best point and the number of steps.
    """
    dim = problem.dim
    w = problem.delassus
    rho = np.repeat(1.0 / w.diagonal().reshape(-1, dim).mean(axis=1), dim)
    shifted = w + sp.diags_array(SHIFT / rho)
    end = time.thread_time() + budget_s
    r = best = force.copy()
    least = np.inf
    value, derivative = _evaluate_map(problem, r, rho)
    for step in range(STEPS):
        error = problem.residual(r)
        if error < least:
            best, least = r, error
        if least <= tolerance or time.thread_time() > end:
            return best, step
        projection, dual = derivative
        blocks = projection @ dual
        matrix = sp.eye_array(len(r)) - projection + sp.diags_array(rho) @ blocks @ shifted
        try:
            move = splu(sp.csc_array(matrix)).solve(-value)
        except RuntimeError:  # exactly singular
            return best, step
        size = np.linalg.norm(value / np.sqrt(rho))
        share = 1.0
        for _ in range(HALVINGS):
            trial = r + share * move
            new, new_derivative = _evaluate_map(problem, trial, rho)
            if np.linalg.norm(new / np.sqrt(rho)) < (1 - 1e-4 * share) * size:
                break
            share /= 2
        else:
            trial = r + move
            new, new_derivative = _evaluate_map(problem, trial, rho)
        r, value, derivative = trial, new, new_derivative
    return best, STEPS


def _evaluate_map(
    problem: FrictionProblem, r: Floats, rho: Floats
) -> tuple[Floats, tuple[sp.csr_array, sp.csr_array]]:
    """F and the block diagonal derivatives of P_K and of ``u + mu |u_T| n``."""
    dim, mu = problem.dim, problem.friction
    u = (problem.delassus @ r + problem.offset).reshape(-1, dim)
    slip = np.linalg.norm(u[:, 1:], axis=1)
    dual = np.tile(np.eye(dim), (len(mu), 1, 1))
    dual[:, 0, 1:] += mu[:, None] * u[:, 1:] / np.where(slip > 0, slip, 1.0)[:, None]
    s = u.copy()
    s[:, 0] += mu * slip
    x = r.reshape(-1, dim) - rho.reshape(-1, dim) * s
    n, t = x[:, 0], np.linalg.norm(x[:, 1:], axis=1)
    inside, outside = t <= mu * n, mu * t <= -n
    projected = np.where(inside[:, None], x, 0.0)
    slope = np.zeros((len(mu), dim, dim))
    slope[inside] = np.eye(dim)
    edge = ~inside & ~outside
    m, e = mu[edge], x[edge, 1:] / t[edge, None]
    ray = np.concatenate([np.ones((len(m), 1)), m[:, None] * e], axis=1)
    length = (n[edge] + m * t[edge]) / (1 + m**2)
    projected[edge] = length[:, None] * ray
    along = np.concatenate([np.ones((len(m), 1)), m[:, None] * e], axis=1) / (1 + m**2)[:, None]
    block = ray[:, :, None] * along[:, None, :]
    turn = (m * length / t[edge])[:, None, None]
    block[:, 1:, 1:] += turn * (np.eye(dim - 1) - e[:, :, None] * e[:, None, :])
    slope[edge] = block
    return r - projected.ravel(), (_build_diagonal(slope), _build_diagonal(dual))


def _build_diagonal(blocks: Floats) -> sp.csr_array:
    count = len(blocks)
    return sp.csr_array(sp.bsr_array((blocks, np.arange(count), np.arange(count + 1))))
