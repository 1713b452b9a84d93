"""LU factors of a sparse matrix of dense blocks, front by front, with dense products.

A front holds the columns that are eliminated together, and the rows that they reach; what they
leave on these rows goes to the front's parent (`rigid_lcp.elimination_tree`).  Inside a front the
columns go panel by panel, F = [D, E; G, H] with D a square of at most ``panel`` rows:

    D = L U,    next F = H - (G U^-1) (L^-1 E)

Nothing is exchanged.  That is safe where the symmetric part of the matrix is positive definite, and
good enough where a shift or a barrier keeps it regular: a zero pivot ends the factorisation, and
accuracy is the caller's to watch.  Exchanging rows inside D alone, or multiplying by inverses of D,
L or U, loses digits as stiff and soft directions meet in one body (1e-9 shift: 4 to 8 digits), so
the sides are found by substitution.  Nearly all the work is in products of dense matrices.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rigid_lcp.elimination_tree import EliminationTree

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@njit(cache=True)
def factor_fronts(tree: EliminationTree, blocks: Floats) -> tuple[Floats, bool]:
    """Factors of the matrix with these entries (entries, size, size), and whether it has them.

    It has none if a pivot is zero or not finite.
    """
    size, fronts = tree.size, len(tree.parent)
    factors = np.empty(tree.factor_start[fronts])
    space, stack = np.empty(tree.front_most), np.empty(tree.stack_most)
    waiting = np.empty(fronts, dtype=np.int64)
    top = depth = 0
    for f in range(fronts):
        p = (tree.first[f + 1] - tree.first[f]) * size
        r = (tree.row_start[f + 1] - tree.row_start[f]) * size
        front = space[: (p + r) ** 2].reshape(p + r, p + r)
        front[:] = 0.0
        for place in range(tree.entry_start[f], tree.entry_start[f + 1]):
            row, column = tree.entry_row[place] * size, tree.entry_column[place] * size
            for i in range(size):
                for j in range(size):
                    front[row + i, column + j] += blocks[tree.entry[place], i, j]
        while depth > 0 and tree.parent[waiting[depth - 1]] == f:
            depth -= 1
            child = waiting[depth]
            places = tree.relative[tree.row_start[child] : tree.row_start[child + 1]]
            rows = len(places) * size
            top -= rows * rows
            add_update(front, stack[top : top + rows * rows].reshape(rows, rows), places, size)
        left = stack[top : top + r * r].reshape(r, r)
        own = factors[tree.factor_start[f] : tree.factor_start[f + 1]]
        if not eliminate_columns(front, p, tree.panel, own, left):
            return factors, False
        if r > 0:
            top += r * r
            waiting[depth] = f
            depth += 1
    return factors, True


@njit(cache=True)
def add_update(front: Floats, update: Floats, places: Integers, size: int) -> None:
    """Add what a child left, its blocks at ``places`` of the front."""
    for row in range(len(places)):
        for i in range(size):
            target, source = front[places[row] * size + i], update[row * size + i]
            for column in range(len(places)):
                to, at = places[column] * size, column * size
                for j in range(size):
                    target[to + j] += source[at + j]


@njit(cache=True)
def panel_factors(
    factors: Floats, begin: int, width: int, beyond: int
) -> tuple[Floats, Floats, Floats, int]:
    """The numbers of one panel: L and U in one square, ``(G U^-1)^T``, ``L^-1 E``; their end."""
    one = begin + width * width
    two = one + width * beyond
    return (
        factors[begin:one].reshape(width, width),
        factors[one:two].reshape(width, beyond),
        factors[two : two + width * beyond].reshape(width, beyond),
        two + width * beyond,
    )


@njit(cache=True)
def eliminate_columns(front: Floats, p: int, panel: int, factors: Floats, left: Floats) -> bool:
    """Eliminate p columns of a front; their factors, and what is ``left`` on the other rows."""
    m = front.shape[0]
    r = m - p
    lower, upper = np.empty((p, r)), np.empty((p, r))
    at = 0
    for k in range(0, p, panel):
        end = min(p, k + panel)
        square, below, beside, at = panel_factors(factors, at, end - k, m - end)
        square[:] = front[k:end, k:end]
        if not factor_square(square):
            return False
        for i in range(m - end):
            for j in range(end - k):
                below[j, i] = front[end + i, k + j]
        beside[:] = front[k:end, end:]
        divide_sides(square, below, beside)
        if end < p:  # the other columns of the front; the rest is done at once below
            front[end:, end:p] -= np.dot(below.T, beside[:, : p - end].copy())
            front[end:p, p:] -= np.dot(below[:, : p - end].copy().T, beside[:, p - end :].copy())
        lower[k:end] = below[:, p - end :]
        upper[k:end] = beside[:, p - end :]
    if r > 0:
        np.dot(lower.T, upper, left)
        for i in range(r):
            for j in range(r):
                left[i, j] = front[p + i, p + j] - left[i, j]
    return True


@njit(cache=True)
def factor_square(square: Floats) -> bool:
    """L (unit diagonal, not stored) and U in place of a square; False if it has none."""
    for k in range(len(square)):
        pivot = square[k, k]
        if not 0.0 < abs(pivot) < np.inf:
            return False
        for i in range(k + 1, len(square)):
            share = square[i, k] / pivot
            square[i, k] = share
            if share != 0.0:
                for j in range(k + 1, len(square)):
                    square[i, j] -= share * square[k, j]
    return True


@njit(cache=True)
def divide_sides(square: Floats, below: Floats, beside: Floats) -> None:
    """``G U^-1`` (transposed) and ``L^-1 E`` in place of G and E, by substitution."""
    width, beyond = below.shape
    for k in range(width):
        scale = 1.0 / square[k, k]
        for j in range(beyond):
            below[k, j] *= scale
        for i in range(k + 1, width):
            one, two = square[k, i], square[i, k]
            if one != 0.0:
                for j in range(beyond):
                    below[i, j] -= one * below[k, j]
            if two != 0.0:
                for j in range(beyond):
                    beside[i, j] -= two * beside[k, j]


@njit(cache=True)
def solve_fronts(tree: EliminationTree, factors: Floats, right: Floats) -> Floats:
    """x of ``matrix x = right``, both (blocks * size,) in the caller's order."""
    size, panel, fronts = tree.size, tree.panel, len(tree.parent)
    x = right.reshape(-1, size)[tree.order].ravel()
    space = np.empty(int(np.sqrt(tree.front_most)) + 1)
    for f in range(fronts):
        part = front_part(tree, f, x, space)
        at, m = tree.factor_start[f], len(part)
        p = (tree.first[f + 1] - tree.first[f]) * size
        for k in range(0, p, panel):
            end = min(p, k + panel)
            width, beyond = end - k, m - end
            below = at + width * width
            for i in range(width):
                own = part[k + i]
                for j in range(i):
                    own -= factors[at + i * width + j] * part[k + j]
                part[k + i] = own
                row = factors[below + i * beyond : below + (i + 1) * beyond]
                take_row(part[end:], own, row)
            at = below + 2 * width * beyond
        keep_part(tree, f, x, part)
    for f in range(fronts - 1, -1, -1):
        part = front_part(tree, f, x, space)
        at, m = tree.factor_start[f + 1], len(part)
        p = (tree.first[f + 1] - tree.first[f]) * size
        for k in range((p - 1) // panel * panel, -1, -panel):
            end = min(p, k + panel)
            width, beyond = end - k, m - end
            beside = at - width * beyond
            at = beside - width * (width + beyond)
            for i in range(width - 1, -1, -1):
                row = factors[beside + i * beyond : beside + (i + 1) * beyond]
                own = part[k + i] - row_product(row, part[end:])
                for j in range(i + 1, width):
                    own -= factors[at + i * width + j] * part[k + j]
                part[k + i] = own / factors[at + i * width + i]
        keep_part(tree, f, x, part)
    solution = np.empty((len(x) // size, size))
    solution[tree.order] = x.reshape(-1, size)
    return solution.ravel()


@njit(cache=True)
def take_row(values: Floats, share: float, row: Floats) -> None:
    """``values -= share row``."""
    for j in range(len(row)):
        values[j] -= share * row[j]


@njit(cache=True, fastmath={"reassoc", "contract"})
def row_product(one: Floats, two: Floats) -> float:
    """Their inner product, in whatever order is fastest."""
    total = 0.0
    for j in range(len(one)):
        total += one[j] * two[j]
    return total


@njit(cache=True)
def front_part(tree: EliminationTree, f: int, x: Floats, space: Floats) -> Floats:
    """The numbers of x (blocks * size,) that a front works on, in ``space``."""
    size = tree.size
    begin, end = tree.first[f] * size, tree.first[f + 1] * size
    rows = tree.rows[tree.row_start[f] : tree.row_start[f + 1]]
    part = space[: end - begin + len(rows) * size]
    part[: end - begin] = x[begin:end]
    for k in range(len(rows)):
        for i in range(size):
            part[end - begin + k * size + i] = x[rows[k] * size + i]
    return part


@njit(cache=True)
def keep_part(tree: EliminationTree, f: int, x: Floats, part: Floats) -> None:
    """Put back what `front_part` took."""
    size = tree.size
    begin, end = tree.first[f] * size, tree.first[f + 1] * size
    rows = tree.rows[tree.row_start[f] : tree.row_start[f + 1]]
    x[begin:end] = part[: end - begin]
    for k in range(len(rows)):
        for i in range(size):
            x[rows[k] * size + i] = part[end - begin + k * size + i]
