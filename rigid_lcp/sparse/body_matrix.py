"""Kernels of the matrix of bodies, ``M + J^T A^-1 B J``: J in blocks, assembly, back to contacts.

J is kept as one (dim, size) block for each body that a contact moves: those of contact c are
``block[first[c]:first[c + 1]]``, of the bodies ``body``.  Products with sparse matrices by rows
(`split_csr`) are compiled: scipy's spend more on small ones in calls.
"""

from typing import Any

import numpy as np
import scipy.sparse as sp
from numba import njit
from numpy.typing import NDArray

from rigid_lcp.arrays import Floats, Ints

Indices = NDArray[Any]


def split_csr(rows: sp.csr_array) -> tuple[Indices, Indices, Floats]:
    """Where each row begins, the columns and the values of a matrix by rows."""
    return rows.indptr, rows.indices, rows.data


@njit(cache=True)
def multiply_csr(start: Indices, index: Indices, value: Floats, x: Floats) -> Floats:
    """``A x``, (rows of A,)."""
    product = np.empty(len(start) - 1)
    for i in range(len(product)):
        total = 0.0
        for k in range(start[i], start[i + 1]):
            total += value[k] * x[index[k]]
        product[i] = total
    return product


@njit(cache=True)
def multiply_transposed(
    start: Indices, index: Indices, value: Floats, columns: int, y: Floats
) -> Floats:
    """``A^T y``, (columns of A,)."""
    product = np.zeros(columns)
    for i in range(len(start) - 1):
        for k in range(start[i], start[i + 1]):
            product[index[k]] += value[k] * y[i]
    return product


@njit(cache=True)
def multiply_factors(
    start: Indices, index: Indices, value: Floats,
    mass_start: Indices, mass_index: Indices, inverse_mass: Floats, force: Floats,
) -> Floats:  # fmt: skip
    """``J M^-1 J^T r``, (rows of J,); both matrices by rows."""
    impulse = multiply_transposed(start, index, value, len(mass_start) - 1, force)
    velocity = multiply_csr(mass_start, mass_index, inverse_mass, impulse)
    return multiply_csr(start, index, value, velocity)


@njit(cache=True)
def find_row_forms(
    start: Indices, index: Indices, value: Floats,
    mass_start: Indices, mass_index: Indices, inverse_mass: Floats, freedoms: int,
) -> Floats:  # fmt: skip
    """``J_i M^-1 J_i^T`` of every row i of J; both matrices by rows, M^-1 symmetric."""
    found, row = np.zeros(len(start) - 1), np.zeros(freedoms)
    for i in range(len(found)):
        single, before = True, -1  # every column once, with an entry on M^-1's diagonal only
        for k in range(start[i], start[i + 1]):
            column = index[k]
            m = mass_start[column]
            single = column > before and mass_start[column + 1] == m + 1 and mass_index[m] == column
            if not single:
                break
            found[i] += value[k] * inverse_mass[m] * value[k]
            before = column
        if single:
            continue
        found[i] = 0.0
        for k in range(start[i], start[i + 1]):
            row[index[k]] += value[k]
        for k in range(start[i], start[i + 1]):
            for m in range(mass_start[index[k]], mass_start[index[k] + 1]):
                found[i] += value[k] * inverse_mass[m] * row[mass_index[m]]
        for k in range(start[i], start[i + 1]):
            row[index[k]] = 0.0
    return found


@njit(cache=True)
def split_jacobian(
    start: Indices, index: Indices, value: Floats, dim: int, size: int
) -> tuple[Ints, Ints, Floats]:
    """``first``, ``body`` and ``block`` of J, which is given by rows."""
    contacts = (len(start) - 1) // dim
    first = np.zeros(contacts + 1, dtype=np.int64)
    body = np.empty(len(index), dtype=np.int64)
    place = np.empty(len(index), dtype=np.int64)
    count = 0
    for c in range(contacts):
        at = count
        for k in range(start[c * dim], start[c * dim + dim]):
            moved = index[k] // size
            if at == count or body[at] != moved:  # entries of a body lie side by side, mostly
                at = first[c]
                while at < count and body[at] != moved:
                    at += 1
                if at == count:
                    body[at] = moved
                    count += 1
            place[k] = at
        first[c + 1] = count
    block = np.zeros((count, dim, size))
    for c in range(contacts):
        for i in range(dim):
            for k in range(start[c * dim + i], start[c * dim + i + 1]):
                block[place[k], i, index[k] - body[place[k]] * size] += value[k]
    return first, body[:count].copy(), block


@njit(cache=True)
def find_diagonal_blocks(start: Indices, index: Indices, value: Floats, size: int) -> Floats:
    """The (size, size) blocks on the diagonal of a matrix by rows; what else it has is left."""
    blocks = np.zeros(((len(start) - 1) // size, size, size))
    for i in range(len(start) - 1):
        own = i // size
        for k in range(start[i], start[i + 1]):
            if index[k] // size == own:
                blocks[own, i - own * size, index[k] - own * size] += value[k]
    return blocks


@njit(cache=True)
def list_body_pairs(first: Ints, body: Ints, bodies: int) -> Ints:
    """``row * bodies + column`` of every block that a contact adds to, as `add_contacts` goes."""
    total = 0
    for c in range(len(first) - 1):
        total += (first[c + 1] - first[c]) ** 2
    keys = np.empty(total, dtype=np.int64)
    k = 0
    for c in range(len(first) - 1):
        for i in range(first[c], first[c + 1]):
            for j in range(first[c], first[c + 1]):
                keys[k] = body[i] * bodies + body[j]
                k += 1
    return keys


@njit(cache=True)
def invert_block(block: Floats, inverse: Floats) -> bool:
    """Gauss and Jordan with row exchanges; ``block`` is lost. False if it is singular."""
    dim = len(block)
    for i in range(dim):
        for j in range(dim):
            inverse[i, j] = 1.0 if i == j else 0.0
    for k in range(dim):
        pivot = k
        for i in range(k + 1, dim):
            if abs(block[i, k]) > abs(block[pivot, k]):
                pivot = i
        if not 0.0 < abs(block[pivot, k]) < np.inf:
            return False
        for j in range(dim):
            block[k, j], block[pivot, j] = block[pivot, j], block[k, j]
            inverse[k, j], inverse[pivot, j] = inverse[pivot, j], inverse[k, j]
        scale = 1.0 / block[k, k]
        for j in range(dim):
            block[k, j] *= scale
            inverse[k, j] *= scale
        for i in range(dim):
            share = block[i, k]
            if i != k and share != 0.0:
                for j in range(dim):
                    block[i, j] -= share * block[k, j]
                    inverse[i, j] -= share * inverse[k, j]
    return True


@njit(cache=True)
def find_contact_stiffness(a: Floats, b: Floats) -> tuple[Floats, Floats, bool]:
    """``A^-1`` and ``A^-1 B`` of every contact, (nc, dim, dim), and whether every A has one."""
    contacts, dim = a.shape[:2]
    inverse, stiffness = np.empty(a.shape), np.zeros(a.shape)
    space = np.empty((dim, dim))
    for c in range(contacts):
        space[:] = a[c]
        if not invert_block(space, inverse[c]):
            return inverse, stiffness, False
        for i in range(dim):
            for k in range(dim):
                for j in range(dim):
                    stiffness[c, i, j] += inverse[c, i, k] * b[c, k, j]
    return inverse, stiffness, True


def _make_adder(dim: int, size: int) -> Any:
    """The kernel below for blocks of so many rows and columns, whose loops the compiler unrolls; of
    any where these are zero."""

    @njit(cache=True)
    def add(matrix: Floats, first: Ints, block: Floats, places: Ints, stiffness: Floats) -> None:
        rows = dim if dim > 0 else block.shape[1]
        columns = size if size > 0 else block.shape[2]
        half = np.empty((columns, rows))
        k = 0
        for c in range(len(first) - 1):
            for i in range(first[c], first[c + 1]):
                for m in range(columns):
                    for b in range(rows):
                        half[m, b] = 0.0
                        for a in range(rows):
                            half[m, b] += block[i, a, m] * stiffness[c, a, b]
                for j in range(first[c], first[c + 1]):
                    at = places[k]
                    for m in range(columns):
                        for n in range(columns):
                            total = matrix[at, m, n]
                            for b in range(rows):
                                total += half[m, b] * block[j, b, n]
                            matrix[at, m, n] = total
                    k += 1

    return add


_add_2d, _add_3d, _add_any = (_make_adder(*shape) for shape in ((2, 3), (3, 6), (0, 0)))


@njit(cache=True)
def add_contacts(
    matrix: Floats, first: Ints, block: Floats, places: Ints, stiffness: Floats
) -> None:
    """Add ``J_c^T K_c J_c`` of every contact, ``K = A^-1 B``, to the blocks of the body matrix."""
    if block.shape[1:] == (2, 3):
        _add_2d(matrix, first, block, places, stiffness)
    elif block.shape[1:] == (3, 6):
        _add_3d(matrix, first, block, places, stiffness)
    else:
        _add_any(matrix, first, block, places, stiffness)


@njit(cache=True)
def push_bodies(first: Ints, body: Ints, block: Floats, bodies: int, force: Floats) -> Floats:
    """``J^T r``, (bodies * size,), of forces r (nc, dim)."""
    dim, size = block.shape[1:]
    push = np.zeros((bodies, size))
    for c in range(len(first) - 1):
        for k in range(first[c], first[c + 1]):
            for i in range(dim):
                for m in range(size):
                    push[body[k], m] += block[k, i, m] * force[c, i]
    return push.ravel()


@njit(cache=True)
def subtract_motion(
    first: Ints, body: Ints, block: Floats, stiffness: Floats, force: Floats,
    velocity: Floats,
) -> Floats:  # fmt: skip
    """``r - K J v``, (nc * dim,), of forces r (nc, dim) and velocities v (bodies * size,)."""
    dim, size = block.shape[1:]
    left = force.copy()
    relative = np.empty(dim)
    for c in range(len(first) - 1):
        relative[:] = 0.0
        for k in range(first[c], first[c + 1]):
            for i in range(dim):
                for m in range(size):
                    relative[i] += block[k, i, m] * velocity[body[k] * size + m]
        for i in range(dim):
            for j in range(dim):
                left[c, i] -= stiffness[c, i, j] * relative[j]
    return left.ravel()


@njit(cache=True)
def multiply_blocks(blocks: Floats, vectors: Floats) -> Floats:
    """A block (nc, dim, dim) a contact times its vector, (nc, dim)."""
    product = np.zeros(vectors.shape)
    for c in range(blocks.shape[0]):
        for i in range(blocks.shape[1]):
            for j in range(blocks.shape[2]):
                product[c, i] += blocks[c, i, j] * vectors[c, j]
    return product


@njit(cache=True)
def build_dense_delassus(
    start: Indices, index: Indices, value: Floats,
    mass_start: Indices, mass_index: Indices, inverse_mass: Floats,
) -> Floats:  # fmt: skip
    """``J M^-1 J^T`` as a full matrix; both matrices by rows, M^-1 symmetric."""
    rows = len(start) - 1
    w, spread = np.empty((rows, rows)), np.zeros(len(mass_start) - 1)
    for i in range(rows):
        spread[:] = 0.0
        for k in range(start[i], start[i + 1]):
            for m in range(mass_start[index[k]], mass_start[index[k] + 1]):
                spread[mass_index[m]] += value[k] * inverse_mass[m]
        for j in range(rows):
            total = 0.0
            for k in range(start[j], start[j + 1]):
                total += value[k] * spread[index[k]]
            w[i, j] = total
    return w
