"""Order in which a sparse matrix of dense blocks is eliminated, so that little fills in.

The pattern is that of a symmetric matrix: the neighbours of each block.  Minimum degree first, and
where the factors cost much nested dissection too (METIS; Karypis and Kumar, SIAM J. Sci. Comput. 20
(1998) 359): beds of some thousand spheres are factored at 0.6 to 0.9 of the flops, plane beds at no
fewer.  The columns of the factors then form a tree (Liu, SIAM Review 34 (1992) 82), in whose
postorder each subtree is a run of columns.  `rigid_lcp.sparse.elimination_tree` makes the fronts of
it.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numba import njit
from scipy.sparse.linalg import splu

from rigid_lcp.arrays import Ints


@dataclass(frozen=True)
class EliminationNumbers:
    """Orders and fronts; costs are [flops] of a dense product."""

    table_blocks: int = 1000  # up to which the order is found by a full table [-]
    dissected_flops: float = 1e8
    """Cost of factors, some 10 ms, above which another order is looked for, in less than that."""
    front_columns: int = 192  # at most [-]: longer fronts are split, child under child
    front_cost: float = 2e4  # of a front, by calls and copies,
    entry_cost: float = 10.0  # and of each of its entries


ELIMINATION = EliminationNumbers()


@njit(cache=True)
def list_neighbours(blocks: int, rows: Ints, columns: Ints) -> tuple[Ints, Ints]:
    """Neighbours of each block, itself among them, rising: ``neighbour[start[i]:start[i + 1]]``."""
    start = np.zeros(blocks + 1, dtype=np.int64)
    for k in range(len(rows)):
        start[rows[k] + 1] += 1
        start[columns[k] + 1] += 1
    start = np.cumsum(start + 1) - 1  # one more for each block itself
    filled, every = start[:-1].copy(), np.empty(start[-1], dtype=np.int64)
    for i in range(blocks):
        every[filled[i]] = i
        filled[i] += 1
    for k in range(len(rows)):
        i, j = rows[k], columns[k]
        every[filled[i]], every[filled[j] + (i == j)] = j, i
        filled[i] += 1
        filled[j] += 1
    done = 0
    for i in range(blocks):
        own = np.unique(every[start[i] : start[i + 1]])
        every[done : done + len(own)] = own
        start[i] = done
        done += len(own)
    start[blocks] = done
    return start, every[:done].copy()


def order_elimination(start: Ints, neighbour: Ints, size: int) -> Ints:
    """Which block is eliminated at each place, (blocks,); ``size``: rows of a block."""
    order = order_by_degree(start, neighbour)
    flops = count_flops(start, neighbour, order, size)
    if flops > ELIMINATION.dissected_flops:
        other = order_by_dissection(start, neighbour)
        if other is not None and count_flops(start, neighbour, other, size) < flops:
            return other
    return order


def count_flops(start: Ints, neighbour: Ints, order: Ints, size: int) -> float:
    """About what LU factors cost in this order, column by column."""
    below = find_column_parents(start, neighbour, order)[1].astype(float)
    return float(2.0 * size**3 * (below * (below + 1.0) + 1.0 / 3.0).sum())


def order_by_dissection(start: Ints, neighbour: Ints) -> Ints | None:
    """Blocks in METIS's order of nested dissection; None where ``pymetis`` is not installed, as
    there are processors that it is not built for."""
    try:
        from pymetis import CSRAdjacency, nested_dissection
    except ImportError:
        return None
    blocks = len(start) - 1
    block = np.repeat(np.arange(blocks), np.diff(start))
    apart = neighbour != block  # METIS wants no block among its own neighbours
    begin = np.searchsorted(block[apart], np.arange(blocks + 1)).astype(np.int32)
    order, _ = nested_dissection(CSRAdjacency(begin, neighbour[apart].astype(np.int32)))
    return np.asarray(order, dtype=np.int64)


def order_by_degree(start: Ints, neighbour: Ints) -> Ints:
    """Blocks in an order of minimum degree: that of SuperLU (multiple), or for few blocks our own,
    which costs less than to call it."""
    blocks = len(start) - 1
    if blocks <= ELIMINATION.table_blocks:
        found: Ints = order_by_degree_dense(start, neighbour)
        return found
    graph = sp.csc_array((np.full(len(neighbour), -1.0), neighbour, start), (blocks, blocks))
    laplacian = graph + sp.diags_array(np.full(blocks, 2.0 * blocks))
    factors = splu(
        sp.csc_array(laplacian), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )  # fmt: skip
    return np.argsort(factors.perm_c).astype(np.int64)


@njit(cache=True)
def order_by_degree_dense(start: Ints, neighbour: Ints) -> Ints:
    """The same by a full table of neighbours, in the time of its size."""
    blocks = len(start) - 1
    linked = np.zeros((blocks, blocks), dtype=np.bool_)
    degree, order = np.zeros(blocks, dtype=np.int64), np.empty(blocks, dtype=np.int64)
    for i in range(blocks):
        for place in range(start[i], start[i + 1]):
            if neighbour[place] != i:
                linked[i, neighbour[place]] = True
                degree[i] += 1
    near = np.empty(blocks, dtype=np.int64)
    for k in range(blocks):
        least = np.argmin(degree)
        order[k] = least
        degree[least] = 2 * blocks  # gone
        count = 0
        for i in range(blocks):
            if linked[least, i]:
                near[count] = i
                linked[i, least] = False
                degree[i] -= 1
                count += 1
        for a in range(count):
            for b in range(count):
                if a != b and not linked[near[a], near[b]]:
                    linked[near[a], near[b]] = True
                    degree[near[a]] += 1
    return order


@njit(cache=True)
def find_column_parents(start: Ints, neighbour: Ints, order: Ints) -> tuple[Ints, Ints]:
    """Parent of each column of the factors (-1: none) and its rows below the diagonal."""
    blocks = len(order)
    rank = np.empty(blocks, dtype=np.int64)
    rank[order] = np.arange(blocks)
    parent = np.full(blocks, -1, dtype=np.int64)
    count = np.zeros(blocks, dtype=np.int64)
    ancestor = np.full(blocks, -1, dtype=np.int64)
    mark = np.full(blocks, -1, dtype=np.int64)
    for k in range(blocks):
        mark[k] = k
        for place in range(start[order[k]], start[order[k] + 1]):
            column = rank[neighbour[place]]
            if column >= k:
                continue
            i = column  # up to the root of what is joined already, which becomes a child of k
            while ancestor[i] != -1 and ancestor[i] != k:
                above = ancestor[i]
                ancestor[i] = k
                i = above
            if ancestor[i] == -1:
                ancestor[i] = k
                parent[i] = k
        for place in range(start[order[k]], start[order[k] + 1]):
            i = rank[neighbour[place]]
            while i < k and mark[i] != k:  # row k is in every column on the way up to k
                count[i] += 1
                mark[i] = k
                i = parent[i]
    return parent, count


@njit(cache=True)
def find_postorder(parent: Ints) -> Ints:
    """Columns so that each subtree is a run that ends with its root."""
    blocks = len(parent)
    child, sister = np.full(blocks, -1), np.full(blocks, -1)
    for k in range(blocks - 1, -1, -1):
        if parent[k] >= 0:
            sister[k] = child[parent[k]]
            child[parent[k]] = k
    after, waiting = np.empty(blocks, dtype=np.int64), np.empty(blocks, dtype=np.int64)
    done = 0
    for root in range(blocks):
        if parent[root] >= 0:
            continue
        depth = 1
        waiting[0] = root
        while depth > 0:
            k = waiting[depth - 1]
            if child[k] >= 0:
                waiting[depth] = child[k]
                child[k] = sister[child[k]]
                depth += 1
            else:
                after[done] = k
                done += 1
                depth -= 1
    return after
