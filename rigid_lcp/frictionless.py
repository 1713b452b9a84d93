"""Contacts without friction: the linear complementarity problem of eqs 18, 19 (and 35, 36).

    a = b + A f,   a >= 0,   f >= 0,   a f = 0

with A symmetric and positive semidefinite: the conditions of least ``f A f / 2 + b f`` over f >= 0
(Gauss's principle).  a is unique then, f only up to self-stress.

Which forces are zero is found by block principal pivoting (Judice and Pires, Comput. Oper. Res. 21
(1994) 587): all contacts that violate a condition change sides at once, and where that does not
make them fewer for a while, only the last one does, which ends for every positive definite A
(Murty).  A few sweeps of Gauss-Seidel give the sides to begin with.  Redundant contacts make A
singular; a shift makes it regular, and proximal steps with the same factor take it out.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp
from numba import njit
from numpy.typing import ArrayLike, NDArray
from scipy.sparse.linalg import splu

from rigid_lcp.errors import ProblemError
from rigid_lcp.friction_problem import (
    FrictionProblem,
    FrictionSolution,
    friction_problem,
    friction_solution,
)

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

SHIFT = 1e-8
"""Relative shift of the diagonal: a small one is soon taken out again."""
SWEEPS, SWEEPS_BETWEEN = 100, 20
"""Sweeps before the first exchange, and instead of one"""
SMOOTHED, SMOOTHINGS, HASTE = 5, 3, 15
"""as long as more contacts than that are wrong, so many times; with self-stress they mislead, so
that the exchanges begin again without them where so many do not end."""
PROXIMAL_STEPS = 20
ROUND_OFF = 1e-13
"""Relative size of an acceleration or force that counts as zero."""
PATIENCE = 5
"""Exchanges at once that may fail to make violations fewer, before one at a time."""


def lcp(
    matrix: Any, offset: ArrayLike, start: Floats | None = None, tolerance: float = 1e-12
) -> FrictionSolution:
    """Solve ``a = b + A f >= 0``, ``f >= 0``, ``a f = 0`` (eq. 19) for symmetric semidefinite A.

    ``matrix`` A (nc, nc), scipy sparse or dense; ``offset`` b (nc,); ``start`` f (nc,).
    The solution has one number a contact in ``r`` (f) and ``u`` (a).
    Raises `ProblemError` if A or b are malformed.
    """
    b = np.asarray(offset, dtype=float).ravel()
    a = sp.csr_array(matrix)
    if a.shape != (len(b), len(b)):
        raise ProblemError(
            f"A is {a.shape[0]} x {a.shape[1]} and b has {len(b)} numbers", where="A",
            remedy="give a square A with a row for every number of b",
        )  # fmt: skip
    zeros = np.zeros(len(b))
    place = np.repeat(2 * np.arange(len(b)), 1)
    wide = sp.csr_array(sp.kron(a, sp.csr_array([[1.0, 0.0], [0.0, 0.0]])))
    problem = friction_problem(wide, np.column_stack([b, zeros]).ravel(), 0.0, 2)
    started = None if start is None else np.column_stack([start, zeros]).ravel()
    found = frictionless(problem, started, tolerance)
    return FrictionSolution(
        found.r[place], found.u[place], found.residual, found.status, found.method, found.work,
        found.message,
    )  # fmt: skip


def frictionless(
    problem: FrictionProblem,
    start: Floats | None = None,
    tolerance: float = 1e-12,
    *,
    max_exchanges: int = 60,
) -> FrictionSolution:
    """Solve a friction problem without friction (mu = 0), in 2D or 3D.

    ``start`` r (nc * dim,): its normal forces say which contacts carry.  ``work``: ``exchanges``
    of sides, each with one factorisation; ``proximal`` steps.
    Not for a W that is not symmetric or has a negative diagonal: use `rigid_lcp.pivoting`.
    Raises `ProblemError` where a coefficient of friction is not zero.
    """
    if problem.friction.any():
        raise ProblemError(
            f"friction is {problem.friction.max():g}, and this method knows none", where="mu",
            remedy="set mu to zero, or use `solve_friction`",
        )  # fmt: skip
    dim, nc = problem.dim, problem.contacts
    if nc == 0:
        return friction_solution(problem, np.zeros(0), tolerance, "frictionless")
    w = problem.delassus
    a = sp.csr_array(w[::dim][:, ::dim]) if dim > 1 else w
    b = problem.offset[::dim]
    first = np.zeros(nc) if start is None else np.maximum(start[::dim], 0.0)
    normal_sweeps(a.indptr, a.indices, a.data, b, first, SWEEPS)
    work = {"exchanges": 0.0, "proximal": 0.0}
    mean = float(a.diagonal().mean()) or 1.0
    shifted = sp.csc_array(a + SHIFT * mean * sp.eye_array(nc))
    best, least = np.zeros(nc * dim), np.inf
    for smoothings, limit in ((SMOOTHINGS, HASTE), (0, max_exchanges)):
        f, carries = first.copy(), first > 0.0
        for step in range(PROXIMAL_STEPS):
            before = work["exchanges"]
            f, sharper = principal_pivots(
                shifted, a, b, f, carries, work, limit, smoothings if step == 0 else 0
            )
            better = False
            for candidate in (sharper, f):
                force = np.zeros(nc * dim)
                force[::dim] = np.maximum(candidate, 0.0)
                residual = problem.residual(force)
                if residual < least:
                    best, least, better = force, residual, True
                if least <= tolerance:
                    return friction_solution(problem, best, tolerance, "frictionless", work)
            if (step > 4 and not better) or work["exchanges"] - before >= limit:
                break
            work["proximal"] += 1
    return friction_solution(problem, best, tolerance, "frictionless", work)


def principal_pivots(
    shifted: sp.csc_array, a_matrix: sp.csr_array, b: Floats, before: Floats, carries: Bools,
    work: dict[str, float], limit: int, smoothings: int,
) -> tuple[Floats, Floats]:  # fmt: skip
    """One proximal step: forces of ``a = b + A f + shift (f - before)`` that obey eq. 19.

    ``carries`` holds who carries at first, and in the end (changed in place).  The second
    answer is a few steps further on, with the same factor and no change of sides.
    """
    offset = b + a_matrix @ before - shifted @ before
    fewest, patience = len(b) + 1, PATIENCE
    smoothed = False
    scale = float(np.abs(b).max()) or 1.0
    unit = float(shifted.diagonal().mean()) or 1.0
    f = np.zeros(len(b))
    while True:
        work["exchanges"] += 1
        limit -= 1
        f[:] = 0.0
        inside = np.flatnonzero(carries)
        factor: Any = factor_of(shifted[inside][:, inside]) if len(inside) else None
        if factor is not None:
            f[inside] = factor.solve(-offset[inside])
        a = offset + shifted @ f
        size = scale + unit * float(np.abs(f).max())
        wrong = np.where(carries, f < -ROUND_OFF * size / unit, a < -ROUND_OFF * size)
        count = int(wrong.sum())
        if count == 0 or limit <= 0:
            break
        if smoothed and count > 0.7 * fewest:
            smoothings = 0
        if count < fewest:
            fewest, patience = count, PATIENCE
        else:
            patience -= 1
        smoothed = count > SMOOTHED and patience == PATIENCE and smoothings > 0
        if smoothed:
            smoothings -= 1
            f = np.maximum(f, 0.0)
            normal_sweeps(shifted.indptr, shifted.indices, shifted.data, offset, f, SWEEPS_BETWEEN)
            carries[:] = f > 0.0
        else:
            if patience < 0:
                wrong[: int(np.flatnonzero(wrong)[-1])] = False
            carries ^= wrong
    sharper = f.copy()
    for _ in range(5 if factor is not None else 0):
        change = factor.solve((b + a_matrix @ sharper)[inside])
        sharper[inside] -= change
        if np.abs(change).max() <= 1e-14 * np.abs(sharper).max():
            break
    return f, sharper


def factor_of(matrix: sp.csc_array) -> Any:
    """Sparse factor of a symmetric positive definite matrix: no pivoting, symmetric order."""
    return splu(
        matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, panel_size=1, relax=4,
        options={"SymmetricMode": True},
    )  # fmt: skip


@njit(cache=True)
def normal_sweeps(
    start: NDArray[np.int32], index: NDArray[np.int32], value: Floats, b: Floats, f: Floats,
    sweeps: int,
) -> None:  # fmt: skip
    """Projected Gauss-Seidel on normal forces: ``f = max(f - a / A_cc, 0)``, there and back.

    A by rows, or as it is symmetric by columns.
    """
    for sweep in range(sweeps):
        for k in range(len(b)):
            c = k if sweep % 2 == 0 else len(b) - 1 - k
            a, diagonal = b[c], 0.0
            for j in range(start[c], start[c + 1]):
                a += value[j] * f[index[j]]
                if index[j] == c:
                    diagonal = value[j]
            if diagonal > 0.0:
                f[c] = max(f[c] - a / diagonal, 0.0)
