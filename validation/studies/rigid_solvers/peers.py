"""Other people's solvers of the same friction problem: W, q and mu in, r and its cost out.

Every peer starts from zero, is asked for a tolerance of its own error measure, keeps its other
settings, and is timed in processor seconds of the solve alone; what turns the problem into its
types is not timed.

``Siconos`` (Acary et al.)  its solvers that are worth a try, each in a process of its own.
``Clarabel``                convex cone programs, |u_T| frozen, again and again (Acary, Cadoux,
                            Lemarechal and Malick, ZAMM 91 (2011) 155), in body space if possible.
``Clarabel + Newton``       the same to 1e-8 without freezing again, then `newton.polish_forces`.
``OSQP``                    without friction, the linear complementarity problem, polished.
"""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from rigid_lcp.friction.problem.definition import FrictionProblem, make_problem
from validation.studies.rigid_solvers.newton import polish_forces

Floats = NDArray[np.float64]
SYSTEM_PYTHON = "/usr/bin/python3"
SICONOS = {
    2: ("2D_NSGS", "2D_CPG", "2D_LEMKE"),
    3: ("3D_NSGS", "3D_ADMM", "3D_NSN_AC", "3D_NSN_FB", "3D_PROX"),
}
"""Solvers by dimension; the others are slower or worse on all stored problems."""
SICONOS_MOST = {
    "2D_LEMKE": 300, "2D_NSGS": 500, "2D_CPG": 1000, "3D_NSN_AC": 500, "3D_NSN_FB": 500,
    "3D_PROX": 500,
}  # fmt: skip
"""Contacts above which a solver is not tried: dense matrices, or far behind the others there."""
SICONOS_SPARSE = 400
"""Contacts above which plane problems are also given to sparse solvers, as problems in space."""
ONE_THREAD = dict.fromkeys(
    ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)
FINEST = 1e-10
"""What Clarabel is asked for at the most: beyond, it stops with worse answers on singular W."""
OUTER = 50
"""Programs that Clarabel solves for one answer, at most."""


@dataclass(frozen=True)
class Answer:
    """What a solver made of a problem at one tolerance."""

    tolerance: float
    force: Floats
    """r (nc * dim,)."""
    cost_s: float
    claims: bool
    """The solver says that it has solved the problem."""


def is_installed(package: str) -> bool:
    """Whether a Python package of a peer is there."""
    try:
        import_module(package)
    except ImportError:
        return False
    return True


# --- Siconos ----------------------------------------------------------------------------------


def choose_solvers(problem: FrictionProblem) -> list[str]:
    """The solvers that are worth a try on a problem."""
    names = [*SICONOS[problem.dim]]
    if problem.dim == 2 and problem.contacts > SICONOS_SPARSE:
        names += ["3D_NSGS", "3D_ADMM"]
    return [name for name in names if problem.contacts <= SICONOS_MOST.get(name, 10**9)]


def lift_to_space(problem: FrictionProblem) -> FrictionProblem:
    """A plane problem as one in space: nothing pushes along t2, so its forces there are zero."""
    contacts = problem.contacts
    wide = np.arange(2 * contacts) // 2 * 3 + np.arange(2 * contacts) % 2
    w = problem.delassus.tocoo()
    across = np.arange(2, 3 * contacts, 3)
    entries = np.concatenate([w.data, np.full(contacts, 1.0 / problem.rho)])
    rows, columns = (np.concatenate([wide[each], across]) for each in (w.row, w.col))
    offset = np.zeros(3 * contacts)
    offset[wide] = problem.offset
    matrix = sp.csr_array((entries, (rows, columns)), (3 * contacts,) * 2)
    made: FrictionProblem = make_problem(matrix, offset, problem.friction, 3)
    return made


@cache
def has_siconos() -> bool:
    """Whether the system's Python has Siconos."""
    words = [SYSTEM_PYTHON, "-c", "import scipy, siconos.numerics"]
    try:
        return subprocess.run(words, capture_output=True).returncode == 0
    except OSError:
        return False


def solve_by_siconos(
    problem: FrictionProblem, solver: str, tolerance: float, budget_s: float
) -> list[Answer]:
    """All answers of a solver of Siconos, ``"3D_NSGS"``; none where it kills its process.

    A plane problem for a solver in space: see `lift_to_space`.
    """
    if problem.dim == 2 and solver.startswith("3D"):
        return [
            replace(answer, force=answer.force.reshape(-1, 3)[:, :2].ravel())
            for answer in solve_by_siconos(lift_to_space(problem), solver, tolerance, budget_s)
        ]
    with tempfile.TemporaryDirectory() as name:
        folder, w = Path(name), problem.delassus
        np.savez(
            folder / "problem.npz", dim=problem.dim, q=problem.offset, mu=problem.friction,
            data=w.data, indices=w.indices, indptr=w.indptr,
        )  # fmt: skip
        worker = Path(__file__).with_name("siconos_worker.py")
        subprocess.run(
            [SYSTEM_PYTHON, str(worker), name, solver, str(tolerance), str(budget_s)],
            capture_output=True, stdin=subprocess.DEVNULL,
            env={key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
            | ONE_THREAD,
        )  # fmt: skip
        path = folder / "results.json"
        results = json.loads(path.read_text()) if path.exists() else []
        return [
            Answer(tolerance, np.load(folder / f"force-{k}.npy"), run["cost_s"], run["claims"])
            for k, run in enumerate(results)
        ]


# --- convex programs --------------------------------------------------------------------------


Program = Callable[[Floats, float], Floats]


def solve_by_clarabel(
    problem: FrictionProblem, tolerance: float, budget_s: float, *, outer: int = OUTER
) -> Answer:
    """Coulomb's law by convex programs with ``mu |u_T|`` frozen, until the residual is small.

    Stops at the ``tolerance`` of the residual, after ``outer`` programs, after five that do not
    better the best answer, or out of time.  Each program is solved to a hundredth of the tolerance,
    between `FINEST` and 1e-8, W and q scaled to order one.
    """
    program = (build_by_bodies if problem.bodies is not None else build_by_contacts)(problem)
    frozen = np.zeros(problem.contacts)
    best, least, since, spent = np.zeros(len(problem.offset)), np.inf, 0, 0.0
    for _ in range(outer):
        start = time.thread_time()
        force = program(frozen, float(np.clip(0.01 * tolerance, FINEST, 1e-8)))
        spent += time.thread_time() - start
        error = problem.residual(force) if np.isfinite(force).all() else np.inf
        since = 0 if error < 0.9 * least else since + 1
        if error < least:
            best, least = force, error
        velocity = problem.velocity(force).reshape(problem.contacts, problem.dim)
        frozen = problem.friction * np.linalg.norm(velocity[:, 1:], axis=1)
        if error <= tolerance or not np.isfinite(frozen).all() or since == 5 or spent > budget_s:
            break
    return Answer(tolerance, best, spent, least <= tolerance)


def solve_by_hybrid(problem: FrictionProblem, tolerance: float, budget_s: float) -> Answer:
    """One convex program to 1e-8, then semismooth Newton steps on the natural map."""
    begun = solve_by_clarabel(problem, 1e-8, budget_s, outer=1)
    start = time.thread_time()
    force, _ = polish_forces(problem, begun.force, tolerance, budget_s - begun.cost_s)
    cost = begun.cost_s + time.thread_time() - start
    return Answer(tolerance, force, cost, problem.residual(force) <= tolerance)


def build_by_contacts(problem: FrictionProblem) -> Program:
    """``min r.W r/2 + (q + frozen n).r`` over r in K; W by its symmetric part."""
    library = import_module("clarabel")
    w = problem.delassus * problem.rho
    upper = sp.csc_matrix(sp.triu((w + w.T) / 2, format="csc"))
    cones: list[Any] = []
    scale = np.ones((problem.contacts, problem.dim))
    for contact, mu in enumerate(problem.friction):
        if mu > 0:
            cones.append(library.SecondOrderConeT(problem.dim))
            scale[contact, 0] = mu
        else:
            cones += [library.NonnegativeConeT(1), library.ZeroConeT(problem.dim - 1)]
    rows = sp.csc_matrix(sp.diags_array(-scale.ravel()))

    def solve(frozen: Floats, tolerance: float) -> Floats:
        linear = problem.offset.copy()
        linear[:: problem.dim] += frozen
        size = float(np.linalg.norm(linear)) or 1.0
        found = _solve(library, upper, linear / size, rows, np.zeros(len(linear)), cones, tolerance)
        return np.asarray(found.x) * size * problem.rho

    return solve


def build_by_bodies(problem: FrictionProblem) -> Program:
    """Its dual, ``min |y|^2/2`` with ``J L y + q + frozen n`` in K*, where ``M^-1 = L L^T``."""
    library = import_module("clarabel")
    bodies = problem.bodies
    assert bodies is not None
    scale = np.ones((problem.contacts, problem.dim))
    scale[:, 1:] = problem.friction[:, None]
    factor = factor_inverse_mass(bodies.inverse_mass, bodies.body_size)
    rows = sp.csc_matrix(-(sp.diags_array(scale.ravel()) @ bodies.jacobian @ factor))
    rows *= np.sqrt(problem.rho)
    identity = sp.csc_matrix(sp.eye_array(rows.shape[1]))
    cones = [
        library.SecondOrderConeT(problem.dim) if mu > 0 else library.NonnegativeConeT(problem.dim)
        for mu in problem.friction
    ]

    def solve(frozen: Floats, tolerance: float) -> Floats:
        offset = problem.offset.copy()
        offset[:: problem.dim] += frozen
        size = float(np.linalg.norm(offset)) or 1.0
        found = _solve(
            library, identity, np.zeros(rows.shape[1]), rows, scale.ravel() * offset / size, cones,
            tolerance,
        )  # fmt: skip
        return np.asarray(found.z) * scale.ravel() * size * problem.rho

    return solve


def factor_inverse_mass(inverse_mass: Any, size: int) -> sp.csr_array:
    """L with ``M^-1 = L L^T``, block after block."""
    blocks = sp.bsr_array(inverse_mass, blocksize=(size, size)).tobsr()
    if (blocks.indices != np.arange(len(blocks.indices))).any():
        raise ValueError("the inverse mass matrix is not block diagonal")
    return sp.csr_array(
        sp.bsr_array((np.linalg.cholesky(blocks.data), blocks.indices, blocks.indptr))
    )


def _solve(
    library: Any, quadratic: Any, linear: Floats, rows: Any, bound: Floats, cones: list[Any],
    tolerance: float,
) -> Any:  # fmt: skip
    settings = library.DefaultSettings()
    settings.verbose = False
    settings.max_threads = 1
    for name in ("tol_gap_abs", "tol_gap_rel", "tol_feas"):
        setattr(settings, name, tolerance)
    return library.DefaultSolver(quadratic, linear, rows, bound, cones, settings).solve()


def solve_by_osqp(problem: FrictionProblem, tolerance: float) -> Answer:
    """Without friction: ``min f.A f/2 + b.f`` over f >= 0, polished; A and b are W's and q's normal
    parts.  Raises `ValueError` with friction."""
    if problem.friction.any():
        raise ValueError("OSQP's problem has no friction")
    library = import_module("osqp")
    normal = slice(None, None, problem.dim)
    a = sp.csc_matrix(problem.delassus[normal, normal])
    b = np.ascontiguousarray(problem.offset[normal])
    identity = sp.csc_matrix(sp.eye_array(len(b)))
    start = time.thread_time()
    solver = library.OSQP()
    solver.setup(
        sp.triu(a, format="csc"), b, identity, np.zeros(len(b)), np.full(len(b), np.inf),
        verbose=False, polishing=True, eps_abs=tolerance, eps_rel=tolerance, max_iter=100_000,
    )  # fmt: skip
    found = solver.solve(raise_error=False)
    cost = time.thread_time() - start
    force = np.zeros(len(problem.offset))
    force[normal] = np.maximum(np.nan_to_num(found.x), 0.0)
    return Answer(tolerance, force, cost, found.info.status == "solved")
