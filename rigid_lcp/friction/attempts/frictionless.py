"""Contacts without friction: the linear complementarity problem of eqs 18, 19 (and 35, 36).

    a = b + A f,   a >= 0,   f >= 0,   a f = 0

with A symmetric and positive semidefinite: the conditions of least ``f A f / 2 + b f`` over f >= 0
(Gauss's principle).  a is unique then, f only up to self-stress.

Sweeps of projected Gauss-Seidel with momentum say which contacts carry, nearly all of them right.
The rest is block principal pivoting (Judice and Pires, Comput. Oper. Res. 21 (1994) 587): one
factorisation gives the forces of those that carry, all contacts that violate a condition change
sides at once, and where that does not make them fewer for a while, only the last one does, which
ends for every positive definite A (Murty).  Redundant contacts make A singular; a shift makes it
regular, and proximal steps with the same factor take it out.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import reverse_cuthill_mckee
from scipy.sparse.linalg import splu

from rigid_lcp.arrays import Bools, Floats
from rigid_lcp.errors import ProblemError
from rigid_lcp.friction.linear import NO_LIMIT, Clock
from rigid_lcp.friction.problem import FrictionProblem, FrictionSolution, judge_forces
from rigid_lcp.friction.sweeps import build_band, find_bandwidth, multiply_normals, sweep_normals
from rigid_lcp.sparse import split_csr

Indices = NDArray[np.int32]
Solve = Callable[[Floats], Floats]


@dataclass(frozen=True)
class FrictionlessNumbers:
    """Sweeps, exchanges of sides and proximal steps."""

    shift: float = 1e-8  # of the diagonal, over its mean [-]: a small one is soon taken out again,
    shift_steps: int = 20  # in so many proximal steps at most
    sweeps: int = 400  # most sweeps before the first exchange;
    settled: tuple[int, int] = (20, 1)
    """they end when in so many of them so few contacts changed sides."""
    sweeps_between: int = 100  # sweeps instead of an exchange,
    smoothed: int = 2  # as long as more contacts than that are wrong,
    smoothings: int = 3  # so many times; with self-stress they mislead,
    haste: int = 15  # so that the exchanges begin again without them where so many do not end
    exchanges: int = 60  # exchanges of a proximal step at most
    patience: int = 5
    """Exchanges at once that may fail to make violations fewer, before one at a time."""
    sign_margin: float = 1e-13
    """Size of an acceleration or force that counts as zero, over the greatest [-]."""
    band_most: float = 1.3e8  # banded Cholesky up to about so many multiplications,
    band_overhead: int = 20
    """the band counted so much wider: half of what sparse LU takes in the plane, as much as it
    where 1,700 spheres touch."""


NUMBERS = FrictionlessNumbers()


def solve_frictionless(
    problem: FrictionProblem, start: Floats | None = None, tolerance: float = 1e-12, *,
    clock: Clock = NO_LIMIT,
) -> FrictionSolution:  # fmt: skip
    """Solve a friction problem without friction (mu = 0), in 2D or 3D, in the time of ``clock``.

    ``start`` r (nc * dim,): forces near the solution.  ``work``: ``sweeps``; ``exchanges`` of
    sides, each with one factorisation; ``proximal`` steps.  Not for a W that is not symmetric or
    has a negative diagonal: use `rigid_lcp.friction.methods.pivoting`.  Raises `ProblemError` where
    a coefficient of friction is not zero.
    """
    if problem.friction.any():
        raise ProblemError(
            f"friction is {problem.friction.max():g}, and this method knows none", where="mu",
            remedy="set mu to zero, or use `solve_friction`",
        )  # fmt: skip
    dim, nc = problem.dim, problem.contacts
    if nc == 0:
        return judge_forces(problem, np.zeros(0), tolerance, "frictionless")
    a, b = build_normal_matrix(problem), np.ascontiguousarray(problem.offset[::dim])
    first = np.zeros(nc) if start is None else np.maximum(start[::dim], 0.0)
    sweeps = sweep_normals(*split_csr(a), b, first, NUMBERS.sweeps, *NUMBERS.settled)
    work = {"sweeps": float(sweeps), "exchanges": 0.0, "proximal": 0.0}
    order = reverse_cuthill_mckee(a, symmetric_mode=True)
    best, least = np.zeros(nc), np.inf
    for smoothings, limit in ((NUMBERS.smoothings, NUMBERS.haste), (0, NUMBERS.exchanges)):
        f, carries = first.copy(), first > 0.0
        for step in range(NUMBERS.shift_steps):
            before = work["exchanges"]
            f, sharper = pivot_principally(
                a, b, order, f, carries, work, limit, smoothings if step == 0 else 0, clock
            )
            better = False
            for candidate in (sharper, f):
                force = np.maximum(candidate, 0.0)
                residual = find_normal_residual(a, b, force, problem.rho)
                if residual < least:
                    best, least, better = force, residual, True
                if least <= tolerance:
                    return _make_solution(problem, best, tolerance, work)
            if (step > 4 and not better) or work["exchanges"] - before >= limit or clock.late:
                break
            work["proximal"] += 1
    return _make_solution(problem, best, tolerance, work)


def _make_solution(
    problem: FrictionProblem, normal: Floats, tolerance: float, work: dict[str, float]
) -> FrictionSolution:
    force = np.zeros(len(problem.offset))
    force[:: problem.dim] = normal
    return judge_forces(problem, force, tolerance, "frictionless", work)


def pivot_principally(
    a_matrix: sp.csr_array, b: Floats, order: Indices, before: Floats, carries: Bools,
    work: dict[str, float], limit: int, smoothings: int, clock: Clock,
) -> tuple[Floats, Floats]:  # fmt: skip
    """One proximal step: forces of ``a = b + A f + shift (f - before)`` that obey eq. 19.

    ``order``: of the contacts, for a small bandwidth.  ``carries`` holds who carries at first, and
    in the end (changed in place).  The second answer is a few steps further on, with the same
    factor and no change of sides.
    """
    unit = float(a_matrix.diagonal().mean()) or 1.0
    shift = NUMBERS.shift * unit
    offset = b - shift * before
    fewest, patience = len(b) + 1, NUMBERS.patience
    smoothed = False
    scale = float(np.abs(b).max()) or 1.0
    f = np.zeros(len(b))
    while True:
        work["exchanges"] += 1
        limit -= 1
        f[:] = 0.0
        inside = order[carries[order]]
        solve = build_face_solver(a_matrix, inside, shift)
        f[inside] = solve(-offset[inside])
        a = offset + a_matrix @ f + shift * f
        margin = NUMBERS.sign_margin * (scale + unit * float(np.abs(f).max()))
        wrong = np.where(carries, f < -margin / unit, a < -margin)
        count = int(wrong.sum())
        if count == 0 or limit <= 0 or clock.late:
            break
        if smoothed and count > 0.7 * fewest:
            smoothings = 0
        if count < fewest:
            fewest, patience = count, NUMBERS.patience
        else:
            patience -= 1
        smoothed = count > NUMBERS.smoothed and patience == NUMBERS.patience and smoothings > 0
        if smoothed:
            smoothings -= 1
            f = np.maximum(f, 0.0)
            between = NUMBERS.sweeps_between
            sweep_normals(*split_csr(a_matrix), b, f, between, between, 0)
            carries[:] = f > 0.0
        else:
            if patience < 0:
                wrong[: int(np.flatnonzero(wrong)[-1])] = False
            carries ^= wrong
    sharper = f.copy()
    for _ in range(5 if len(inside) else 0):
        change = solve((b + a_matrix @ sharper)[inside])
        sharper[inside] -= change
        if np.abs(change).max() <= 1e-14 * np.abs(sharper).max():
            break
    return f, sharper


def build_normal_matrix(problem: FrictionProblem) -> sp.csr_array:
    """A: the normal rows and columns of W, (nc, nc), without W where its factors are known."""
    dim, nc, bodies = problem.dim, problem.contacts, problem.bodies
    if problem.matrix is None and bodies is not None:
        normal = bodies.jacobian[::dim]
        start, index, value = multiply_normals(
            *split_csr(normal), *split_csr(bodies.inverse_mass), normal.shape[1]
        )
        return sp.csr_array((value, index, start), (nc, nc))
    return sp.csr_array(problem.delassus[::dim][:, ::dim])


def find_normal_residual(a_matrix: sp.csr_array, b: Floats, f: Floats, rho: float) -> float:
    """The residual of `rigid_lcp.friction.problem.cones` without friction: ``|min(f, rho a)| /
    |f|``."""
    a = rho * (b + a_matrix @ f)
    error = float(np.linalg.norm(np.minimum(f, a)))
    return error / (float(np.linalg.norm(f)) or float(np.linalg.norm(a))) if error > 0.0 else 0.0


def build_face_solver(a_matrix: sp.csr_array, inside: Indices, shift: float) -> Solve:
    """Solve with ``A + shift`` of the contacts ``inside``, in an order of small bandwidth.

    Banded Cholesky where that costs little; else, or where A is not symmetric, sparse LU without
    pivoting.
    """
    if len(inside) == 0:
        return lambda right: right
    rows = split_csr(a_matrix)
    width = find_bandwidth(rows[0], rows[1], inside)
    if len(inside) * (width + NUMBERS.band_overhead) ** 2 <= NUMBERS.band_most:
        band, symmetric = build_band(*rows, inside, shift, width)
        if symmetric:
            cholesky, info = scipy.linalg.lapack.dpbtrf(band.T, lower=1, overwrite_ab=1)
            if info == 0:
                return lambda right: scipy.linalg.lapack.dpbtrs(cholesky, right, lower=1)[0]
    face = sp.csr_array(a_matrix[inside][:, inside] + shift * sp.eye_array(len(inside)))
    factor = splu(
        face.T, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, panel_size=1, relax=4,
        options={"SymmetricMode": True},
    )  # fmt: skip
    return lambda right: factor.solve(right, "T")  # its rows were taken for columns
