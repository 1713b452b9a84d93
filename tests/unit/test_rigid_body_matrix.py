"""Compiled kernels beside their plain NumPy and scipy twins."""

from __future__ import annotations

import sys

import numpy as np
import pytest
import scipy.sparse as sp

from rigid_lcp.sparse.body_matrix import (
    add_contacts,
    build_dense_delassus,
    find_contact_stiffness,
    find_diagonal_blocks,
    find_row_forms,
    list_body_pairs,
    multiply_blocks,
    multiply_csr,
    multiply_factors,
    multiply_transposed,
    push_bodies,
    split_csr,
    split_jacobian,
    subtract_motion,
)
from rigid_lcp.sparse.elimination_order import (
    ELIMINATION,
    count_flops,
    list_neighbours,
    order_by_degree,
    order_elimination,
)
from tests.rigid_networks import random_bodies, random_pairs

BODIES, CONTACTS = 7, 12


def some_bodies(dim: int) -> tuple[sp.csr_array, sp.csr_array]:
    """J of contacts between pairs of bodies, some with one only, and a full M^-1 of each."""
    g = np.random.default_rng(dim)
    made = random_bodies(random_pairs(CONTACTS, BODIES, g), BODIES, dim, g, full=True)
    return made.jacobian, made.inverse_mass


@pytest.mark.parametrize("dim", [2, 3])
def test_products_are_those_of_the_matrices(dim):
    jacobian, inverse = some_bodies(dim)
    g = np.random.default_rng(1)
    r, v = g.standard_normal(jacobian.shape[0]), g.standard_normal(jacobian.shape[1])
    w = (jacobian @ inverse @ jacobian.T).toarray()
    np.testing.assert_allclose(multiply_csr(*split_csr(jacobian), v), jacobian @ v, atol=1e-13)
    found = multiply_transposed(*split_csr(jacobian), len(v), r)
    np.testing.assert_allclose(found, jacobian.T @ r, atol=1e-13)
    both = (*split_csr(jacobian), *split_csr(inverse))
    np.testing.assert_allclose(multiply_factors(*both, r), w @ r, atol=1e-11)
    np.testing.assert_allclose(find_row_forms(*both, len(v)), np.diag(w), atol=1e-12)
    np.testing.assert_allclose(build_dense_delassus(*both), w, atol=1e-12)


def test_diagonals_of_w_with_masses_alone_and_columns_given_twice():
    """``J_i M^-1 J_i^T`` where M^-1 is diagonal, and of a row that names a column two times."""
    jacobian, _ = some_bodies(2)
    inverse = sp.csr_array(sp.diags_array(np.random.default_rng(5).uniform(1, 3, 3 * BODIES)))
    both = (*split_csr(jacobian), *split_csr(inverse))
    expected = np.diag((jacobian @ inverse @ jacobian.T).toarray())
    np.testing.assert_allclose(find_row_forms(*both, 3 * BODIES), expected, rtol=1e-13)
    value, index, start = np.array([1.0, 2.0, -4.0]), np.array([1, 1, 0]), np.array([0, 3])
    twice = find_row_forms(start, index, value, *split_csr(inverse), 3 * BODIES)
    first, second = inverse.diagonal()[:2]
    np.testing.assert_allclose(twice, [9.0 * second + 16.0 * first], rtol=1e-14)


@pytest.mark.parametrize("dim", [2, 3])
def test_blocks_of_the_jacobian_assemble_the_matrix_of_bodies(dim):
    """``J^T K J`` block by block, and the way there and back, ``J^T r`` and ``r - K J v``."""
    jacobian, inverse = some_bodies(dim)
    size, g = 3 * dim - 3, np.random.default_rng(2)
    first, body, block = split_jacobian(*split_csr(jacobian), dim, size)
    again = np.zeros(jacobian.shape)
    for c in range(CONTACTS):
        for k in range(first[c], first[c + 1]):
            rows, columns = slice(c * dim, (c + 1) * dim), body[k] * size
            again[rows, columns : columns + size] = block[k]
    np.testing.assert_array_equal(again, jacobian.toarray())
    stiffness = g.standard_normal((CONTACTS, dim, dim))
    full = sp.block_diag(list(stiffness)).toarray()
    keys, places = np.unique(list_body_pairs(first, body, BODIES), return_inverse=True)
    matrix = np.zeros((len(keys), size, size))
    add_contacts(matrix, first, block, places, stiffness)
    whole = np.zeros((BODIES, size, BODIES, size))
    whole[keys // BODIES, :, keys % BODIES, :] = matrix
    expected = jacobian.T @ full @ jacobian.toarray()
    np.testing.assert_allclose(whole.reshape(expected.shape), expected, atol=1e-12)
    r, v = g.standard_normal((CONTACTS, dim)), g.standard_normal(BODIES * size)
    pushed = push_bodies(first, body, block, BODIES, r)
    np.testing.assert_allclose(pushed, jacobian.T @ r.ravel(), atol=1e-13)
    left = subtract_motion(first, body, block, stiffness, r, v)
    np.testing.assert_allclose(left, r.ravel() - full @ (jacobian @ v), atol=1e-12)
    np.testing.assert_array_equal(
        find_diagonal_blocks(*split_csr(inverse), size)[3],
        inverse.toarray()[3 * size : 4 * size, 3 * size : 4 * size],
    )


@pytest.mark.parametrize("dim", [2, 3])
def test_small_inverses_keep_their_digits(dim):
    """Sizes of 1e-8 to 1e8, zeros on the diagonal: A^-1 A is one to round-off and condition."""
    g = np.random.default_rng(4)
    a = g.standard_normal((200, dim, dim)) * 10.0 ** g.uniform(-8, 8, (200, 1, 1))
    a[:50, 0, 0] = 0.0
    b = g.standard_normal((200, dim, dim))
    inverse, stiffness, regular = find_contact_stiffness(a, b)
    assert regular
    error = np.abs(np.matmul(inverse, a) - np.eye(dim)).max(axis=(1, 2))
    assert (error <= 20 * 2.2e-16 * np.linalg.cond(a)).all()
    np.testing.assert_allclose(stiffness, np.matmul(inverse, b), rtol=1e-12, atol=1e-300)
    a[7] = 0.0
    assert not find_contact_stiffness(a, b)[2]
    vectors = g.standard_normal((200, dim))
    twin = np.einsum("cij,cj->ci", b, vectors)
    np.testing.assert_allclose(multiply_blocks(b, vectors), twin, atol=1e-13)


@pytest.mark.parametrize("blocks", [1, 30, ELIMINATION.table_blocks + 50])
def test_the_pattern_is_symmetric_and_the_order_a_permutation(blocks):
    g = np.random.default_rng(blocks)
    rows, columns = g.integers(0, blocks, (2, 2 * blocks))
    start, neighbour = list_neighbours(blocks, rows, columns)
    twin = np.eye(blocks, dtype=bool)
    twin[rows, columns] = twin[columns, rows] = True
    found = sp.csr_array((np.ones(len(neighbour)), neighbour, start), (blocks, blocks))
    np.testing.assert_array_equal(found.toarray() > 0, twin)
    assert found.has_sorted_indices
    np.testing.assert_array_equal(np.sort(order_by_degree(start, neighbour)), np.arange(blocks))


def test_the_order_of_a_chain_fills_nothing_in():
    """A chain joined to a ring: its degree is at most 2 throughout, whatever the numbers."""
    blocks = 40
    name = np.random.default_rng(0).permutation(blocks)
    rows, columns = name, np.roll(name, 1)
    start, neighbour = list_neighbours(blocks, rows, columns)
    order = order_by_degree(start, neighbour)
    linked = np.zeros((blocks, blocks), dtype=bool)
    linked[rows, columns] = linked[columns, rows] = True
    for k in order:
        near = np.flatnonzero(linked[k])
        assert len(near) <= 2
        linked[near, k] = linked[k, near] = False
        linked[np.ix_(near, near)] |= ~np.eye(len(near), dtype=bool)


def cube(side: int) -> tuple[np.ndarray, np.ndarray]:
    """Pattern of blocks in a cube, each joined to its neighbours."""
    number = np.arange(side**3).reshape(side, side, side)
    before = [number.take(range(side - 1), axis).ravel() for axis in range(3)]
    behind = [number.take(range(1, side), axis).ravel() for axis in range(3)]
    return list_neighbours(side**3, np.concatenate(before), np.concatenate(behind))


def test_a_cube_is_dissected_where_that_costs_less(monkeypatch):
    """Blocks of 6 rows in a cube of 12: nested dissection takes 0.72 of the flops (0.9 asked); a
    chain has no fill and is not looked at twice; without METIS the order is that of before."""
    start, neighbour = cube(12)
    by_degree = order_by_degree(start, neighbour)
    found = order_elimination(start, neighbour, 6)
    np.testing.assert_array_equal(np.sort(found), np.arange(12**3))
    before, now = (count_flops(start, neighbour, o, 6) for o in (by_degree, found))
    assert before > ELIMINATION.dissected_flops
    assert now < 0.9 * before
    monkeypatch.setitem(sys.modules, "pymetis", None)
    np.testing.assert_array_equal(order_elimination(start, neighbour, 6), by_degree)


def test_the_flops_of_an_order_are_those_of_dense_columns():
    """A full matrix of n blocks of size k: ``2/3 (k n)^3`` to the first order in 1 / n."""
    blocks, size = 60, 3
    rows, columns = np.triu_indices(blocks, 1)
    start, neighbour = list_neighbours(blocks, rows, columns)
    flops = count_flops(start, neighbour, np.arange(blocks), size)
    assert flops == pytest.approx(2.0 / 3.0 * (size * blocks) ** 3, rel=2.0 / blocks)


@pytest.mark.parametrize(("dim", "size"), [(2, 3), (3, 6), (3, 3), (2, 6)])
def test_contacts_of_other_shapes_are_added_alike(dim, size):
    """Blocks that the compiler unrolls and blocks of other shapes: ``J_i^T K J_j`` by NumPy."""
    g = np.random.default_rng(4)
    first = np.array([0, 2, 3, 6])
    block = g.standard_normal((6, dim, size))
    stiffness = g.standard_normal((3, dim, dim))
    places = g.integers(0, 5, 4 + 1 + 9)
    matrix = g.standard_normal((5, size, size))
    expected, k = matrix.copy(), 0
    for c in range(3):
        for i in range(first[c], first[c + 1]):
            for j in range(first[c], first[c + 1]):
                expected[places[k]] += block[i].T @ stiffness[c] @ block[j]
                k += 1
    add_contacts(matrix, first, block, places, stiffness)
    np.testing.assert_allclose(matrix, expected, atol=1e-13)
