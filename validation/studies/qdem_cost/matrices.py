"""The linear rivals of a matrix-free step: the stiffness matrix, assembled once, times u.

v += dt M^-1 (f - K u), u += dt v, by scipy's compressed rows and by the Intel MKL.  Each is given
its best: A = -dt M^-1 K is formed beforehand, so that the product is added to v without another
pass; fixed rows and columns and exact zeros are left out; nodes are numbered by reverse
Cuthill-McKee; indices have 32 bits; MKL's handle is made once, announces many products, and
gets compressed rows and blocks of 3 x 3 both.  They solve less than QDEM does: small strain only.

MKL takes its threads from the load of the machine unless its environment has `ENVIRONMENT`.
"""

from __future__ import annotations

import ctypes
import ctypes.util
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from qdem_fem.files.errors import LibraryMissing
from qdem_fem.kernel.cpu.ordering import order_for_locality
from validation.bench.qdem.judge import FloatArray, IntArray, build_stiffness, lump_mass

ENVIRONMENT = {"MKL_DYNAMIC": "FALSE", "OMP_DYNAMIC": "FALSE", "MKL_THREADING_LAYER": "INTEL"}
SAFETY = 0.9
"""Of the time step against its bound."""
CALLS = 1_000_000
"""Number of products that MKL expects."""
PLAIN, ROWS = 10, 101
"""MKL's codes: matrix not transposed; blocks stored row by row."""


@dataclass(frozen=True)
class LinearProblem:
    """A linear body with what a step needs, nodes in the rivals' order, n nodes."""

    matrix: sparse.csr_matrix
    """A = -dt M^-1 K [1/s] without fixed rows and columns, (3n, 3n)."""
    loaded: NDArray[np.int32]
    """Numbers of the loaded degrees of freedom."""
    increment: FloatArray
    """dt f/m of these [m/s]."""
    node_order: IntArray
    """The caller's number of every node, (n,)."""
    step: float
    """dt [s]."""

    def restore_order(self, u: NDArray[Any]) -> FloatArray:
        """u [m], (n, 3), in the caller's numbering."""
        out = np.empty((len(self.node_order), 3))
        out[self.node_order] = u.reshape(-1, 3)
        return out


def build_problem(
    nodes: FloatArray, elements: IntArray, material: tuple[float, float, float],
    fixed: NDArray[np.bool_], force: FloatArray,
) -> LinearProblem:  # fmt: skip
    """Assemble the rivals' step.

    ``nodes`` (n, 3) [m]; ``elements`` (m, 4); ``material`` E [Pa], nu, rho [kg/m^3]; ``fixed``
    (n,); ``force`` (n, 3) [N].  The time step is `SAFETY` times 2/omega with Gershgorin's bound
    omega^2 <= max_i sum_j |K_ij| / m_i.
    """
    young, poisson, density = material
    order, element_order = order_for_locality(elements, len(nodes))
    place = np.empty(len(nodes), np.int64)
    place[order] = np.arange(len(nodes))
    points, corners = nodes[order], place[elements[element_order]]
    free = np.repeat(~fixed[order], 3).astype(float)
    mass = np.repeat(lump_mass(points, corners, density), 3)
    rate = sparse.diags_array(free / mass) @ build_stiffness(points, corners, young, poisson)
    rate = sparse.csr_matrix(rate @ sparse.diags_array(free))
    rate.eliminate_zeros()
    rate.sort_indices()
    step = SAFETY * 2 / float(np.sqrt(abs(rate).sum(axis=1).max()))
    push = force[order].ravel() * free
    loaded = np.flatnonzero(push).astype(np.int32)
    return LinearProblem(-step * rate, loaded, step * push[loaded] / mass[loaded], order, step)


class ScipyRival:
    """scipy's compressed rows and numpy in place; one thread, scipy has no more."""

    def __init__(self, problem: LinearProblem, precision: str) -> None:
        kind = np.dtype(precision)
        self._problem, self._matrix = problem, problem.matrix.astype(kind)
        self._u, self._v, self._scratch = (np.zeros(self._matrix.shape[0], kind) for _ in range(3))
        self._increment, self._step = problem.increment.astype(kind), kind.type(problem.step)

    def advance(self, steps: int) -> None:
        """v += A u + dt f/m; u += dt v."""
        u, v = self._u, self._v
        for _ in range(steps):
            np.add(v, self._matrix @ u, out=v)
            v[self._problem.loaded] += self._increment
            np.multiply(v, self._step, out=self._scratch)
            np.add(u, self._scratch, out=u)

    def displacement(self) -> FloatArray:
        """u [m], (n, 3), in the caller's numbering."""
        return self._problem.restore_order(self._u)


class _Description(ctypes.Structure):
    """MKL's matrix_descr."""

    _fields_ = (("kind", ctypes.c_int), ("fill", ctypes.c_int), ("diagonal", ctypes.c_int))


GENERAL = _Description(20, 0, 0)


def load_mkl() -> ctypes.CDLL:
    """MKL's run-time library, of this Python environment or of the system; or `LibraryMissing`."""
    folder = Path(sys.prefix) / "lib"
    found = [str(path) for path in sorted(folder.glob("libmkl_rt.so*"))]
    for name in (*found, ctypes.util.find_library("mkl_rt")):
        try:
            if name:
                return ctypes.CDLL(name)
        except OSError:
            continue
    raise LibraryMissing(
        "the Intel MKL is not installed", where=str(folder), remedy="pip install mkl"
    )


class MklRival:
    """Intel MKL's products and its axpy; ``storage`` is ``"rows"`` or ``"blocks"`` (3 x 3)."""

    def __init__(
        self, problem: LinearProblem, precision: str, threads: int, storage: str = "rows"
    ) -> None:
        self._mkl, kind = load_mkl(), np.dtype(precision)
        self._mkl.MKL_Set_Dynamic(0)
        self._mkl.MKL_Set_Num_Threads(threads)
        letter = "d" if kind.itemsize == 8 else "s"
        self._real: Any = ctypes.c_double if kind.itemsize == 8 else ctypes.c_float
        matrix = problem.matrix.astype(kind)
        self._problem = problem
        self._matrix = matrix.tobsr((3, 3)) if storage == "blocks" else matrix
        self._u, self._v = (np.zeros(matrix.shape[0], kind) for _ in range(2))
        self._increment = problem.increment.astype(kind)
        self._product = self._find_function(f"mkl_sparse_{letter}_mv", ctypes.c_int)
        self._add = self._find_function(f"cblas_{letter}axpy", None)
        self._add_some = self._find_function(f"cblas_{letter}axpyi", None)
        self._handle = self._make_handle(letter, 3 if storage == "blocks" else 1)

    def _find_function(self, name: str, result: Any) -> Callable[..., Any]:
        function = self._mkl[name]
        function.restype = result
        return function

    def _make_handle(self, letter: str, size: int) -> ctypes.c_void_p:
        matrix, handle = self._matrix, ctypes.c_void_p()
        starts = matrix.indptr.ctypes.data
        arrays = (starts, starts + matrix.indptr.itemsize, matrix.indices.ctypes.data)
        places = [ctypes.c_void_p(place) for place in (*arrays, matrix.data.ctypes.data)]
        shape: tuple[int, ...] = (matrix.shape[0] // size, matrix.shape[1] // size)
        if size == 3:
            shape = (ROWS, *shape, size)
        create = self._mkl[f"mkl_sparse_{letter}_create_{'bsr' if size == 3 else 'csr'}"]
        status = create(ctypes.byref(handle), 0, *shape, *places)
        if status == 0:
            self._mkl.mkl_sparse_set_mv_hint(handle, PLAIN, GENERAL, CALLS)
            status = self._mkl.mkl_sparse_optimize(handle)
        if status != 0:
            raise RuntimeError(f"MKL refused the matrix with status {status}")
        return handle

    def advance(self, steps: int) -> None:
        """v += A u + dt f/m; u += dt v."""
        real, one = self._real, ctypes.c_int(1)
        u, v = (ctypes.c_void_p(array.ctypes.data) for array in (self._u, self._v))
        product = (PLAIN, real(1), self._handle, GENERAL, u, real(1), v)
        increment = ctypes.c_void_p(self._increment.ctypes.data)
        loaded = ctypes.c_void_p(self._problem.loaded.ctypes.data)
        push = (ctypes.c_int(len(self._increment)), real(1), increment, loaded, v)
        move = (ctypes.c_int(len(self._u)), real(self._problem.step), v, one, u, one)
        for _ in range(steps):
            self._product(*product)
            self._add_some(*push)
            self._add(*move)

    def displacement(self) -> FloatArray:
        """u [m], (n, 3), in the caller's numbering."""
        return self._problem.restore_order(self._u)
