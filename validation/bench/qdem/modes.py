"""The judge of QDEM in frequency: lowest modes of the assembled matrices of `judge`."""

from __future__ import annotations

import time
import warnings
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import scipy.sparse as sparse
from numpy.typing import ArrayLike
from scipy.sparse.linalg import eigsh, lobpcg

from qdem_fem.files.errors import NotConverged, UsageError
from validation.bench.qdem.judge import FloatArray, build_multigrid, list_free, make_rigid_motions


@dataclass(frozen=True)
class Modes:
    """Lowest vibration modes."""

    frequency: FloatArray
    """f [Hz], (count,), ascending."""
    shape: FloatArray
    """phi, (count, n, 3), with phi M phi = 1 [1/sqrt(kg)]."""
    residual: FloatArray
    """|K phi - omega^2 M phi| / |omega^2 M phi|, (count,)."""
    cpu_s: float


def find_modes(
    stiffness: sparse.csr_matrix,
    mass: FloatArray,
    free: ArrayLike,
    count: int = 5,
    method: Literal["amg", "direct"] = "direct",
    nodes: FloatArray | None = None,
    tolerance: float = 1e-4,
    iterations_max: int = 200,
) -> Modes:
    """The ``count`` lowest modes of K phi = omega^2 M phi, ``mass`` (n,) [kg], for a held body.

    ``direct`` inverts K about zero (SuperLU, below 20,000 nodes); ``amg`` is LOBPCG with
    multigrid in front, and needs ``nodes`` (n, 3) [m].  The relative error of a frequency is of
    the order of the square of its ``residual`` here, which stays below ``tolerance``.

    Raises `NotConverged` above ``tolerance``, `UsageError`, `LibraryMissing` without pyamg.
    """
    started = time.process_time()
    size = stiffness.shape[0]
    dof = list_free(free, size)
    root = np.sqrt(np.repeat(mass, 3)[dof])
    # with y = sqrt(M) phi the mass is the identity, and the matrix stays symmetric
    scaled = sparse.diags(1 / root) @ stiffness[dof][:, dof] @ sparse.diags(1 / root)
    scaled = scaled.tocsr()
    if method == "direct":
        value, vector = eigsh(scaled.tocsc(), k=count, sigma=0.0, tol=0)
    else:
        if nodes is None:
            raise UsageError('method="amg" needs the nodes', remedy="pass nodes")
        value, vector = _find_by_multigrid(
            scaled, root[:, None] * make_rigid_motions(nodes)[dof], count, tolerance, iterations_max
        )
    order = np.argsort(value)
    value, vector = value[order], vector[:, order]
    rest = np.linalg.norm(scaled @ vector - value * vector, axis=0) / value
    if not np.all(rest <= tolerance):
        raise NotConverged(
            f"the residuals of the {count} modes are {np.array2string(rest, precision=1)}",
            where="modes",
            remedy="allow more iterations, or ask for less accuracy",
        )
    shape = np.zeros((count, size))
    shape[:, dof] = (vector / root[:, None]).T
    frequency = np.sqrt(value) / 2 / np.pi
    return Modes(frequency, shape.reshape(count, -1, 3), rest, time.process_time() - started)


def _find_by_multigrid(
    scaled: sparse.csr_matrix,
    near_kernel: FloatArray,
    count: int,
    tolerance: float,
    iterations_max: int,
) -> tuple[FloatArray, FloatArray]:
    """LOBPCG from seeded random vectors, two more than asked, made smooth by one multigrid cycle.

    Of the extra ones nothing is asked, so LOBPCG runs in short turns until the others are there.
    """
    precondition = build_multigrid(scaled, near_kernel).aspreconditioner(cycle="V")
    start = np.random.default_rng(0).standard_normal((scaled.shape[0], count + 2))
    vector = np.column_stack([precondition @ column for column in start.T])
    value = np.full(count + 2, np.nan)
    for _ in range(max(1, iterations_max // 20)):
        value, vector = _run_lobpcg(scaled, vector, precondition)
        kept = slice(0, count)
        rest = scaled @ vector[:, kept] - value[kept] * vector[:, kept]
        if np.all(np.linalg.norm(rest, axis=0) <= tolerance * value[kept]):
            break
    return value[:count], vector[:, :count]


def _run_lobpcg(
    scaled: sparse.csr_matrix, vector: FloatArray, precondition: Any
) -> tuple[FloatArray, FloatArray]:
    """20 iterations; scipy's warning that it has not converged is what a turn expects."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        value, vector = lobpcg(
            scaled, vector, M=precondition, tol=1e-300, maxiter=20, largest=False
        )
    order = np.argsort(value)
    return value[order], vector[:, order]
