"""LU factors of a sparse matrix of dense blocks, front by front, with dense products.

A front holds the columns that are eliminated together (its pivots), and the rows that they reach;
what they leave on these rows goes to the front's parent (`rigid_lcp.sparse.elimination_tree`).

    front = [D, E; G, S],    D = L U,    left = S - (G U^-1) (L^-1 E)

Both sides are kept by the pivot: ``upper`` = [U, L^-1 E] and ``lower`` = [L^T, (G U^-1)^T], so that
the same few kernels (`rigid_lcp.sparse.dense_tiles`) make both, four pivots at a time.  Pivots and
rows are padded to multiples of four, with ones on the diagonal.

Nothing is exchanged.  That is safe where the symmetric part of the matrix is positive definite, and
good enough where a shift or a barrier keeps it regular: a zero pivot ends the factorisation, and
accuracy is the caller's to watch.  Exchanging rows inside D alone, or multiplying by inverses of D,
L or U, loses digits as stiff and soft directions meet in one body (1e-9 shift: 4 to 8 digits), so
the sides are found by substitution.  Nearly all the work is in products of dense matrices.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rigid_lcp.arrays import Floats, Ints
from rigid_lcp.sparse.dense_tiles import divide_rows, subtract_product
from rigid_lcp.sparse.elimination_tree import EliminationTree, round_up

Spots = NDArray[np.uint64]


@njit(cache=True)
def factor_fronts(
    tree: EliminationTree, blocks: Floats, factors: Floats, rest: Floats, stack: Floats
) -> bool:
    """Factors of the matrix with these entries (entries, size, size); False if it has none, as a
    pivot is zero or not finite.

    ``factors``, and space to work in: ``factor_start[-1]``, ``rest_most`` and ``stack_most``
    numbers of any value.
    """
    size, fronts = tree.size, len(tree.parent)
    waiting, triangles = np.empty(fronts, dtype=np.int64), np.empty((2, 16))
    spots = np.empty(tree.front_most, dtype=np.uint64)
    top = depth = 0
    for f in range(fronts):
        pivots = (tree.first[f + 1] - tree.first[f]) * size
        rows = (tree.row_start[f + 1] - tree.row_start[f]) * size
        p, r = round_up(pivots), round_up(rows)
        m = p + r
        begin, half = tree.factor_start[f], p * m
        factors[begin : begin + 2 * half] = 0.0
        rest[: r * r] = 0.0
        for i in range(pivots, p):
            factors[begin + i * (m + 1)] = 1.0
        for place in range(tree.entry_start[f], tree.entry_start[f + 1]):
            add_entry(
                factors, begin, p, m, pivots, tree.entry_row[place] * size,
                tree.entry_column[place] * size, blocks, tree.entry[place],
            )  # fmt: skip
        while depth > 0 and tree.parent[waiting[depth - 1]] == f:
            depth -= 1
            child = waiting[depth]
            places = tree.relative[tree.row_start[child] : tree.row_start[child + 1]]
            stride = round_up(len(places) * size)
            top -= stride * stride
            add_update(factors, begin, rest, stack, top, places, size, pivots, rows, spots)
        if not eliminate_pivots(factors, begin, pivots, p, m, triangles):
            return False
        if rows > 0:
            subtract_product(
                stack, top, rest, 0, r, factors, begin + half + p, m, factors, begin + p, m,
                pivots, r, r,
            )  # fmt: skip
            top += r * r
            waiting[depth] = f
            depth += 1
    return True


@njit(cache=True)
def add_entry(
    factors: Floats, begin: int, p: int, m: int, pivots: int, row: int, column: int, blocks: Floats,
    which: int,
) -> None:  # fmt: skip
    """Add a block at (row, column) of a front: one of the two is a pivot's.

    Of D, squares of four on its diagonal and what is right of them lie in ``upper``, the rest by
    columns in ``lower``.
    """
    size, gap, lower = blocks.shape[1], p - pivots, begin + p * m
    for i in range(size):
        for j in range(size):
            value = blocks[which, i, j]
            if row >= pivots:
                factors[lower + (column + j) * m + gap + row + i] += value
            elif column >= pivots:
                factors[begin + (row + i) * m + gap + column + j] += value
            elif column + j >= (row + i) // 4 * 4:
                factors[begin + (row + i) * m + column + j] += value
            else:
                factors[lower + (column + j) * m + row + i] += value


@njit(cache=True)
def add_update(
    factors: Floats, begin: int, rest: Floats, stack: Floats, top: int, places: Ints,
    size: int, pivots: int, rows: int, spots: Spots,
) -> None:  # fmt: skip
    """Add what a child left, from ``top`` of ``stack``, its blocks at ``places`` of the front.

    ``spots``: space for the place of each number.
    """
    p, r = round_up(pivots), round_up(rows)
    m, count = p + r, len(places) * size
    stride, inner = round_up(count), 0  # rows of it that are pivots here: the first, as they rise
    for k in range(len(places)):
        at = places[k] * size
        if at < pivots:
            inner += size
        else:
            at += p - pivots
        for i in range(size):
            spots[k * size + i] = at + i
    lower = begin + p * m
    for one in range(inner):
        row, source = int(spots[one]), top + one * stride
        square = row // 4 * 4
        for two in range(inner):
            column = int(spots[two])
            if column >= square:
                factors[begin + row * m + column] += stack[source + two]
            else:
                factors[lower + column * m + row] += stack[source + two]
        add_spots(factors, begin + row * m, spots, stack, source, inner, count)
    for one in range(inner, count):
        row, source = int(spots[one]), top + one * stride
        for two in range(inner):
            factors[lower + int(spots[two]) * m + row] += stack[source + two]
        add_spots(rest, (row - p) * r - p, spots, stack, source, inner, count)


@njit(cache=True)
def add_spots(
    target: Floats, base: int, spots: Spots, values: Floats, begin: int, first: int, end: int
) -> None:
    """``target[base + spots[k]] += values[begin + k]`` for k from ``first`` to ``end``."""
    to, at = np.uint64(base), np.uint64(begin)
    for k in range(np.uint64(first), np.uint64(end)):
        target[to + spots[k]] += values[at + k]


@njit(cache=True)
def eliminate_pivots(
    factors: Floats, begin: int, pivots: int, p: int, m: int, triangles: Floats
) -> bool:
    """``upper`` and ``lower`` of a front in place, four pivots at a time; False if one is zero."""
    half = p * m
    for k in range(0, p, 4):
        up, low = begin + k * m + k, begin + half + k * m + k
        top = begin + k
        subtract_product(
            factors, up, factors, up, m, factors, top + half, m, factors, top, m, k, 4, 4
        )
        if not factor_square(factors, up, low, m, triangles):
            return False
        beyond = m - k - 4
        if beyond > 0:
            divide_rows(
                factors, up + 4, m, factors, top + half, factors, top + 4, k, beyond, triangles[0]
            )
            divide_rows(
                factors, low + 4, m, factors, top, factors, top + half + 4, k, beyond, triangles[1]
            )
    return True


@njit(cache=True)
def factor_square(factors: Floats, up: int, low: int, stride: int, triangles: Floats) -> bool:
    """U of a (4, 4) square in its place, ``up``, and L^T at ``low``; False if it has none.

    ``triangles``: L and U^T, with the inverse of what is on their diagonals in its place.
    """
    for k in range(4):
        pivot = factors[up + k * stride + k]
        if not 0.0 < abs(pivot) < np.inf:
            return False
        triangles[0, 5 * k], triangles[1, 5 * k] = 1.0, 1.0 / pivot
        for i in range(k + 1, 4):
            share = factors[up + i * stride + k] / pivot
            factors[low + k * stride + i] = share
            triangles[0, 4 * i + k] = share
            triangles[1, 4 * i + k] = factors[up + k * stride + i]
            for j in range(k + 1, 4):
                factors[up + i * stride + j] -= share * factors[up + k * stride + j]
    return True


@njit(cache=True)
def solve_fronts(tree: EliminationTree, factors: Floats, right: Floats) -> Floats:
    """x of ``matrix x = right``, both (blocks * size,) in the caller's order."""
    size, fronts = tree.size, len(tree.parent)
    x = right.reshape(-1, size)[tree.order].ravel()
    space = np.empty(tree.front_most)
    for f in range(fronts):
        p, m = load_part(tree, f, x, space)
        lower = tree.factor_start[f] + p * m
        for k in range(0, p, 4):
            at = lower + k * m
            one, two, three, four = space[k], space[k + 1], space[k + 2], space[k + 3]
            two -= factors[at + k + 1] * one
            three -= factors[at + k + 2] * one + factors[at + m + k + 2] * two
            four -= factors[at + k + 3] * one + factors[at + m + k + 3] * two
            four -= factors[at + 2 * m + k + 3] * three
            space[k + 1], space[k + 2], space[k + 3] = two, three, four
            take_rows(
                space[k + 4 : m], factors[at + k + 4 : at + m],
                factors[at + m + k + 4 : at + 2 * m], factors[at + 2 * m + k + 4 : at + 3 * m],
                factors[at + 3 * m + k + 4 : at + 4 * m], one, two, three, four,
            )  # fmt: skip
        store_part(tree, f, x, space, m)
    for f in range(fronts - 1, -1, -1):
        p, m = load_part(tree, f, x, space)
        for k in range(p - 4, -1, -4):
            at = tree.factor_start[f] + k * m
            for i in range(3, -1, -1):
                row = factors[at + i * m + k : at + i * m + m]
                own = space[k + i] - multiply_rows(row[4:], space[k + 4 : m])
                for j in range(i + 1, 4):
                    own -= row[j] * space[k + j]
                space[k + i] = own / row[i]
        store_part(tree, f, x, space, p)
    solution = np.empty((len(x) // size, size))
    solution[tree.order] = x.reshape(-1, size)
    return solution.ravel()


@njit(cache=True)
def take_rows(
    values: Floats, a: Floats, b: Floats, c: Floats, d: Floats,
    one: float, two: float, three: float, four: float,
) -> None:  # fmt: skip
    """``values -= one a + two b + three c + four d``."""
    for j in range(len(values)):
        values[j] -= one * a[j] + two * b[j] + three * c[j] + four * d[j]


@njit(cache=True, fastmath={"reassoc", "contract"})
def multiply_rows(one: Floats, two: Floats) -> float:
    """Their inner product, in whatever order is fastest."""
    total = 0.0
    for j in range(len(one)):
        total += one[j] * two[j]
    return total


@njit(cache=True)
def load_part(tree: EliminationTree, f: int, x: Floats, space: Floats) -> tuple[int, int]:
    """Puts the numbers of x (blocks * size,) that a front works on in ``space``, padded with zeros;
    its padded pivots, and these with its padded rows."""
    size = tree.size
    begin, pivots = tree.first[f] * size, (tree.first[f + 1] - tree.first[f]) * size
    rows = tree.rows[tree.row_start[f] : tree.row_start[f + 1]]
    p = round_up(pivots)
    m = p + round_up(len(rows) * size)
    for i in range(pivots):
        space[i] = x[begin + i]
    for i in range(pivots, p):
        space[i] = 0.0
    for k in range(len(rows)):
        for i in range(size):
            space[p + k * size + i] = x[rows[k] * size + i]
    for i in range(p + len(rows) * size, m):
        space[i] = 0.0
    return p, m


@njit(cache=True)
def store_part(tree: EliminationTree, f: int, x: Floats, space: Floats, end: int) -> None:
    """Put back what `load_part` took, up to ``end`` of it: its pivots, or its rows too."""
    size = tree.size
    begin, pivots = tree.first[f] * size, (tree.first[f + 1] - tree.first[f]) * size
    rows = tree.rows[tree.row_start[f] : tree.row_start[f + 1]]
    for i in range(pivots):
        x[begin + i] = space[i]
    p = round_up(pivots)
    if end > p:
        for k in range(len(rows)):
            for i in range(size):
                x[rows[k] * size + i] = space[p + k * size + i]
