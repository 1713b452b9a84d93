"""Factorisations of ``A + B W``, A and B block diagonal, in contact space or in body space.

Every Newton step of this package solves ``(A + B W) dr = b``: A and B, one (dim, dim) block a
contact, are the derivatives of the contact law by its force and by its velocity.  Where W is
known by its factors, ``W = J M^-1 J^T``, the same dr comes from velocities v of the bodies,

    (M + J^T A^-1 B J) v = J^T A^-1 b,    dr = A^-1 (b - B J v),

whose matrix has one block for each pair of touching bodies, while W has one for each pair of
contacts on a body: in packings it fills in far less.  A has to be regular here; the methods keep
it so (a barrier, or a proximal shift).

The pattern, its order of elimination and where each number goes are found once
(`rigid_lcp.elimination_tree`); the factors are made by dense products (`rigid_lcp.multifrontal`).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from numba import njit
from numpy.typing import NDArray

from rigid_lcp.elimination_tree import elimination_tree
from rigid_lcp.friction_problem import FrictionProblem
from rigid_lcp.multifrontal import factor_fronts, solve_fronts

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Solve = Callable[[Floats], Floats]

DENSE_SIZE = 220
"""Up to so many rows a dense LU costs less than the bookkeeping of a sparse one."""
DENSE_SHARE = 0.3
"""Fuller matrices are factored dense: their sparse LU would be full anyway."""


class SingularSystem(ArithmeticError):
    """The matrix of a step could not be factored; the caller shifts it, or ends."""


class Factorisation(Protocol):
    """Factors ``A + B W`` for one W and many A, B (nc, dim, dim)."""

    flops: float
    """About what one factorisation costs."""

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
        self.flops = 2.0 / 3.0 * float(len(self.matrix)) ** 3

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


class BlockSystem:
    """A sparse matrix of dense blocks at fixed places, filled anew and factored each time."""

    def __init__(self, count: int, size: int, rows: Integers, columns: Integers) -> None:
        """``count`` block rows of ``size`` rows each; blocks at (rows, columns)."""
        self.tree = elimination_tree(count, size, rows, columns)

    @property
    def flops(self) -> float:
        """About what one factorisation costs."""
        width = np.diff(self.tree.first).astype(float) * self.tree.size
        below = np.diff(self.tree.row_start).astype(float) * self.tree.size
        return float((((width + below) ** 3 - below**3) * 2.0 / 3.0).sum())

    def factor(self, blocks: Floats) -> Solve:
        """Factor the matrix with these blocks (entries, size, size).  Raises `SingularSystem`."""
        factors, regular = factor_fronts(self.tree, blocks)
        if not regular:
            raise SingularSystem
        return lambda right: solve_fronts(self.tree, factors, right)


class ContactFactorisation:
    """``A + B W`` as it stands: a row of blocks a contact."""

    def __init__(self, problem: FrictionProblem) -> None:
        contacts, dim = problem.contacts, problem.dim
        w = sp.bsr_array(problem.delassus.tobsr((dim, dim)))
        row, column = np.repeat(np.arange(contacts), np.diff(w.indptr)), w.indices.astype(np.int64)
        bare = np.setdiff1d(
            np.arange(contacts), row[row == column]
        )  # W has no diagonal block there
        row, column = np.concatenate([row, bare]), np.concatenate([column, bare])
        order = np.lexsort((column, row))
        self.row, column = row[order], column[order]
        self.blocks = np.concatenate([w.data, np.zeros((len(bare), dim, dim))])[order]
        self.diagonal = np.flatnonzero(self.row == column)
        self.system = BlockSystem(contacts, dim, self.row, column)
        self.flops = self.system.flops

    def factor(self, a: Floats, b: Floats) -> Solve:
        """See `Factorisation`."""
        blocks = np.matmul(b[self.row], self.blocks)
        blocks[self.diagonal] += a
        return self.system.factor(blocks)


class BodyFactorisation:
    """``A + B W`` by way of the velocities of the bodies (module docstring)."""

    def __init__(self, problem: FrictionProblem) -> None:
        assert problem.bodies is not None
        dim, size = problem.dim, problem.bodies.body_size
        self.jacobian = sp.csr_array(problem.bodies.jacobian)
        self.transposed = sp.csr_array(self.jacobian.T)
        bodies = self.jacobian.shape[1] // size
        entries = self.jacobian.tocoo()
        # J of contact c by body ``body[k]``, first[c] <= k < first[c + 1], as full blocks
        key = (entries.row // dim).astype(np.int64) * bodies + entries.col // size
        found, where = np.unique(key, return_inverse=True)
        contact, body = found // bodies, found % bodies
        self.first = np.searchsorted(contact, np.arange(problem.contacts + 1))
        self.blocks = np.zeros((len(found), dim, size))
        self.blocks[where, entries.row % dim, entries.col % size] = entries.data
        rows, columns = _pairs(self.first, body)
        own = np.arange(bodies)
        key = np.concatenate([own * bodies + own, rows * bodies + columns])
        found, places = np.unique(key, return_inverse=True)
        self.system = BlockSystem(bodies, size, found // bodies, found % bodies)
        self.flops = self.system.flops
        mass = problem.bodies.mass.tocoo()
        self.mass = np.zeros((len(found), size, size))
        self.mass[places[mass.row // size], mass.row % size, mass.col % size] = mass.data
        self.places = places[bodies:]

    def factor(self, a: Floats, b: Floats) -> Solve:
        """See `Factorisation`."""
        try:
            inverse: Floats = np.linalg.inv(a).astype(np.float64, copy=False)
        except np.linalg.LinAlgError as error:
            raise SingularSystem from error
        stiffness = np.matmul(inverse, b)
        matrix = self.mass.copy()
        _add_contacts(matrix, self.first, self.blocks, self.places, stiffness)
        solve_bodies = self.system.factor(matrix)

        def solve(right: Floats) -> Floats:
            force = multiply_blocks(inverse, right)
            velocity = solve_bodies(self.transposed @ force)
            return force - multiply_blocks(stiffness, self.jacobian @ velocity)

        return solve


def multiply_blocks(blocks: Floats, vector: Floats) -> Floats:
    """Block diagonal matrix (nc, dim, dim) times a vector (nc * dim,)."""
    return np.matmul(blocks, vector.reshape(*blocks.shape[:2], 1)).ravel()


@njit(cache=True)
def _pairs(first: Integers, body: Integers) -> tuple[Integers, Integers]:
    """Row and column of every block that a contact adds to, in the order of `_add_contacts`."""
    total = 0
    for c in range(len(first) - 1):
        total += (first[c + 1] - first[c]) ** 2
    rows, columns = np.empty(total, dtype=np.int64), np.empty(total, dtype=np.int64)
    k = 0
    for c in range(len(first) - 1):
        for i in range(first[c], first[c + 1]):
            for j in range(first[c], first[c + 1]):
                rows[k], columns[k] = body[i], body[j]
                k += 1
    return rows, columns


@njit(cache=True)
def _add_contacts(
    matrix: Floats, first: Integers, blocks: Floats, places: Integers, stiffness: Floats
) -> None:
    """Add ``J_c^T K_c J_c`` of every contact, ``K = A^-1 B``, to the blocks of the body matrix."""
    dim, size = blocks.shape[1:]
    half = np.empty((size, dim))
    k = 0
    for c in range(len(first) - 1):
        for i in range(first[c], first[c + 1]):
            for m in range(size):
                for b in range(dim):
                    half[m, b] = 0.0
                    for a in range(dim):
                        half[m, b] += blocks[i, a, m] * stiffness[c, a, b]
            for j in range(first[c], first[c + 1]):
                block = matrix[places[k]]
                for m in range(size):
                    for b in range(dim):
                        for n in range(size):
                            block[m, n] += half[m, b] * blocks[j, b, n]
                k += 1
