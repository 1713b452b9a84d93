"""Tree of fronts by which a sparse matrix of dense blocks is eliminated.

Block column j of the factors has the rows of the matrix's column j and those of every column whose
parent is j (its first row below the diagonal).  Columns that follow each other and have nearly the
same rows are eliminated together, as one dense *front*; what a front leaves on its rows is added to
its parent's (Duff and Reid, ACM TOMS 9 (1983) 302; Liu, SIAM Review 34 (1992) 82).  Fronts are
merged where one larger front costs less than two, empty places included (`find_front_cost`), and
those of more than `FRONT_COLUMNS` split.  All of it depends on the pattern alone and is found once.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from rigid_lcp.arrays import Ints
from rigid_lcp.sparse.dense_tiles import TILE
from rigid_lcp.sparse.elimination_order import (
    ELIMINATION,
    find_column_parents,
    find_postorder,
    list_neighbours,
    order_elimination,
)

FRONT_COLUMNS = ELIMINATION.front_columns
FRONT_COST, ENTRY_COST = ELIMINATION.front_cost, ELIMINATION.entry_cost


class EliminationTree(NamedTuple):
    """Fronts in the order in which they are eliminated, children before parents."""

    size: int  # rows of a block
    order: Ints  # which block of the caller's is eliminated at each place, (blocks,)
    first: Ints  # first block column of each front, and the end of the last, (fronts + 1,)
    row_start: Ints
    rows: Ints
    """Block rows below the columns of front f, rising: ``rows[row_start[f]:row_start[f + 1]]``."""
    relative: Ints
    """Places of the same rows in the parent's front (columns first, then rows), in blocks."""
    parent: Ints  # (fronts,), -1 for a root
    entry_start: Ints
    entry: Ints  # which blocks of the matrix are added to front f: ``entry[entry_start[f]:...]``
    entry_row: Ints
    entry_column: Ints  # their places in it
    factor_start: Ints  # where the numbers of each front's factors begin, (fronts + 1,)
    front_most: int
    rest_most: int
    stack_most: int
    """Most padded columns and rows of a front; most numbers on the rows of one, and in all updates
    that wait at one time."""


def build_tree(blocks: int, size: int, rows: Ints, columns: Ints) -> EliminationTree:
    """The tree of a matrix of ``blocks`` block rows with entries at (rows, columns).

    ``size``: rows of a block.  The pattern is taken for symmetric: where (i, j) is an entry, (j, i)
    may become one.
    """
    start, neighbour = list_neighbours(blocks, np.asarray(rows), np.asarray(columns))
    order = order_elimination(start, neighbour, size)
    parent, count = find_column_parents(start, neighbour, order)
    after = find_postorder(parent)
    order = order[after]
    parent, count = find_column_parents(start, neighbour, order)
    first = merge_columns(parent, count, size)
    row_start, found, above = find_front_rows(start, neighbour, order, first, count)
    relative = find_places_in_parent(first, row_start, found, above)
    rank = np.empty(blocks, dtype=np.int64)
    rank[order] = np.arange(blocks)
    front, row, column = find_entry_places(rank[rows], rank[columns], first, row_start, found)
    by_front = np.argsort(front, kind="stable")
    entry_start = np.searchsorted(front[by_front], np.arange(len(first)))
    pivots, below = np.diff(first) * size, np.diff(row_start) * size
    p, r = (-(-numbers // TILE) * TILE for numbers in (pivots, below))
    factor_start = np.concatenate([[0], np.cumsum(2 * p * (p + r))])
    return EliminationTree(
        size, order, first, row_start, found, relative, above, entry_start, by_front,
        row[by_front], column[by_front], factor_start, int((p + r).max(initial=0)),
        int((r**2).max(initial=0)), measure_stack(above, r),
    )  # fmt: skip


@njit(cache=True)
def round_up(count: int) -> int:
    """The next multiple of `TILE`."""
    return (count + TILE - 1) // TILE * TILE


@njit(cache=True)
def find_front_cost(width: int, below: int, size: int) -> float:
    """Flops that a front of so many block columns and rows below them is worth."""
    m, r = float((width + below) * size), float(below * size)
    return FRONT_COST + ENTRY_COST * m * m + (m**3 - r**3) * 2.0 / 3.0


@njit(cache=True)
def merge_columns(parent: Ints, count: Ints, size: int) -> Ints:
    """First column of each front (fronts + 1,): a front is merged with its last child if cheaper.

    ``parent``, ``count``: of the columns in postorder.
    """
    blocks = len(parent)
    begin = np.empty(blocks, dtype=np.int64)
    fronts = 0
    for k in range(blocks):
        first = k
        while fronts > 0 and first <= parent[first - 1] <= k:
            child = begin[fronts - 1]
            below = count[first - 1]
            together = find_front_cost(k + 1 - child, count[k], size)
            apart = find_front_cost(first - child, below, size)
            apart += find_front_cost(k + 1 - first, count[k], size)
            if together > apart:
                break
            first = child
            fronts -= 1
        begin[fronts] = first
        fronts += 1
    most = max(1, FRONT_COLUMNS // size)
    split = np.empty(blocks + 1, dtype=np.int64)
    done = 0
    for f in range(fronts):
        end = begin[f + 1] if f + 1 < fronts else blocks
        pieces = (end - begin[f] + most - 1) // most
        for piece in range(pieces):
            split[done] = begin[f] + piece * (end - begin[f]) // pieces
            done += 1
    split[done] = blocks
    return split[: done + 1].copy()


@njit(cache=True)
def find_front_rows(
    start: Ints, neighbour: Ints, order: Ints, first: Ints, count: Ints
) -> tuple[Ints, Ints, Ints]:
    """Rows of every front below its columns (``row_start``, ``rows``), and its parent."""
    blocks, fronts = len(order), len(first) - 1
    rank = np.empty(blocks, dtype=np.int64)
    rank[order] = np.arange(blocks)
    row_start = np.zeros(fronts + 1, dtype=np.int64)
    front_of = np.empty(blocks, dtype=np.int64)
    for f in range(fronts):
        row_start[f + 1] = row_start[f] + count[first[f + 1] - 1]  # a front has its last's rows
        front_of[first[f] : first[f + 1]] = f
    rows = np.empty(row_start[fronts], dtype=np.int64)
    parent = np.full(fronts, -1, dtype=np.int64)
    child, sister = np.full(fronts, -1), np.full(fronts, -1)
    mark = np.full(blocks, -1)
    for f in range(fronts):
        end, filled = first[f + 1], row_start[f]
        for k in range(first[f], end):
            for place in range(start[order[k]], start[order[k] + 1]):
                row = rank[neighbour[place]]
                if row >= end and mark[row] != f:
                    mark[row] = f
                    rows[filled] = row
                    filled += 1
        c = child[f]
        while c >= 0:
            for place in range(row_start[c], row_start[c + 1]):
                row = rows[place]
                if row >= end and mark[row] != f:
                    mark[row] = f
                    rows[filled] = row
                    filled += 1
            c = sister[c]
        rows[row_start[f] : filled].sort()
        if filled > row_start[f]:
            above = front_of[rows[row_start[f]]]
            parent[f] = above
            sister[f] = child[above]
            child[above] = f
    return row_start, rows, parent


@njit(cache=True)
def find_places_in_parent(first: Ints, row_start: Ints, rows: Ints, parent: Ints) -> Ints:
    """Where each row of a front is in its parent's front."""
    relative = np.empty(len(rows), dtype=np.int64)
    for f in range(len(parent)):
        for place in range(row_start[f], row_start[f + 1]):
            relative[place] = place_in_front(rows[place], parent[f], first, row_start, rows)
    return relative


@njit(cache=True)
def place_in_front(row: int, front: int, first: Ints, row_start: Ints, rows: Ints) -> int:
    """Place of a block row among a front's columns and rows."""
    if row < first[front + 1]:
        return row - first[front]
    own = rows[row_start[front] : row_start[front + 1]]
    return first[front + 1] - first[front] + np.searchsorted(own, row)


@njit(cache=True)
def find_entry_places(
    rows: Ints, columns: Ints, first: Ints, row_start: Ints, found: Ints
) -> tuple[Ints, Ints, Ints]:
    """Front to which each block (rows, columns) is added, and its place in it."""
    entries = len(rows)
    front = np.empty(entries, dtype=np.int64)
    row, column = np.empty(entries, dtype=np.int64), np.empty(entries, dtype=np.int64)
    owner = np.empty(first[-1], dtype=np.int64)
    for f in range(len(first) - 1):
        owner[first[f] : first[f + 1]] = f
    for k in range(entries):
        f = owner[min(rows[k], columns[k])]
        front[k] = f
        row[k] = place_in_front(rows[k], f, first, row_start, found)
        column[k] = place_in_front(columns[k], f, first, row_start, found)
    return front, row, column


@njit(cache=True)
def measure_stack(parent: Ints, below: Ints) -> int:
    """Most numbers that wait on the stack of updates."""
    waiting = np.zeros(len(parent) + 1, dtype=np.int64)
    now = most = 0
    for f in range(len(parent)):
        now += below[f] ** 2 - waiting[f]
        most = max(most, now)
        if parent[f] >= 0:
            waiting[parent[f]] += below[f] ** 2
    return most
