"""Sweeps in body space: every visit is the exact answer of
`rigid_lcp.friction.sweeps.local_contact`.

A twin in plain NumPy visits one contact after another (Jean 1999): ``q_c = u_c - W_cc y_c`` with
``u = W y + q`` of all forces at present, ``r_c`` by `solve_contact`.  The kernels carry body
velocities, packed rows and inverse blocks instead; they have to give the same forces.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigid_lcp.arrays import Floats
from rigid_lcp.friction.methods.gauss_seidel import begin_sweeps, lay_out_sweeps
from rigid_lcp.friction.problem.definition import FrictionProblem, make_problem
from rigid_lcp.friction.sweeps.blocks import find_relative_velocities
from rigid_lcp.friction.sweeps.body_kernel import invert_blocks
from rigid_lcp.friction.sweeps.contact_kernel import visit_all
from tests.rigid_local import solve_contact
from tests.rigid_networks import random_bodies, random_pairs


def some_problem(seed: int, dim: int, contacts: int, mu: float) -> FrictionProblem:
    """Random pairs of few bodies, some of them the ground: redundant and strongly coupled."""
    random, bodies = np.random.default_rng(seed), max(2, contacts // 2)
    space = random_bodies(random_pairs(contacts, bodies, random), bodies, dim, random)
    return make_problem(space, random.normal(size=contacts * dim), mu, dim)


def twin_sweep(
    problem: FrictionProblem, force: Floats, last: Floats, part: float
) -> tuple[Floats, float, float]:
    """Forces after a sweep from ``y = r + part (r - last)``, and its two products."""
    dim, w = problem.dim, problem.delassus.toarray()
    y = force + part * (force - last)
    now = y.copy()
    for c in range(problem.contacts):
        here = slice(c * dim, (c + 1) * dim)
        u = w[here] @ now.ravel() + problem.offset[here]
        block = w[here, here]
        found, status = solve_contact(block, u - block @ now[c], problem.friction[c])
        if status != "no solution":
            now[c] = found
    weight = np.abs(w.diagonal()).reshape(now.shape)
    product = float((weight * (y - now) * (now - force)).sum())
    return now, product, float((weight * (y - now) ** 2).sum())


@settings(max_examples=60)
@given(
    seed=st.integers(0, 10_000), dim=st.sampled_from([2, 3]), contacts=st.integers(1, 8),
    mu=st.sampled_from([0.0, 0.05, 0.5, 1.2, 30.0]), part=st.sampled_from([0.0, 0.7]),
)  # fmt: skip
def test_a_sweep_is_that_of_the_exact_local_solutions(seed, dim, contacts, mu, part):
    problem = some_problem(seed, dim, contacts, mu)
    blocks = lay_out_sweeps(problem)
    assert blocks.bodies > 0
    random = np.random.default_rng(seed + 1)
    force, last = random.normal(size=(2, contacts, dim))
    expected, product, square = twin_sweep(problem, force, last, part)
    before = force.copy()
    velocity = begin_sweeps(blocks, force + part * (force - last)).velocity
    _, made_product, made_square = visit_all(
        blocks, force, last, velocity, part, np.arange(contacts)
    )
    scale = max(1.0, float(np.abs(expected).max()))
    # the direction of sliding in 3D is a root of a quartic, found to some 1e-12
    np.testing.assert_allclose(force, expected, atol=1e-9 * scale)
    np.testing.assert_array_equal(last, before)
    np.testing.assert_allclose(velocity, begin_sweeps(blocks, force).velocity, atol=1e-9 * scale)
    bulk = float((np.abs(problem.diagonal)).max()) * contacts * dim * (scale + 10.0) ** 2
    assert made_product == pytest.approx(product, abs=1e-8 * bulk)
    assert made_square == pytest.approx(square, abs=1e-8 * bulk)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("full", [False, True])
def test_blocks_of_the_bodies_make_w(dim: int, full: bool) -> None:
    """``B B^T`` is W, for masses alone and for bodies whose inertia couples its axes."""
    random = np.random.default_rng(7)
    space = random_bodies([(0, -1), (0, 1), (1, 2), (2, 0)], 3, dim, random, full)
    problem = make_problem(space, random.normal(size=4 * dim), 0.4, dim)
    blocks = lay_out_sweeps(problem)
    assert blocks.bodies > 0
    r = random.normal(size=(4, dim))
    u = find_relative_velocities(blocks.body, blocks.block, begin_sweeps(blocks, r).velocity)
    w = space.matrix.toarray()
    np.testing.assert_allclose(u.ravel(), w @ r.ravel(), rtol=1e-10, atol=1e-10)
    own = [w[k * dim : (k + 1) * dim, k * dim : (k + 1) * dim] for k in range(4)]
    np.testing.assert_allclose(blocks.local, own, rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("dim", [2, 3])
def test_inverses_invert_or_are_zero(dim: int) -> None:
    """``G W = 1`` to round-off over the determinant; singular or strongly coupled: none."""
    random = np.random.default_rng(dim)
    factor = random.normal(size=(200, dim, dim))
    factor[:20, 0] = 2.0 * factor[:20, 1]  # of lower rank
    local = np.einsum("cij,ckj->cik", factor, factor)
    found = invert_blocks(local, np.full(200, 0.3))
    known = found[:, 0, 0] != 0.0
    assert not known[:20].any()
    assert known.sum() > 100
    size = np.einsum("cii->c", local[known]) * np.einsum("cii->c", found[known])
    error = np.abs(found[known] @ local[known] - np.eye(dim)).max(axis=(1, 2))
    assert (error <= 1e-14 * size).all()
    if dim == 2:  # with mu |W_NT| >= W_NN two answers are possible: left to the general solution
        strong = 0.3 * np.abs(local[:, 0, 1]) >= local[:, 0, 0]
        assert strong.any()
        assert not known[strong].any()


def test_packed_rows_hold_what_a_visit_reads() -> None:
    problem = some_problem(5, 2, 3, 0.4)
    blocks = lay_out_sweeps(problem)
    assert blocks.bodies > 0
    rows = blocks.packed
    assert rows.shape == (3, 21)
    np.testing.assert_array_equal(rows[:, :3], blocks.block[:, 0, 0])
    np.testing.assert_array_equal(rows[:, 9:12], blocks.block[:, 1, 1])
    np.testing.assert_array_equal(rows[:, 15], blocks.local[:, 0, 1])
    np.testing.assert_array_equal(rows[:, 20], 0.4)
