"""A second judge of forces, apart from the solver's own: plain NumPy in extended precision.

The natural residual of `rigid_lcp.friction.problem.cones`, from W or its factors alone: nothing of
the solver's kernels is used, and round-off of the sums is 1e-19 where long double has 80 bits.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from rigid_lcp.friction.problem.definition import FrictionProblem

Floats = NDArray[np.float64]
Extended = NDArray[np.longdouble]


def measure_residual(problem: FrictionProblem, force: Floats) -> tuple[float, float]:
    """``|r - P_K(r - rho (u + mu |u_T| n))|`` over |r|, and over what it is without forces.

    ``force`` r (nc * dim,).  Over ``rho |u|`` where all forces are zero.  The second number tells
    forces so large that whatever is left seems small beside them: it is 1 for no forces at all.
    Both are nan where a force is no number.
    """
    if not np.isfinite(force).all():
        return float("nan"), float("nan")
    shape = (problem.contacts, problem.dim)
    mu, rho = problem.friction.astype(np.longdouble), _find_rho(problem)
    r = force.astype(np.longdouble)
    u = _find_velocity(problem, r).reshape(shape)
    left = _norm(_evaluate_map(r.reshape(shape), u, mu, rho))
    still = problem.offset.astype(np.longdouble).reshape(shape)
    begun = _norm(_evaluate_map(np.zeros_like(still), still, mu, rho))
    size = _norm(r) or rho * _norm(u)
    return float(left / size) if size else 0.0, float(left / begun) if begun else float(left > 0)


def _find_velocity(problem: FrictionProblem, force: Extended) -> Extended:
    """``W r + q``, by the factors of W where they are known."""
    q = problem.offset.astype(np.longdouble)
    if problem.bodies is None:
        return _multiply(problem.delassus, force) + q
    jacobian = problem.bodies.jacobian
    spread = _multiply(sp.csr_array(jacobian.T), force)
    return _multiply(jacobian, _multiply(problem.bodies.inverse_mass, spread)) + q


def _multiply(matrix: Any, vector: Extended) -> Extended:
    entries = sp.coo_array(matrix)
    made = np.zeros(matrix.shape[0], dtype=np.longdouble)
    np.add.at(made, entries.row, entries.data.astype(np.longdouble) * vector[entries.col])
    return made


def _find_rho(problem: FrictionProblem) -> np.longdouble:
    """``1 / mean(diag W)``, 1 where W has no diagonal."""
    if problem.bodies is None:
        diagonal = problem.delassus.diagonal()
    else:
        jacobian = problem.bodies.jacobian
        diagonal = (jacobian @ problem.bodies.inverse_mass).multiply(jacobian).sum(axis=1)
    mean = np.longdouble(np.mean(diagonal)) if problem.contacts else np.longdouble(1)
    return 1 / mean if mean > 0 else np.longdouble(1)


def _evaluate_map(r: Extended, u: Extended, mu: Extended, rho: np.longdouble) -> Extended:
    """Contact by contact: the nearest point of the cone is the point, its apex, or on its side."""
    x = r - rho * u
    x[:, 0] -= rho * mu * np.sqrt((u[:, 1:] ** 2).sum(axis=1))
    normal, across = x[:, 0], np.sqrt((x[:, 1:] ** 2).sum(axis=1))
    inside, apex = across <= mu * normal, mu * across <= -normal
    length = (normal + mu * across) / (1 + mu**2)
    share = mu * length / np.where(across > 0, across, 1)
    side = np.concatenate([length[:, None], share[:, None] * x[:, 1:]], axis=1)
    nearest = np.where(inside[:, None], x, np.where(apex[:, None], 0, side))
    return np.asarray(r - nearest)


def _norm(values: Extended) -> np.longdouble:
    return np.sqrt((values.ravel() ** 2).sum())
