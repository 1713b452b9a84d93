"""A friction problem laid out contact after contact for kernels that visit one at a time.

By its bodies, ``W = B B^T`` with ``B = J L`` and ``M^-1 = L L^T``: each contact knows its two
bodies and two small blocks of B, so that a visit costs the same however many neighbours there are.
Scaled so, a body's velocities ``w = L^-1 v`` take up an impulse r as ``w += B^T r``: no mass is
left to multiply with.  Where only W is known its rows in dim x dim blocks do.
"""

import numpy as np
from numba import njit

from rigid_lcp.arrays import Floats, Ints
from rigid_lcp.friction.problem import BodySpace, FrictionProblem
from rigid_lcp.sparse import find_diagonal_blocks, split_csr


@njit(cache=True)
def add_impulses(body: Ints, block: Floats, force: Floats, velocity: Floats) -> None:
    """``w += B^T r``: changes ``velocity`` (bodies + 1, size) by the forces (nc, dim)."""
    for c in range(len(body)):
        bears = False  # few contacts of a bed in motion do
        for i in range(force.shape[1]):
            bears = bears or force[c, i] != 0.0
        if not bears:
            continue
        for side in range(2):
            moved = body[c, side]
            for i in range(force.shape[1]):
                for k in range(velocity.shape[1]):
                    velocity[moved, k] += block[c, side, i, k] * force[c, i]


@njit(cache=True)
def find_relative_velocities(body: Ints, block: Floats, velocity: Floats) -> Floats:
    """``B w`` of every contact, (nc, dim)."""
    relative = np.zeros((len(body), block.shape[2]))
    for c in range(len(body)):
        for side in range(2):
            moved = body[c, side]
            for i in range(relative.shape[1]):
                for k in range(velocity.shape[1]):
                    relative[c, i] += block[c, side, i, k] * velocity[moved, k]
    return relative


def lay_out_bodies(problem: FrictionProblem) -> tuple[Ints, Floats, Floats] | None:
    """``body`` (nc, 2), the number of bodies for none, ``block`` (nc, 2, dim, body_size), and the
    blocks on W's diagonal (nc, dim, dim); None if the factors of W are unknown or not those of
    pairs of bodies, or M^-1 is not positive semi-definite."""
    space = problem.bodies
    size, contacts = 3 * problem.dim - 3, problem.contacts
    if space is None or space.body_size != size or space.jacobian.shape[1] % size or not contacts:
        return None
    root = factor_inverse_mass(space)
    if root is None:
        return None
    made: tuple[Ints, Floats, Floats] | None = pair_blocks(*problem.body_jacobians, root)
    return made


@njit(cache=True)
def pair_blocks(
    first: Ints, moved: Ints, part: Floats, root: Floats
) -> tuple[Ints, Floats, Floats] | None:
    """`lay_out_bodies`, or None if a contact moves three bodies; a block of zeros moves none."""
    contacts, (dim, size) = len(first) - 1, part.shape[1:]
    body = np.full((contacts, 2), len(root))
    block, local = np.zeros((contacts, 2, dim, size)), np.zeros((contacts, dim, dim))
    diagonal = True
    for b in range(len(root)):
        for m in range(size):
            for n in range(size):
                diagonal = diagonal and (m == n or root[b, m, n] == 0.0)
    for c in range(contacts):
        side = 0
        for k in range(first[c], first[c + 1]):
            if not moves(part[k]):
                continue
            if side == 2:
                return None
            body[c, side] = moved[k]
            for i in range(dim):
                for m in range(size):
                    value = part[k, i, m]
                    if diagonal:
                        block[c, side, i, m] = value * root[moved[k], m, m]
                    elif value != 0.0:
                        for n in range(size):
                            block[c, side, i, n] += value * root[moved[k], m, n]
            for i in range(dim):
                for j in range(i + 1):
                    total = 0.0
                    for m in range(size):
                        total += block[c, side, i, m] * block[c, side, j, m]
                    local[c, i, j] += total
                    if j < i:
                        local[c, j, i] += total
            side += 1
    return body, block, local


@njit(cache=True)
def moves(part: Floats) -> bool:
    """Whether a block of J has an entry that is not zero."""
    for i in range(part.shape[0]):
        for m in range(part.shape[1]):
            if part[i, m] != 0.0:
                return True
    return False


def factor_inverse_mass(space: BodySpace) -> Floats | None:
    """L of every body with ``M^-1 = L L^T``, (bodies, size, size); None if M^-1 is no such thing.

    By eigenvectors, as a body that is held has zeros there.
    """
    mass = find_diagonal_blocks(*split_csr(space.inverse_mass), space.body_size)
    if np.count_nonzero(mass) != np.count_nonzero(space.inverse_mass.data):
        return None
    diagonal = np.einsum("bii->bi", mass)
    if np.count_nonzero(mass) == np.count_nonzero(diagonal):
        if (diagonal < 0).any():
            return None
        root = np.zeros_like(mass)
        np.einsum("bii->bi", root)[:] = np.sqrt(diagonal)
        return root
    scale = np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    values, vectors = np.linalg.eigh(mass / (scale[:, :, None] * scale[:, None, :]))
    if values.min() < -1e-12:
        return None
    return scale[:, :, None] * vectors * np.sqrt(np.maximum(values, 0.0))[:, None, :]


def lay_out_matrix(problem: FrictionProblem) -> tuple[Floats, Ints, Ints, Floats]:
    """Rows of W in blocks, ``block[start[c]:start[c + 1]]`` at contacts ``column``, and the blocks
    on the diagonal (nc, dim, dim), zeros if need be: ``local``, ``start``, ``column``, ``block``"""
    dim, contacts = problem.dim, problem.contacts
    blocks = problem.delassus_blocks if contacts else None
    if blocks is None:
        empty = np.zeros((0, dim, dim))
        return empty, np.zeros(1, dtype=np.int64), np.zeros(0, dtype=np.int64), empty
    row = np.repeat(np.arange(contacts), np.diff(blocks.indptr))
    own = row == blocks.indices
    local = np.zeros((contacts, dim, dim))
    local[row[own]] = blocks.data[own]
    start, column = blocks.indptr.astype(np.int64), blocks.indices.astype(np.int64)
    return local, start, column, np.ascontiguousarray(blocks.data)
