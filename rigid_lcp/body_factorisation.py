"""Factorisations of ``A + B W``, A and B block diagonal, in contact space or in body space.

Every Newton step of this package solves ``(A + B W) dr = b``: A and B, one (dim, dim) block a
contact, are the derivatives of the contact law by its force and by its velocity.  Where W is
known by its factors, ``W = J M^-1 J^T``, the same dr comes from velocities v of the bodies,

    (M + J^T A^-1 B J) v = J^T A^-1 b,    dr = A^-1 (b - B J v),

whose matrix has one block for each pair of touching bodies, while W has one for each pair of
contacts on a body: in packings it fills in far less.  A has to be regular here; the methods keep
it so (a barrier, or a proximal shift).

The pattern, its fill-reducing order (minimum degree) and where each number goes are found once.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from numba import njit
from numpy.typing import NDArray
from scipy.sparse.linalg import SuperLU, splu

from rigid_lcp.friction_problem import FrictionProblem

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Solve = Callable[[Floats], Floats]

DENSE_SIZE = 150
"""Up to so many rows a dense LU costs less than the bookkeeping of a sparse one."""
DENSE_SHARE = 0.3
"""Fuller matrices are factored dense: their sparse LU would be full anyway."""

LEAST_PIVOT = 1e-8
"""A diagonal entry so many times smaller than another of its column is still taken as pivot: the
shifts and barriers keep it good enough, and other pivots double or triple the fill."""


class SingularSystem(ArithmeticError):
    """The matrix of a step could not be factored; the caller shifts it, or ends."""


class Factorisation(Protocol):
    """Factors ``A + B W`` for one W and many A, B (nc, dim, dim)."""

    def factor(self, a: Floats, b: Floats) -> Solve:
        """What solves ``(A + B W) x = right`` for x.  Raises `SingularSystem`."""


def factorisation(problem: FrictionProblem) -> Factorisation:
    """The cheaper one: by way of the bodies where they are known, unless W is small."""
    size = problem.contacts * problem.dim
    if problem.bodies is not None and size > DENSE_SIZE:
        return BodyFactorisation(problem)
    if size <= DENSE_SIZE or problem.delassus.nnz > DENSE_SHARE * size * size:
        return DenseFactorisation(problem)
    return ContactFactorisation(problem)


class DenseFactorisation:
    """``A + B W`` as a full matrix, by LAPACK."""

    def __init__(self, problem: FrictionProblem) -> None:
        self.contacts, self.dim = problem.contacts, problem.dim
        self.matrix = problem.delassus.toarray()

    def factor(self, a: Floats, b: Floats) -> Solve:
        """See `Factorisation`."""
        contacts, dim, size = self.contacts, self.dim, self.contacts * self.dim
        matrix = np.matmul(b, self.matrix.reshape(contacts, dim, size))
        each = np.arange(contacts)
        matrix.reshape(contacts, dim, contacts, dim)[each, :, each, :] += a
        lu, pivots, info = scipy.linalg.lapack.dgetrf(matrix.reshape(size, size))
        if info != 0 or not np.isfinite(np.diagonal(lu)).all():
            raise SingularSystem
        return lambda right: scipy.linalg.lapack.dgetrs(lu, pivots, right)[0]


class SparseSystem:
    """A sparse matrix of fixed pattern, filled entry by entry and factored by SuperLU."""

    def __init__(self, pattern: sp.csc_array) -> None:
        """``pattern``: symmetric, diagonal included, in the caller's order of unknowns."""
        size = pattern.shape[0]
        laplacian = sp.csc_array(
            (np.full(pattern.nnz, -1.0), pattern.indices, pattern.indptr), pattern.shape
        ) + sp.diags_array(np.full(size, 2.0 * size))
        found = splu(
            sp.csc_array(laplacian), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )  # fmt: skip
        self.order = np.argsort(found.perm_c)
        self.rank = np.asarray(found.perm_c, dtype=np.int64)
        ordered = sp.csc_array(pattern[self.order][:, self.order])
        ordered.sort_indices()
        self.shape, self.indices, self.indptr = ordered.shape, ordered.indices, ordered.indptr

    def places(self, rows: Integers, columns: Integers) -> Integers:
        """Where the entries (rows, columns), in the caller's order, are among the data."""
        return _places(self.rank[rows], self.rank[columns], self.indices, self.indptr)

    def factor(self, data: Floats) -> Solve:
        """Factor the matrix with these entries.  Raises `SingularSystem`."""
        if not np.isfinite(data).all():
            raise SingularSystem
        matrix = sp.csc_array((data, self.indices, self.indptr), self.shape)
        try:
            factors: SuperLU = splu(
                matrix, permc_spec="NATURAL", diag_pivot_thresh=LEAST_PIVOT,
                options={"SymmetricMode": True},
            )  # fmt: skip
        except RuntimeError as error:  # exactly singular
            raise SingularSystem from error

        def solve(right: Floats) -> Floats:
            x = np.empty_like(right)
            x[self.order] = factors.solve(right[self.order])
            return x

        return solve


class ContactFactorisation:
    """``A + B W`` as it stands: a row of blocks a contact."""

    def __init__(self, problem: FrictionProblem) -> None:
        contacts, dim = problem.contacts, problem.dim
        w = problem.delassus.tobsr((dim, dim))
        w = sp.bsr_array(w + sp.bsr_array(_zero_blocks(contacts, dim), shape=w.shape))
        w.sort_indices()
        self.blocks, self.block_columns, self.first = w.data, w.indices, w.indptr
        row = np.repeat(np.arange(contacts), np.diff(w.indptr))
        self.diagonal = np.flatnonzero(row == w.indices)
        self.row = row
        inside = np.arange(dim)
        rows = np.broadcast_to((row * dim)[:, None, None] + inside[:, None], w.data.shape).ravel()
        columns = np.broadcast_to((w.indices * dim)[:, None, None] + inside, w.data.shape).ravel()
        ones = sp.csc_array((np.ones(len(rows)), (rows, columns)), w.shape)
        self.system = SparseSystem(sp.csc_array(ones + ones.T))
        self.places = self.system.places(rows.astype(np.int64), columns.astype(np.int64))

    def factor(self, a: Floats, b: Floats) -> Solve:
        """See `Factorisation`."""
        blocks = np.matmul(b[self.row], self.blocks)
        blocks[self.diagonal] += a
        data = np.zeros(len(self.system.indices))
        data[self.places] = blocks.ravel()
        return self.system.factor(data)


class BodyFactorisation:
    """``A + B W`` by way of the velocities of the bodies (module docstring)."""

    def __init__(self, problem: FrictionProblem) -> None:
        assert problem.bodies is not None
        dim, mass = problem.dim, problem.bodies.mass.tocoo()
        self.jacobian = sp.csr_array(problem.bodies.jacobian)
        self.transposed = sp.csr_array(self.jacobian.T)
        freedoms = self.jacobian.shape[1]
        entries = self.jacobian.tocoo()
        # the rows of a contact as one full block: its columns are first[c]:first[c + 1]
        key = (entries.row // dim).astype(np.int64) * freedoms + entries.col
        found, where = np.unique(key, return_inverse=True)
        contact, self.columns = found // freedoms, found % freedoms
        self.first = np.searchsorted(contact, np.arange(problem.contacts + 1))
        self.rows = np.zeros((len(found), dim))
        self.rows[where, entries.row % dim] = entries.data
        touched = sp.csr_array(
            (np.ones(len(found)), (contact, self.columns)), (problem.contacts, freedoms)
        )
        self.system = SparseSystem(
            sp.csc_array(touched.T @ touched + abs(mass) + sp.eye_array(freedoms))
        )
        self.mass = np.zeros(len(self.system.indices))
        self.mass[self.system.places(mass.row.astype(np.int64), mass.col.astype(np.int64))] = (
            mass.data
        )
        self.places = self.system.places(*_pairs(self.first, self.columns))

    def factor(self, a: Floats, b: Floats) -> Solve:
        """See `Factorisation`."""
        try:
            inverse: Floats = np.linalg.inv(a).astype(np.float64, copy=False)
        except np.linalg.LinAlgError as error:
            raise SingularSystem from error
        stiffness = np.matmul(inverse, b)
        data = self.mass.copy()
        _add_contacts(data, self.first, self.rows, self.places, stiffness)
        solve_bodies = self.system.factor(data)

        def solve(right: Floats) -> Floats:
            force = multiply_blocks(inverse, right)
            velocity = solve_bodies(self.transposed @ force)
            return force - multiply_blocks(stiffness, self.jacobian @ velocity)

        return solve


def multiply_blocks(blocks: Floats, vector: Floats) -> Floats:
    """Block diagonal matrix (nc, dim, dim) times a vector (nc * dim,)."""
    return np.matmul(blocks, vector.reshape(*blocks.shape[:2], 1)).ravel()


def _zero_blocks(contacts: int, dim: int) -> tuple[Floats, Integers, Integers]:
    return np.zeros((contacts, dim, dim)), np.arange(contacts), np.arange(contacts + 1)


@njit(cache=True)
def _places(
    rows: Integers, columns: Integers, indices: NDArray[np.int32], indptr: NDArray[np.int32]
) -> Integers:
    places = np.empty(len(rows), dtype=np.int64)
    for k in range(len(rows)):
        low, high = indptr[columns[k]], indptr[columns[k] + 1]
        places[k] = low + np.searchsorted(indices[low:high], rows[k])
    return places


@njit(cache=True)
def _pairs(first: Integers, columns: Integers) -> tuple[Integers, Integers]:
    """Row and column of every entry that a contact adds to, in the order of `_add_contacts`."""
    total = 0
    for c in range(len(first) - 1):
        total += (first[c + 1] - first[c]) ** 2
    rows, cols = np.empty(total, dtype=np.int64), np.empty(total, dtype=np.int64)
    k = 0
    for c in range(len(first) - 1):
        for i in range(first[c], first[c + 1]):
            for j in range(first[c], first[c + 1]):
                rows[k], cols[k] = columns[i], columns[j]
                k += 1
    return rows, cols


@njit(cache=True)
def _add_contacts(
    data: Floats, first: Integers, rows: Floats, places: Integers, stiffness: Floats
) -> None:
    """Add ``J_c^T K_c J_c`` of every contact, ``K = A^-1 B``, to the entries of the body matrix."""
    dim = rows.shape[1]
    half = np.empty(dim)
    k = 0
    for c in range(len(first) - 1):
        for i in range(first[c], first[c + 1]):
            for b in range(dim):
                half[b] = 0.0
                for a in range(dim):
                    half[b] += rows[i, a] * stiffness[c, a, b]
            for j in range(first[c], first[c + 1]):
                total = 0.0
                for b in range(dim):
                    total += half[b] * rows[j, b]
                data[places[k]] += total
                k += 1
