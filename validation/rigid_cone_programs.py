"""The convex programs that Clarabel is given: Coulomb's law with ``mu |u_T|`` frozen.

In contact space, or its dual in body space; and how a peer's library is loaded and timed.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from rigid_lcp.errors import LibraryMissing
from rigid_lcp.friction_problem import FrictionProblem

Floats = NDArray[np.float64]


@dataclass
class Stopwatch:
    """Processor seconds of what is timed, and how often it was."""

    seconds: float = 0.0
    calls: int = 0
    words: list[str] = field(default_factory=list)

    def __call__(self, job: Callable[[], Any]) -> Any:
        """Do a job and add its time."""
        start = time.process_time()
        try:
            return job()
        finally:
            self.seconds += time.process_time() - start
            self.calls += 1


Program = Callable[[Floats, float, Stopwatch], Floats]


def program_of_contacts(problem: FrictionProblem) -> Program:
    """``min r.W r/2 + (q + frozen n).r`` over r in K; W by its symmetric part."""
    library = library_named("clarabel")
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

    def solve(frozen: Floats, tolerance: float, watch: Stopwatch) -> Floats:
        linear = problem.offset.copy()
        linear[:: problem.dim] += frozen
        size = float(np.linalg.norm(linear)) or 1.0
        found = _solved(
            library, upper, linear / size, rows, np.zeros(len(linear)), cones, tolerance, watch
        )
        return np.asarray(found.x) * size * problem.rho

    return solve


def program_of_bodies(problem: FrictionProblem) -> Program:
    """Its dual, ``min |y|^2/2`` with ``J L y + q + frozen n`` in K*, where ``M^-1 = L L^T``."""
    library = library_named("clarabel")
    bodies = problem.bodies
    assert bodies is not None
    scale = np.ones((problem.contacts, problem.dim))
    scale[:, 1:] = problem.friction[:, None]
    factor = inverse_mass_factor(bodies.inverse_mass, bodies.body_size)
    rows = sp.csc_matrix(-(sp.diags_array(scale.ravel()) @ bodies.jacobian @ factor))
    rows *= np.sqrt(problem.rho)
    identity = sp.csc_matrix(sp.eye_array(rows.shape[1]))
    cones = [
        library.SecondOrderConeT(problem.dim) if mu > 0 else library.NonnegativeConeT(problem.dim)
        for mu in problem.friction
    ]

    def solve(frozen: Floats, tolerance: float, watch: Stopwatch) -> Floats:
        offset = problem.offset.copy()
        offset[:: problem.dim] += frozen
        size = float(np.linalg.norm(offset)) or 1.0
        found = _solved(
            library, identity, np.zeros(rows.shape[1]), rows, scale.ravel() * offset / size, cones,
            tolerance, watch,
        )  # fmt: skip
        return np.asarray(found.z) * scale.ravel() * size * problem.rho

    return solve


def inverse_mass_factor(inverse_mass: Any, size: int) -> sp.csr_array:
    """L with ``M^-1 = L L^T``, block after block."""
    blocks = sp.bsr_array(inverse_mass, blocksize=(size, size)).tobsr()
    if (blocks.indices != np.arange(len(blocks.indices))).any():
        raise ValueError("the inverse mass matrix is not block diagonal")
    return sp.csr_array(
        sp.bsr_array((np.linalg.cholesky(blocks.data), blocks.indices, blocks.indptr))
    )


def _solved(
    library: Any, quadratic: Any, linear: Floats, rows: Any, bound: Floats, cones: list[Any],
    tolerance: float, watch: Stopwatch,
) -> Any:  # fmt: skip
    settings = library.DefaultSettings()
    settings.verbose = False
    settings.max_threads = 1
    for name in ("tol_gap_abs", "tol_gap_rel", "tol_feas"):
        setattr(settings, name, tolerance)
    found = watch(
        lambda: library.DefaultSolver(quadratic, linear, rows, bound, cones, settings).solve()
    )
    watch.words.append(str(found.status))
    return found


def library_missing(name: str) -> bool:
    """True where a Python package of a peer is not installed."""
    try:
        library_named(name)
    except LibraryMissing:
        return True
    return False


def library_named(name: str) -> Any:
    from importlib import import_module

    try:
        return import_module(name)
    except ImportError as error:
        raise LibraryMissing(
            f"this peer needs the Python package {name}", remedy=f"pip install {name}"
        ) from error
