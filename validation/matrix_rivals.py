"""The linear rivals of a matrix-free step: the stiffness matrix, assembled once, times u.

v += dt M^-1 (f - K u), u += dt v, by scipy's compressed rows and by the Intel MKL.  Each is given
its best: A = -dt M^-1 K is formed beforehand, so that the product is added to v without another
pass over the nodes; fixed rows and columns and exact zeros are left out; nodes are numbered by
reverse Cuthill-McKee, node-major; indices have 32 bits; MKL's handle is made once, told that many
products follow, and called without wrappers (the Python packages make one every call).  MKL gets
compressed rows and blocks of 3 x 3 both, which have a ninth of the indices to read; what is faster
depends on the mesh and on the precision.

They solve less than QDEM does: small strain only, no rotation, no viscosity; a second matrix would
be needed for that.

MKL takes its number of threads from the load of the machine unless told otherwise, and told it
must be before it is loaded: run it in a process of its own whose environment has `ENVIRONMENT`.
"""

from __future__ import annotations

import ctypes
import ctypes.util
import sys
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from qdem_fem.errors import LibraryMissing, UsageError
from qdem_fem.ordering import order_for_locality
from validation.qdem_judge import lumped_mass, stiffness

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

ENVIRONMENT = {"MKL_DYNAMIC": "FALSE", "OMP_DYNAMIC": "FALSE", "MKL_THREADING_LAYER": "INTEL"}
"""Set before the start of a process in which MKL is to use all the threads it is told to."""
SAFETY = 0.9
"""Of the time step against its bound."""
CALLS = 1_000_000
"""How many products MKL is told to expect."""


@dataclass(frozen=True)
class LinearProblem:
    """A linear body with what a step needs, nodes in the rivals' order, n nodes."""

    data: FloatArray
    """Entries of A = -dt M^-1 K [1/s] without fixed rows and columns."""
    indices: NDArray[np.int32]
    """Their columns."""
    starts: NDArray[np.int32]
    """First entry of every row and the end, (3n + 1,)."""
    loaded: NDArray[np.int32]
    """Numbers of the loaded degrees of freedom."""
    increment: FloatArray
    """dt f/m of these [m/s]."""
    node_order: IntArray
    """The caller's number of every node, (n,)."""
    step: float
    """dt [s]."""
    element_count: int

    @property
    def matrix(self) -> sparse.csr_matrix:
        """A [1/s], (3n, 3n)."""
        size = len(self.starts) - 1
        return sparse.csr_matrix((self.data, self.indices, self.starts), shape=(size, size))


def linear_problem(
    nodes: FloatArray,
    elements: IntArray,
    material: tuple[float, float, float],
    fixed: NDArray[np.bool_],
    force: FloatArray,
) -> LinearProblem:
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
    mass = np.repeat(lumped_mass(points, corners, density), 3)
    rate = sparse.diags_array(free / mass) @ stiffness(points, corners, young, poisson)
    rate = sparse.csr_matrix(rate @ sparse.diags_array(free))
    rate.eliminate_zeros()
    rate.sort_indices()
    step = SAFETY * 2 / float(np.sqrt(abs(rate).sum(axis=1).max()))
    push = force[order].ravel() * free
    loaded = np.flatnonzero(push)
    return LinearProblem(
        -step * rate.data,
        rate.indices.astype(np.int32),
        rate.indptr.astype(np.int32),
        loaded.astype(np.int32),
        step * push[loaded] / mass[loaded],
        order,
        step,
        len(elements),
    )


def problem_save(path: Path, problem: LinearProblem) -> None:
    """Write a problem for the processes of the rivals (npz, not compressed)."""
    np.savez(path, **{field.name: getattr(problem, field.name) for field in fields(problem)})


def problem_load(path: Path) -> LinearProblem:
    """Read what `problem_save` wrote."""
    with np.load(path) as file:
        content: dict[str, Any] = {field.name: file[field.name] for field in fields(LinearProblem)}
    return LinearProblem(
        **content | {"step": float(content["step"]), "element_count": int(content["element_count"])}
    )


class Rival(Protocol):
    """What advances a linear body."""

    bytes_per_step: int
    """Compulsory traffic of a step: the matrix once; u once read and once updated, v updated
    twice.  Smaller than what moves where vectors fall out of the cache [B]."""

    def advance(self, steps: int) -> None:
        """Compute so many steps."""

    def displacement(self) -> FloatArray:
        """u [m], (n, 3), in the caller's numbering."""


def _traffic(matrix: Any, vector: NDArray[Any]) -> int:
    stored = matrix.data.nbytes + matrix.indices.nbytes + matrix.indptr.nbytes
    return int(stored + 6 * vector.nbytes)


def _caller_order(problem: LinearProblem, u: NDArray[Any]) -> FloatArray:
    out = np.empty((len(problem.node_order), 3))
    out[problem.node_order] = u.reshape(-1, 3)
    return out


class ScipyRival:
    """scipy's compressed rows and numpy in place; one thread, scipy has no more."""

    def __init__(self, problem: LinearProblem, precision: str) -> None:
        kind = np.dtype(precision)
        self._problem, self._matrix = problem, problem.matrix.astype(kind)
        self._u, self._v, self._scratch = (np.zeros(self._matrix.shape[0], kind) for _ in range(3))
        self._increment, self._step = problem.increment.astype(kind), kind.type(problem.step)
        self.bytes_per_step = _traffic(self._matrix, self._u)

    def advance(self, steps: int) -> None:
        """v += A u + dt f/m; u += dt v."""
        matrix, u, v, scratch = self._matrix, self._u, self._v, self._scratch
        loaded, increment, step = self._problem.loaded, self._increment, self._step
        for _ in range(steps):
            np.add(v, matrix @ u, out=v)
            v[loaded] += increment
            np.multiply(v, step, out=scratch)
            np.add(u, scratch, out=u)

    def displacement(self) -> FloatArray:
        """u [m], (n, 3), in the caller's numbering."""
        return _caller_order(self._problem, self._u)


class _Description(ctypes.Structure):
    """MKL's matrix_descr."""

    _fields_ = (("kind", ctypes.c_int), ("fill", ctypes.c_int), ("diagonal", ctypes.c_int))


SPARSE_GENERAL = _Description(20, 0, 0)
SPARSE_PLAIN, SPARSE_ROWS, BASE_ZERO = 10, 101, 0
"""MKL's codes: matrix not transposed; blocks stored row by row; indices from zero."""


def mkl_load() -> ctypes.CDLL:
    """MKL's run-time library, of this Python environment or of the system.

    Raises `LibraryMissing`.
    """
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
    """Intel MKL's inspector-executor products and its axpy.

    ``storage`` is ``"rows"`` (compressed rows) or ``"blocks"`` (3 x 3).  ``threads`` holds for the
    whole process.  Raises `LibraryMissing` without MKL, `UsageError` if it refuses the matrix.
    """

    def __init__(
        self, problem: LinearProblem, precision: str, threads: int, storage: str = "rows"
    ) -> None:
        if storage not in ("rows", "blocks"):
            raise UsageError(f"no storage {storage}", where="MklRival", remedy="use rows or blocks")
        self._mkl = mkl_load()
        self._mkl.MKL_Set_Dynamic(0)
        self._mkl.MKL_Set_Num_Threads(threads)
        kind = np.dtype(precision)
        letter = "d" if kind.itemsize == 8 else "s"
        self._real: Any = ctypes.c_double if kind.itemsize == 8 else ctypes.c_float
        matrix = problem.matrix.astype(kind)
        self._problem = problem
        self._matrix = matrix.tobsr((3, 3)) if storage == "blocks" else matrix
        self._u, self._v = (np.zeros(matrix.shape[0], kind) for _ in range(2))
        self._increment = problem.increment.astype(kind)
        self.bytes_per_step = _traffic(self._matrix, self._u)
        self._product = self._function(f"mkl_sparse_{letter}_mv", ctypes.c_int)
        self._add = self._function(f"cblas_{letter}axpy", None)
        self._add_some = self._function(f"cblas_{letter}axpyi", None)
        self._handle = self._handle_make(letter, storage)

    def _function(self, name: str, result: Any) -> Callable[..., Any]:
        function = self._mkl[name]
        function.restype = result
        return function

    def _handle_make(self, letter: str, storage: str) -> ctypes.c_void_p:
        matrix, handle = self._matrix, ctypes.c_void_p()
        size = 3 if storage == "blocks" else 1
        starts = matrix.indptr.ctypes.data
        arrays = (starts, starts + matrix.indptr.itemsize, matrix.indices.ctypes.data)
        places = [ctypes.c_void_p(place) for place in (*arrays, matrix.data.ctypes.data)]
        shape: tuple[int, ...] = (matrix.shape[0] // size, matrix.shape[1] // size)
        if storage == "blocks":
            shape = (SPARSE_ROWS, *shape, size)
        create = self._mkl[f"mkl_sparse_{letter}_create_{'bsr' if size == 3 else 'csr'}"]
        status = create(ctypes.byref(handle), BASE_ZERO, *shape, *places)
        if status == 0:
            self._mkl.mkl_sparse_set_mv_hint(handle, SPARSE_PLAIN, SPARSE_GENERAL, CALLS)
            status = self._mkl.mkl_sparse_optimize(handle)
        if status != 0:
            raise UsageError(
                f"MKL refused the matrix with status {status}",
                where=f"MklRival, {storage}",
                remedy="use the other storage",
            )
        return handle

    def advance(self, steps: int) -> None:
        """v += A u + dt f/m; u += dt v."""
        real, one = self._real, ctypes.c_int(1)
        u, v = (ctypes.c_void_p(array.ctypes.data) for array in (self._u, self._v))
        product = (SPARSE_PLAIN, real(1), self._handle, SPARSE_GENERAL, u, real(1), v)
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
        return _caller_order(self._problem, self._u)

    def __del__(self) -> None:
        if hasattr(self, "_handle"):
            self._mkl.mkl_sparse_destroy(self._handle)
