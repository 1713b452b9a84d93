"""One contact solved exactly: against Coulomb's law by the natural map, closed forms, edges."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from rigid_lcp.arrays import Floats
from rigid_lcp.friction.problem.cones import find_natural_map
from rigid_lcp.friction.sweeps.local_contact import (
    find_all_directions,
    find_direction_near,
    find_real_roots,
)
from tests.rigid_local import solve_contact


def law_error(block: Floats, offset: Floats, friction: float, force: Floats) -> float:
    """Norm of the natural map over the greatest force the data can make."""
    rho = len(offset) / max(np.trace(block), 1e-300)
    velocity = block @ force + offset
    error = find_natural_map(force[None], velocity[None], np.array([friction]), rho)
    scale = max(float(np.linalg.norm(force)), rho * float(np.linalg.norm(offset)))
    return float(np.linalg.norm(error)) / scale if scale else 0.0


def block_of(seed: int, dim: int, rank: int) -> Floats:
    """A Delassus block ``W = A A^T`` of this rank; q = A v keeps the contact solvable."""
    return np.random.default_rng(seed).normal(size=(dim, rank))


@settings(max_examples=150)
@given(
    st.integers(0, 10**9),
    st.sampled_from([2, 3]),
    st.integers(0, 2),
    st.sampled_from([0.0, 1e-3, 0.3, 0.8, 1.5, 30.0]),
)
@example(seed=1, dim=3, lost=2, friction=0.8)
def test_every_symmetric_contact_obeys_the_law(seed, dim, lost, friction):
    """W = A A^T, of full rank or singular, and q = A v: a solution exists (Klarbring), is found.

    The error grows with the condition of W as a stick force does, ``W^-1 q``; 100 roundings are
    allowed for it and for the length of the formulas.
    """
    a = block_of(seed, dim, max(dim - lost, 1))
    block, offset = a @ a.T, a @ np.random.default_rng(seed + 1).normal(size=a.shape[1])
    force, status = solve_contact(block, offset, friction)
    assert status != "no solution"
    singular = np.linalg.svd(a, compute_uv=False)
    condition = (singular[0] / singular[-1]) ** 2
    assert law_error(block, offset, friction, force) <= 2e-14 * condition * max(1.0, friction)
    velocity = block @ force + offset
    assert {
        "open": not force.any(),
        "stick": np.linalg.norm(velocity) <= 1e-13 * condition * np.linalg.norm(offset),
        "slide": abs(velocity[0]) <= 1e-13 * condition * np.linalg.norm(offset),
    }[status]


@settings(max_examples=100)
@given(st.integers(0, 10**9), st.sampled_from([2, 3]), st.sampled_from([0.0, 0.3, 0.8]))
def test_non_symmetric_blocks(seed: int, dim: int, friction: float) -> None:
    """W of real packages is symmetric to 1e-3 only; the law is obeyed all the same."""
    generator = np.random.default_rng(seed)
    block = np.eye(dim) + 0.2 * generator.normal(size=(dim, dim))
    offset = generator.normal(size=dim)
    force, status = solve_contact(block, offset, friction)
    if np.linalg.eigvalsh(block + block.T)[0] > 0.2 and friction * np.abs(block[0, 1:]).max() < 0.3:
        assert status != "no solution"
    if status != "no solution":
        assert law_error(block, offset, friction, force) <= 1e-12


@settings(max_examples=60)
@given(st.integers(0, 10**9), st.floats(1e-6, 1e6), st.floats(1e-6, 1e6), st.floats(0, 6.3))
def test_units_and_axes_change_nothing(seed, masses, speeds, angle):
    """With kg -> g, m -> mm, or the tangents turned, r scales and turns along, exactly."""
    a = block_of(seed, 3, 4)
    block, offset = a @ a.T, np.random.default_rng(seed + 1).normal(size=3)
    turn = np.eye(3)
    turn[1:, 1:] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    force, status = solve_contact(block, offset, 0.4)
    scaled, same = solve_contact(
        turn @ block @ turn.T / masses, turn @ offset * speeds, 0.4
    )  # fmt: skip
    assert law_error(block, offset, 0.4, turn.T @ scaled / (masses * speeds)) <= 1e-10
    if status == same:
        expected = turn @ force * masses * speeds
        np.testing.assert_allclose(scaled, expected, atol=1e-9 * np.abs(expected).max(initial=0))


def test_block_on_an_incline() -> None:
    """A block of mass m under gravity g for h: it sticks up to mu = tan(alpha), then slides.

    W = 1/m, q = h g (-cos, -sin): stick r = -m q, slide r = m g h cos (1, mu), u_T = -h g (sin -
    mu cos).  At mu = tan(alpha), and a rounding beside it, both are the same.
    """
    mass, alpha, pull = 3.0, np.radians(20.0), 9.81e-3
    for dim in (2, 3):
        offset = pull * np.array([-np.cos(alpha), -np.sin(alpha), 0.0][:dim])
        for friction in np.tan(alpha) * np.array([0.5, 1 - 1e-9, 1 - 1e-16, 1, 1 + 1e-9, 2]):
            force, status = solve_contact(np.eye(dim) / mass, offset, friction)
            normal = mass * pull * np.cos(alpha)
            tangential = mass * pull * min(np.sin(alpha), friction * np.cos(alpha))
            np.testing.assert_allclose(force[:2], [normal, tangential], rtol=1e-15)
            assert status == "slide" or friction > np.tan(alpha) * (1 - 1e-12)
            assert status == "stick" or friction < np.tan(alpha) * (1 + 1e-12)


def test_tangents_that_pull_on_each_other() -> None:
    """W_TT not diagonal: the fixed point of updates axis by axis is not the answer.

    The law is checked by its definition: u_N = 0, u_T against r_T, |r_T| = mu r_N.
    """
    block = np.array([[1.0, 0.1, -0.2], [0.1, 1.0, 0.9], [-0.2, 0.9, 2.0]])
    offset = np.array([-1.0, 0.8, -0.3])
    force, status = solve_contact(block, offset, 0.3)
    velocity = block @ force + offset
    assert status == "slide"
    assert abs(velocity[0]) < 1e-15
    assert np.linalg.norm(force[1:]) == pytest.approx(0.3 * force[0], rel=1e-15)
    across = velocity[1] * force[2] - velocity[2] * force[1]
    assert abs(across) < 1e-16
    assert velocity[1:] @ force[1:] < 0


@pytest.mark.parametrize("dim", [2, 3])
def test_edges(dim: int) -> None:
    """q = 0, parting, q_N = 0 while sliding, no friction, endless friction, no mass."""
    eye, still = np.eye(dim), np.zeros(dim)
    assert solve_contact(eye, still, 0.5)[1] == "open"
    assert solve_contact(eye, [0.0, *[1.0] * (dim - 1)], 0.5)[1] == "open"
    push = np.array([-2.0, *[1.0] * (dim - 1)])
    np.testing.assert_array_equal(solve_contact(eye, push, 0.0)[0], [2.0, *[0.0] * (dim - 1)])
    np.testing.assert_array_equal(solve_contact(eye, push, 1e300)[0], -push)
    assert solve_contact(np.zeros((dim, dim)), push, 0.5)[1] == "no solution"
    assert solve_contact(np.zeros((dim, dim)), -push, 0.5)[1] == "open"
    normal_only = np.diag([1.0, *[0.0] * (dim - 1)])
    assert solve_contact(normal_only, [-1.0, *[0.0] * (dim - 1)], 0.5)[1] == "stick"
    force, status = solve_contact(normal_only, push, 0.5)  # slides on, nothing can slow it
    assert status == "slide"
    assert np.linalg.norm(force[1:]) == pytest.approx(0.5 * force[0])


def test_painleve_has_no_solution() -> None:
    """Sliding rod (eq. 27): D = W_NN - mu W_NT d < 0 and q_N < 0, and it can not stick in time."""
    block = np.array([[1.0, 0.9], [0.9, 0.85]])
    offset = np.array([-1.0, -3.0])
    with_little, _ = solve_contact(block, offset, 0.5)
    assert law_error(block, offset, 0.5, with_little) < 1e-14
    indefinite = np.array([[-0.1, 0.0], [0.0, 1.0]])
    assert solve_contact(indefinite, offset, 0.5)[1] == "no solution"


@settings(max_examples=80)
@given(st.lists(st.floats(-50, 50), min_size=0, max_size=4, unique=True), st.floats(0.1, 5))
def test_real_roots_of_a_quartic(roots: list[float], width: float) -> None:
    """A quartic of given real roots and pairs of complex ones (t - 1)^2 + width^2.

    Roots that lie near each other are separated no better than rounding over their distance.
    """
    real = np.array(roots[: len(roots) // 2 * 2])
    whole = np.poly1d(real, r=True) * np.poly1d([1, -2, 1 + width**2]) ** ((4 - len(real)) // 2)
    found, count = find_real_roots(np.ascontiguousarray(whole.coeffs[::-1]))
    gaps = np.diff(np.sort(real))
    if len(gaps) == 0 or gaps.min() > 0.05:
        assert count == len(real)
        np.testing.assert_allclose(found[:count], np.sort(real), atol=1e-4)


@settings(max_examples=60)
@given(st.integers(0, 10**9))
def test_no_direction_is_missed(seed: int) -> None:
    """As many directions as changes of sign on a fine grid of angles, each exact, found again."""
    generator = np.random.default_rng(seed)
    g, bend = generator.normal(size=2), generator.normal(size=(2, 2))
    angle = np.linspace(0, 2 * np.pi, 4001)
    d = np.array([np.cos(angle), np.sin(angle)])
    v = g[:, None] + bend @ d
    across = d[0] * v[1] - d[1] * v[0]
    found, count = find_all_directions(*g, *bend.ravel(), 10.0)
    assert count == np.count_nonzero(across[1:] * across[:-1] < 0)
    for direction in found[:count]:
        moved = g + bend @ direction
        assert abs(direction[0] * moved[1] - direction[1] * moved[0]) < 1e-13
        assert np.linalg.norm(direction) == pytest.approx(1.0, rel=1e-14)
        *again, converged = find_direction_near(*g, *bend.ravel(), *direction)
        assert not converged or np.dot(again, direction) == pytest.approx(1.0, abs=1e-12)
