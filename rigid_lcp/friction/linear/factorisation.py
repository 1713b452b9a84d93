"""Factorisations of ``A + B W``, A and B block diagonal, in contact space or in body space.

Every Newton step of this package solves ``(A + B W) dr = b``: A and B, one (dim, dim) block a
contact, are the derivatives of the contact law by its force and by its velocity.  Where W is
known by its factors, ``W = J M^-1 J^T``, the same dr comes from velocities v of the bodies,

    (M + J^T A^-1 B J) v = J^T A^-1 b,    dr = A^-1 (b - B J v),

whose matrix has one block for each pair of touching bodies, while W has one for each pair of
contacts on a body: in packings it fills in far less.  A has to be regular here; the methods keep
it so (a barrier, or a proximal shift).

The pattern, its order of elimination and where each number goes are found once
(`rigid_lcp.sparse.elimination_tree`); the factors are made by dense products
(`rigid_lcp.sparse.multifrontal`).
"""

import weakref
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy.linalg
from numba import njit

from rigid_lcp import sparse
from rigid_lcp.arrays import Floats, Ints
from rigid_lcp.friction.problem import FrictionProblem

Solve = Callable[[Floats], Floats]


@dataclass(frozen=True)
class DenseNumbers:
    """Where a dense LU costs less than a sparse one."""

    rows: int = 100  # up to so many it does without bookkeeping [-]
    share: float = 0.3  # of entries [-]: the sparse LU of fuller matrices would be full anyway


DENSE = DenseNumbers()


class SingularSystem(ArithmeticError):
    """The matrix of a step could not be factored; the caller shifts it, or ends."""


class Factorisation(Protocol):
    """Factors ``A + B W`` for one W and many A, B (nc, dim, dim)."""

    flops: float  # about what one factorisation costs

    def factor(self, a: Floats, b: Floats) -> Solve:
        """What solves ``(A + B W) x = right`` for x.  Raises `SingularSystem`."""


def choose_factorisation(problem: FrictionProblem) -> Factorisation:
    """The cheaper one: by way of the bodies where they are known, unless W is small."""
    size = problem.contacts * problem.dim
    if problem.bodies is not None and size > DENSE.rows:
        return BodyFactorisation(problem)
    if size <= DENSE.rows or problem.delassus.nnz > DENSE.share * size * size:
        return DenseFactorisation(problem)
    return ContactFactorisation(problem)


class DenseFactorisation:
    """``A + B W`` as a full matrix, by LAPACK."""

    def __init__(self, problem: FrictionProblem) -> None:
        self.contacts, self.dim = problem.contacts, problem.dim
        if problem.matrix is None and problem.bodies is not None:
            bodies = problem.bodies
            self.matrix: Floats = sparse.build_dense_delassus(
                *sparse.split_csr(bodies.jacobian), *sparse.split_csr(bodies.inverse_mass)
            )
        else:
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
    """A sparse matrix of dense blocks at fixed places, filled and factored each time."""

    def __init__(self, count: int, size: int, rows: Ints, columns: Ints) -> None:
        """``count`` block rows of ``size`` rows each; blocks at (rows, columns)."""
        tree = self.tree = sparse.build_tree(count, size, rows, columns)
        self.space = np.empty(tree.rest_most), np.empty(tree.stack_most)
        self.spare: list[Floats] = []

    @property
    def flops(self) -> float:
        """About what one factorisation costs."""
        width = np.diff(self.tree.first).astype(float) * self.tree.size
        below = np.diff(self.tree.row_start).astype(float) * self.tree.size
        return float((((width + below) ** 3 - below**3) * 2.0 / 3.0).sum())

    def factor(self, blocks: Floats) -> Solve:
        """Factor the matrix with these blocks (entries, size, size).  Raises `SingularSystem`."""
        factors = self.allocate_factors()
        if not sparse.factor_fronts(self.tree, blocks, factors, *self.space):
            raise SingularSystem
        return self.bind_factors(
            lambda right: sparse.solve_fronts(self.tree, factors, right), factors
        )

    def allocate_factors(self) -> Floats:
        """Memory for factors: of what no one needs any more, as new memory costs more than it
        takes to fill it."""
        return self.spare.pop() if self.spare else np.empty(self.tree.factor_start[-1])

    def bind_factors(self, solve: Solve, factors: Floats) -> Solve:
        """``solve``, whose factors are free when it is."""
        weakref.finalize(solve, self.spare.append, factors).atexit = False
        return solve


class ContactFactorisation:
    """``A + B W`` as it stands: a row of blocks a contact."""

    def __init__(self, problem: FrictionProblem) -> None:
        contacts, dim = problem.contacts, problem.dim
        w = problem.delassus_blocks
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
        space, size = problem.bodies, problem.bodies.body_size
        bodies = self.bodies = space.jacobian.shape[1] // size
        self.dim = problem.dim
        self.first, self.body, self.block = problem.body_jacobians
        own = np.arange(bodies) * (bodies + 1)
        key = np.concatenate([own, sparse.list_body_pairs(self.first, self.body, bodies)])
        found, places = np.unique(key, return_inverse=True)
        self.system = BlockSystem(bodies, size, found // bodies, found % bodies)
        self.flops = self.system.flops
        self.mass = np.zeros((len(found), size, size))
        self.mass[places[:bodies]] = space.mass_blocks
        self.places, self.matrix = places[bodies:], np.empty_like(self.mass)

    def factor(self, a: Floats, b: Floats) -> Solve:
        """See `Factorisation`."""
        tree, factors = self.system.tree, self.system.allocate_factors()
        inverse, stiffness, regular = factor_contacts(
            tree, self.mass, self.first, self.block, self.places, a, b, self.matrix, factors,
            *self.system.space,
        )  # fmt: skip
        if not regular:
            raise SingularSystem

        def solve(right: Floats) -> Floats:
            left: Floats = solve_contacts(
                tree, factors, self.first, self.body, self.block, self.bodies, inverse, stiffness,
                right.reshape(-1, self.dim),
            )  # fmt: skip
            return left

        return self.system.bind_factors(solve, factors)


@njit(cache=True)
def factor_contacts(
    tree: sparse.EliminationTree, mass: Floats, first: Ints, block: Floats, places: Ints,
    a: Floats, b: Floats, matrix: Floats, factors: Floats, rest: Floats, stack: Floats,
) -> tuple[Floats, Floats, bool]:  # fmt: skip
    """``A^-1``, ``A^-1 B`` and the ``factors`` of ``M + J^T A^-1 B J``, and whether there are any.

    ``matrix``, ``rest``, ``stack``: space to work in.
    """
    inverse, stiffness, regular = sparse.find_contact_stiffness(a, b)
    if not regular:
        return inverse, stiffness, False
    matrix[:] = mass
    sparse.add_contacts(matrix, first, block, places, stiffness)
    return inverse, stiffness, sparse.factor_fronts(tree, matrix, factors, rest, stack)


@njit(cache=True)
def solve_contacts(
    tree: sparse.EliminationTree, factors: Floats, first: Ints, body: Ints, block: Floats,
    bodies: int, inverse: Floats, stiffness: Floats, right: Floats,
) -> Floats:  # fmt: skip
    """``dr = A^-1 (b - B J v)`` of the right-hand side b (nc, dim)."""
    force = sparse.multiply_blocks(inverse, right)
    push = sparse.push_bodies(first, body, block, bodies, force)
    return sparse.subtract_motion(
        first, body, block, stiffness, force, sparse.solve_fronts(tree, factors, push)
    )
