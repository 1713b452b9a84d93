"""Islands: found by W and by bodies, solved apart, put together, however they are numbered."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse.csgraph import connected_components

from rigid_lcp.friction.auto.islands import cut_out_island, find_islands, solve_islands
from rigid_lcp.friction.methods.gauss_seidel import solve_gauss_seidel
from rigid_lcp.friction.problem.definition import BodySpace, FrictionProblem, make_problem
from tests.rigid_networks import random_bodies


def three_islands(dim: int) -> FrictionProblem:
    """Contacts 0, 3 on bodies 0, 1; contacts 1, 4 on bodies 3, 2; contact 2 on body 4 alone."""
    pairs = [(0, -1), (3, 2), (4, -1), (1, 0), (2, -1)]
    space = random_bodies(pairs, 5, dim, np.random.default_rng(3))
    offset = np.tile([-1.0, 0.4, -0.2][:dim], 5)
    problem = make_problem(space, offset, 0.4, dim)
    assert isinstance(problem, FrictionProblem)
    return problem


def as_matrix(problem: FrictionProblem) -> FrictionProblem:
    """The same problem with W only."""
    assert problem.bodies is not None
    return FrictionProblem(problem.bodies.matrix, problem.offset, problem.friction, problem.dim)


def test_ground_and_held_bodies_join_nothing() -> None:
    """Two boxes on a third that is held: its inverse mass is zero, W has no entry between them."""
    space = random_bodies([(0, 1), (2, 1)], 3, 2, np.random.default_rng(0))
    held = space.inverse_mass.toarray()
    held[3:6, 3:6] = 0.0
    space = BodySpace(space.jacobian, sp.csr_array(held), 3)
    problem = FrictionProblem(None, np.zeros(4), np.zeros(2), 2, space)
    assert [part.tolist() for part in find_islands(problem)] == [[0], [1]]


def test_no_contacts() -> None:
    problem = FrictionProblem(sp.csr_array((0, 0)), np.zeros(0), np.zeros(0), 2)
    assert find_islands(problem) == []
    assert solve_islands(problem, solve_gauss_seidel).solved


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("factors", [True, False])
def test_island_problem_has_the_rows_of_the_whole(dim: int, factors: bool) -> None:
    problem = three_islands(dim) if factors else as_matrix(three_islands(dim))
    part = np.array([1, 4])
    rows = (part[:, None] * dim + np.arange(dim)).ravel()
    alone = cut_out_island(problem, part)
    whole = problem.delassus.toarray()
    np.testing.assert_allclose(alone.delassus.toarray(), whole[np.ix_(rows, rows)], atol=1e-14)
    if alone.bodies is not None:
        assert alone.bodies.jacobian.shape[1] == 2 * alone.bodies.body_size
    np.testing.assert_array_equal(alone.offset, problem.offset[rows])


@settings(max_examples=25)
@given(
    st.lists(st.tuples(st.integers(-1, 7), st.integers(-1, 7)), min_size=1, max_size=10),
    st.integers(0, 10**6),
    st.sampled_from([2, 3]),
)
def test_same_answer_apart_and_however_numbered(pairs, seed, dim):
    """Solved apart every contact obeys Coulomb's law, and the forces follow a renumbering.

    Islands keep the order of contacts: with the islands moved among each other, and the bodies
    renumbered, each island sees the same numbers, so equal to round-off.
    """
    pairs = [(a, -1 if a == b else b) for a, b in pairs if max(a, b) >= 0] or [(0, -1)]
    space = random_bodies(pairs, 8, dim, np.random.default_rng(seed))
    generator = np.random.default_rng(seed)
    offset = space.jacobian @ generator.normal(size=8 * space.body_size)
    problem = FrictionProblem(None, offset, np.full(len(pairs), 0.3), dim, space)
    apart = solve_islands(problem, solve_gauss_seidel, tolerance=1e-10, sweeps=3000)
    if apart.solved:
        assert problem.residual(apart.r) <= 1e-10
    parts = find_islands(problem)
    order = np.concatenate([parts[k] for k in generator.permutation(len(parts))])
    rows = (order[:, None] * dim + np.arange(dim)).ravel()
    size = space.body_size
    bodies = (generator.permutation(8)[:, None] * size + np.arange(size)).ravel()
    moved = BodySpace(
        sp.csr_array(space.jacobian[rows][:, bodies]),
        sp.csr_array(space.inverse_mass[bodies][:, bodies]), size,
    )  # fmt: skip
    again = solve_islands(
        FrictionProblem(None, offset[rows], problem.friction[order], dim, moved),
        solve_gauss_seidel, tolerance=1e-10, sweeps=3000,
    )  # fmt: skip
    assert again.solved == apart.solved
    if apart.solved:
        scale = np.abs(apart.r).max(initial=1e-300)
        np.testing.assert_allclose(again.r / scale, apart.r[rows] / scale, atol=1e-9)


def test_whole_is_as_fine_as_asked() -> None:
    """A light island beside a heavy one, whose rho differ by 1e6: the whole is judged, not each."""
    heavy, light = (
        random_bodies([(0, -1), (1, 0)], 2, 2, np.random.default_rng(seed)) for seed in (1, 2)
    )
    velocity = np.random.default_rng(5).normal(size=6)
    offset = np.concatenate([1e-3 * heavy.jacobian @ velocity, light.jacobian @ velocity])
    matrix = sp.block_diag([heavy.matrix * 1e-6, light.matrix]).tocsr()
    problem = make_problem(matrix, offset, 0.3, 2)
    found = solve_islands(problem, solve_gauss_seidel, tolerance=1e-9, sweeps=5000)
    assert found.residual <= 1e-9
    assert found.solved
    assert found.work["islands"] == 2


def test_islands_without_a_solution_are_named() -> None:
    """A contact that approaches and can not move (W = 0) has no force; the other is solved."""
    matrix = sp.csr_array(np.diag([1.0, 1.0, 0.0, 0.0]))
    problem = make_problem(matrix, [-1.0, 0.0, -1.0, 0.0], 0.3, 2)
    found = solve_islands(problem, solve_gauss_seidel)
    assert found.status == "no solution"
    assert "contact 1" in found.message
    np.testing.assert_array_equal(found.r, [1.0, 0.0, 0.0, 0.0])


@settings(max_examples=40)
@given(
    seed=st.integers(0, 10_000), bodies=st.integers(1, 12), contacts=st.integers(1, 14),
    factors=st.booleans(), dim=st.sampled_from([2, 3]),
)  # fmt: skip
def test_islands_are_the_connected_parts_of_w(seed, bodies, contacts, factors, dim):
    """Beside scipy's connected components of the pattern of W, by blocks."""
    random = np.random.default_rng(seed)
    pairs = [(int(a), int(b)) for a, b in random.integers(-1, bodies, (contacts, 2))]
    pairs = [(a, b if b != a else -1) for a, b in pairs]
    space = random_bodies(pairs, bodies, dim, random)
    problem = FrictionProblem(None, np.zeros(dim * contacts), np.zeros(contacts), dim, space)
    blocks = np.abs(space.matrix.toarray()).reshape(contacts, dim, contacts, dim)
    pattern = blocks.max(axis=(1, 3)) > 0
    _, label = connected_components(sp.csr_array(pattern), directed=False)
    expected = sorted(np.flatnonzero(label == k).tolist() for k in np.unique(label))
    found = find_islands(problem if factors else as_matrix(problem))
    assert [part.tolist() for part in found] == expected
