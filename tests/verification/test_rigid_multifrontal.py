"""The block factorisation of the rigid solvers, against dense LU and against its definitions.

Where a bound is taken from theory it is that of LU without growth, a few round-offs of the size of
the matrix (Higham, Accuracy and Stability of Numerical Algorithms, section 9.3): diagonally
dominant and symmetric positive definite matrices have none.
"""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg

from rigid_lcp.friction.linear.factorisation import BlockSystem, SingularSystem
from rigid_lcp.sparse.dense_tiles import TERMS_AT_ONCE
from rigid_lcp.sparse.elimination_order import ELIMINATION, list_neighbours, order_by_degree
from rigid_lcp.sparse.elimination_tree import EliminationTree, build_tree
from rigid_lcp.sparse.multifrontal import factor_fronts, solve_fronts

ROUND_OFF = np.finfo(float).eps


def random_pattern(
    generator: np.random.Generator, blocks: int, links: int
) -> tuple[np.ndarray, np.ndarray]:
    """Blocks on the diagonal and some others, each place once."""
    one, two = generator.integers(0, blocks, (2, links))
    places = np.unique(np.concatenate([one * blocks + two, np.arange(blocks) * (blocks + 1)]))
    return places // blocks, places % blocks


def dominant(
    generator: np.random.Generator, blocks: int, size: int, rows: np.ndarray, columns: np.ndarray
) -> np.ndarray:
    """Non-symmetric blocks at random whose matrix is diagonally dominant by columns."""
    values = generator.uniform(-1.0, 1.0, (len(rows), size, size))
    total = np.zeros((blocks, size))
    np.add.at(total, columns, np.abs(values).sum(axis=1))
    own = np.flatnonzero(rows == columns)
    values[own] += np.einsum("ci,ij->cij", 1.0 + total[columns[own]], np.eye(size))
    return values


def full(blocks: int, rows: np.ndarray, columns: np.ndarray, values: np.ndarray) -> np.ndarray:
    size = values.shape[1]
    matrix = np.zeros((blocks, size, blocks, size))
    for row, column, value in zip(rows, columns, values, strict=True):
        matrix[row, :, column, :] += value
    return matrix.reshape(blocks * size, blocks * size)


def backward_error(matrix: np.ndarray, x: np.ndarray, right: np.ndarray) -> float:
    lack = np.linalg.norm(matrix @ x - right, np.inf)
    return float(lack / (np.linalg.norm(matrix, np.inf) * np.linalg.norm(x, np.inf)))


def test_fronts_wider_than_a_panel_and_split_ones():
    """A full matrix of 80 blocks of 6: one clique, split into fronts, each of several panels."""
    g = np.random.default_rng(0)
    blocks, size = 80, 6
    rows, columns = (k.ravel() for k in np.indices((blocks, blocks)))
    values = dominant(g, blocks, size, rows, columns)
    tree = build_tree(blocks, size, rows, columns)
    widths = np.diff(tree.first) * size
    assert len(widths) > 1
    assert widths.max() > TERMS_AT_ONCE
    factors, rest, stack = (
        np.full(numbers, np.nan)
        for numbers in (tree.factor_start[-1], tree.rest_most, tree.stack_most)
    )
    regular = factor_fronts(tree, values, factors, rest, stack)
    right = g.standard_normal(blocks * size)
    assert regular
    matrix = full(blocks, rows, columns, values)
    x = solve_fronts(tree, factors, right)
    assert backward_error(matrix, x, right) < 10 * blocks * size * ROUND_OFF
    np.testing.assert_allclose(x, np.linalg.solve(matrix, right), rtol=1e-10)


@pytest.mark.parametrize("seed", range(40))
def test_memory_of_any_content_is_filled_and_no_other_is_touched(seed):
    """Any pattern is solved to round-off.  Factors and space are used again: whatever they held
    does not matter (not a number here), all of the factors is written, and nothing beside them."""
    g = np.random.default_rng(seed)
    blocks, size, guard = int(g.integers(1, 90)), int(g.choice([1, 2, 3, 6])), 64
    rows, columns = random_pattern(g, blocks, int(g.integers(0, 400)))
    values = dominant(g, blocks, size, rows, columns)
    tree = build_tree(blocks, size, rows, columns)
    wanted = (tree.factor_start[-1], tree.rest_most, tree.stack_most)
    memory = [np.full(numbers + 2 * guard, 7.5) for numbers in wanted]
    factors, rest, stack = (each[guard:-guard] for each in memory)
    for part in (factors, rest, stack):
        part[:] = np.nan
    right = g.standard_normal(blocks * size)
    assert factor_fronts(tree, values, factors, rest, stack)
    x = solve_fronts(tree, factors, right)
    matrix = full(blocks, rows, columns, values)
    assert backward_error(matrix, x, right) < 10 * blocks * size * ROUND_OFF
    assert np.isfinite(factors).all()
    assert all((each[:guard] == 7.5).all() and (each[-guard:] == 7.5).all() for each in memory)


def grid(side: int) -> tuple[np.ndarray, np.ndarray]:
    """Places of the blocks of a square grid whose neighbours touch."""
    at = np.arange(side * side).reshape(side, side)
    one = np.concatenate([at[1:].ravel(), at[:, 1:].ravel()])
    two = np.concatenate([at[:-1].ravel(), at[:, :-1].ravel()])
    own = at.ravel()
    return np.concatenate([one, two, own]), np.concatenate([two, one, own])


def split_columns(tree: EliminationTree) -> list[set[int]]:
    """Rows of each column of the factors as the tree says, in the order of elimination."""
    found = []
    for f in range(len(tree.parent)):
        rows = tree.rows[tree.row_start[f] : tree.row_start[f + 1]].tolist()
        for k in range(tree.first[f], tree.first[f + 1]):
            found.append({*range(k + 1, int(tree.first[f + 1])), *rows})
    return found


@pytest.mark.parametrize("seed", range(5))
def test_the_tree_holds_the_rows_that_elimination_fills(seed):
    """Elimination of column k joins its rows to each other: done here on sets.

    The fronts hold all of these rows; where nothing is merged they hold no other (a path).
    """
    g = np.random.default_rng(seed)
    blocks = 40
    rows, columns = random_pattern(g, blocks, 80)
    tree = build_tree(blocks, 3, rows, columns)
    assert sorted(tree.order) == list(range(blocks))
    rank = np.argsort(tree.order)
    below: list[set[int]] = [set() for _ in range(blocks)]
    for i, j in zip(rank[rows].tolist(), rank[columns].tolist(), strict=True):
        if i != j:
            below[min(i, j)].add(max(i, j))
    for k in range(blocks):
        for i in below[k]:
            below[i] |= {j for j in below[k] if j > i}
    for filled, kept in zip(below, split_columns(tree), strict=True):
        assert filled <= kept
    assert (tree.parent[:-1] > np.arange(len(tree.parent) - 1)).sum() == (tree.parent >= 0).sum()


@pytest.mark.parametrize("side", [16, 32, 64])
def test_fill_grows_as_n_log_n_on_grids_and_not_faster(side):
    """Nested dissection of a grid leaves 31/4 n log2 n numbers in L to first order, twice that in
    L and U (George, SIAM J. Numer. Anal. 10 (1973) 345), n^1.5 by rows; minimum degree and merging
    stay below it."""
    rows, columns = grid(side)
    count = side * side
    numbers = build_tree(count, 3, rows, columns).factor_start[-1] / 9
    assert numbers < 2 * 31 / 4 * count * np.log2(count)


@pytest.mark.parametrize("arms", [50, ELIMINATION.table_blocks + 50])
def test_the_order_does_not_eliminate_a_hub_first(arms):
    """A star: the hub joins all arms if eliminated first; then the factors would be full."""
    hub = np.zeros(arms, dtype=int)
    tips = np.arange(1, arms + 1)
    rows, columns = np.concatenate([hub, tips]), np.concatenate([tips, hub])
    order = order_by_degree(*list_neighbours(arms + 1, rows, columns))
    assert 0 in order[-2:]


@pytest.mark.parametrize("stiffness", [1e3, 1e6, 1e9])
def test_stiff_and_soft_directions_in_one_block_keep_their_digits(stiffness):
    """``M + k J^T J`` with J of less rows than columns: k in some directions of a block, 1 in
    others.  Backward stable whatever k is, as Cholesky's factors are; with inverted pivot blocks
    the error would grow as k."""
    g = np.random.default_rng(3)
    blocks, size = 60, 6
    rows, columns = grid(8)
    keep = (rows < blocks) & (columns < blocks)
    rows, columns = rows[keep], columns[keep]
    jacobian = np.zeros((3 * keep.sum(), blocks * size))
    pairs = [(i, j) for i, j in zip(rows.tolist(), columns.tolist(), strict=True) if i < j]
    for k, (i, j) in enumerate(pairs):
        jacobian[3 * k : 3 * k + 3, size * i : size * i + size] = g.standard_normal((3, size))
        jacobian[3 * k : 3 * k + 3, size * j : size * j + size] = g.standard_normal((3, size))
    matrix = np.eye(blocks * size) + stiffness * jacobian.T @ jacobian
    values = np.array(
        [matrix[6 * i : 6 * i + 6, 6 * j : 6 * j + 6] for i, j in zip(rows, columns, strict=True)]
    )
    right = g.standard_normal(blocks * size)
    x = BlockSystem(blocks, size, rows, columns).factor(values)(right)
    assert backward_error(matrix, x, right) < 10 * ROUND_OFF
    exact = scipy.linalg.solve(matrix, right, assume_a="pos")
    assert np.linalg.norm(x - exact) < 1e-16 * 1e3 * stiffness * np.linalg.norm(exact)


def test_the_numbering_of_the_blocks_does_not_matter():
    g = np.random.default_rng(4)
    blocks, size = 49, 3
    rows, columns = grid(7)
    values = dominant(g, blocks, size, rows, columns)
    right = g.standard_normal((blocks, size))
    x = BlockSystem(blocks, size, rows, columns).factor(values)(right.ravel())
    other = g.permutation(blocks)
    turned = BlockSystem(blocks, size, other[rows], other[columns]).factor(values)
    swapped = np.empty_like(right)
    swapped[other] = right
    y = turned(swapped.ravel()).reshape(blocks, size)[other]
    np.testing.assert_allclose(y.ravel(), x, rtol=1e-11, atol=1e-13)


@pytest.mark.parametrize("bad", [0.0, np.nan, np.inf])
def test_a_pivot_that_is_zero_or_not_finite_is_named(bad):
    rows, columns = grid(3)
    values = dominant(np.random.default_rng(5), 9, 2, rows, columns)
    values[(rows == 4) | (columns == 4)] = bad
    with pytest.raises(SingularSystem):
        BlockSystem(9, 2, rows, columns).factor(values)


def test_no_blocks_at_all():
    none = np.zeros(0, dtype=np.int64)
    solve = BlockSystem(0, 3, none, none).factor(np.zeros((0, 3, 3)))
    assert len(solve(np.zeros(0))) == 0
