"""The paper's modified Dantzig algorithm: its inverse, its lists, where it works and fails."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigid_lcp.arrays import Floats
from rigid_lcp.errors import ProblemError
from rigid_lcp.friction.auto.islands import cut_out_island
from rigid_lcp.friction.methods.dantzig import solve_dantzig
from rigid_lcp.friction.pivots.drive import move_contact
from rigid_lcp.friction.pivots.shift import change_shift
from rigid_lcp.friction.pivots.state import Pivots, start_pivots
from rigid_lcp.friction.pivots.updates import (
    BREAKING,
    SLIDING_DOWN,
    SLIDING_UP,
    STATIC,
    extend_inverse,
    find_slide_sign,
    refresh_reduced,
    shrink_inverse,
)
from rigid_lcp.friction.problem.definition import FrictionProblem, FrictionSolution, make_problem
from tests.rigid_networks import network, stored

TOLERANCE = 1e-12


def in_orders(problem: FrictionProblem, count: int) -> list[FrictionSolution]:
    """What comes out where the contacts are numbered, and so considered, in random orders."""
    orders = [np.random.default_rng(k).permutation(problem.contacts) for k in range(count)]
    return [solve_dantzig(cut_out_island(problem, order)) for order in orders]


def matrix_of_lists(state: Pivots) -> Floats:
    """Eq. 28 in plain NumPy: rows of the unknowns, columns ``A_N + sigma mu A_T`` where sliding."""
    geometry, reduced = state.geometry, state.reduced
    n = len(state.b)
    full = np.zeros((n, n))
    for i in range(n):
        for k in range(geometry.row_start[i], geometry.row_start[i + 1]):
            full[i, geometry.row_index[k]] = geometry.row_value[k]
    members = reduced.members[: reduced.size[0]]
    columns = []
    for row in members:
        c = geometry.contact[row]
        column = full[:, row].copy()
        if row == geometry.normal[c]:
            column += (
                find_slide_sign(reduced.kind[c]) * geometry.mu[c] * full[:, geometry.tangent[c]]
            )
        columns.append(column[members])
    return np.array(columns).T


@given(st.integers(1, 12), st.integers(0, 10**6))
@settings(max_examples=25)
def test_bordering_and_dropping_give_the_inverse(size: int, seed: int) -> None:
    """``[[B, c], [r, d]]^-1`` from B^-1, and back: to round-off times the condition."""
    g = np.random.default_rng(seed)
    b = g.normal(size=(size + 1, size + 1)) + 4.0 * np.eye(size + 1)
    room = np.zeros((size + 1, size + 1))
    room[:size, :size] = np.linalg.inv(b[:size, :size])
    complement = extend_inverse(room, size, b[:size, size].copy(), b[size, :size].copy(), b[-1, -1])
    expected = b[-1, -1] - b[size, :size] @ np.linalg.solve(b[:size, :size], b[:size, size])
    allowed = 1e-13 * np.linalg.cond(b) ** 2
    assert complement == pytest.approx(expected, abs=allowed * abs(b).max())
    assert room == pytest.approx(np.linalg.inv(b), abs=allowed)
    place = int(g.integers(size + 1))
    assert shrink_inverse(room, size + 1, place)
    left = list(range(size))
    if place < size:
        left[place] = size  # the last takes the empty seat
    assert room[:size, :size] == pytest.approx(np.linalg.inv(b[np.ix_(left, left)]), abs=allowed)


def test_a_singular_border_changes_nothing() -> None:
    """``[[1, 1], [1, 1]]`` has no inverse."""
    room = np.eye(2)
    assert extend_inverse(room, 1, np.ones(1), np.ones(1), 1.0) == 0.0
    assert (room == np.eye(2)).all()


@pytest.mark.parametrize("seed", range(3))
def test_the_inverse_follows_the_lists(seed: int) -> None:
    """After random moves between all lists the inverse is that of eq. 28, built in NumPy."""
    problem = network(20, 0.4, seed)
    state = start_pivots(problem, 1e-2, 0.0, None)
    g = np.random.default_rng(seed)
    state.reduced.kind[:] = BREAKING
    ways = {
        BREAKING: [SLIDING_UP, SLIDING_DOWN],
        STATIC: [SLIDING_UP, SLIDING_DOWN],
        SLIDING_UP: [BREAKING, STATIC],
        SLIDING_DOWN: [BREAKING, STATIC],
    }
    for _ in range(200):
        c = int(g.integers(problem.contacts))
        to = int(g.choice(ways[int(state.reduced.kind[c])]))
        assert move_contact(state.geometry, state.reduced, c, to)
    size = state.reduced.size[0]
    matrix = matrix_of_lists(state)
    held = state.reduced.inverse[:size, :size] @ matrix
    assert held == pytest.approx(np.eye(size), abs=1e-9)
    assert refresh_reduced(state.geometry, state.reduced)
    assert state.reduced.inverse[:size, :size] @ matrix == pytest.approx(np.eye(size), abs=1e-12)
    assert change_shift(state, 0.5 * state.shift[0])
    halved = matrix_of_lists(state)
    assert np.diag(matrix - halved) == pytest.approx(0.5e-2 * state.unit, rel=1e-9)


@pytest.mark.parametrize(("ratio", "slides"), [(1.0 - 1e-9, True), (1.0 + 1e-9, False)])
def test_block_at_its_threshold(ratio: float, slides: bool) -> None:
    """A point mass on a slope of angle alpha: it stays from mu = tan(alpha) on."""
    slope = np.radians(20.0)
    offset = 9.81 * np.array([-np.cos(slope), np.sin(slope)])
    found = solve_dantzig(make_problem(np.eye(2), offset, ratio * np.tan(slope), 2))
    assert found.solved
    excess = 9.81 * np.sin(slope) * max(1.0 - ratio, 0.0)
    assert found.u[1] == pytest.approx(excess, abs=1e-13 * 9.81)
    assert (found.u[1] > 1e-10) == slides


@pytest.mark.parametrize("mu", [1.2, 1.4, 2.0])
@pytest.mark.parametrize("pushed", [-1.0, 1.0])
def test_painleve_rod(mu: float, pushed: float) -> None:
    """A rod at tan(theta) = 2 that slides: ``A_eff = 1 + 3 cos^2 - 3 mu sin cos`` (m = 1).

    A_eff = 1.6 - 1.2 mu is negative from mu = 4/3 on; then no force stops an approach (b < 0).
    """
    sine, cosine = np.sin(np.arctan(2.0)), np.cos(np.arctan(2.0))
    w = [[1 + 3 * cosine**2, 3 * sine * cosine], [3 * sine * cosine, 1 + 3 * sine**2]]
    effective = 1.6 - 1.2 * mu
    found = solve_dantzig(make_problem(w, [pushed, 0.3], mu, 2), tangential_velocity=[1.0])
    if pushed > 0:
        assert found.solved
        assert (found.r == 0.0).all()
    elif effective > 0:
        assert found.solved
        assert found.r == pytest.approx([1.0 / effective, -mu / effective], rel=1e-9)
    else:
        assert found.status == "no solution"
        assert "impulses" in found.message


def test_sliding_contacts_stay_sliding() -> None:
    """Event 3c needs u_T = 0: with u_T given, f_T = -sign(u_T) mu f_N wherever f_N > 0."""
    problem = network(60, 0.1, 3)
    g = np.random.default_rng(0)
    velocity = np.where(g.random(problem.contacts) < 0.5, g.choice([-1.0, 1.0]), 0.0)
    found = solve_dantzig(problem, tangential_velocity=velocity)
    force, slides = found.r.reshape(-1, 2), velocity != 0
    assert found.solved
    assert force[slides, 1] == pytest.approx(-np.sign(velocity[slides]) * 0.1 * force[slides, 0])
    assert (np.abs(force[~slides, 1]) < 0.0999 * force[~slides, 0]).any()


def test_without_friction_it_always_ends() -> None:
    """Positive semidefinite A: every order ends; accelerations are unique, in every order."""
    problem = network(80, 0.0)
    found = in_orders(problem, 10)
    assert all(s.solved for s in found)
    for s in found[1:]:
        same = pytest.approx(np.sort(found[0].u[::2]), abs=1e-11 * abs(problem.offset).max())
        assert np.sort(s.u[::2]) == same


def test_success_falls_with_friction() -> None:
    """Solved of 8 orders as driven in the paper: most at mu = 0.1, hardly one at mu = 0.8.

    What it does not solve it names, and never calls solved.
    """
    solved = {}
    for mu in (0.1, 0.8):
        problem = network(110, mu, 1)
        found = in_orders(problem, 8)
        solved[mu] = sum(s.solved for s in found)
        for s in found:
            assert s.solved == (s.residual <= TOLERANCE)
            assert s.solved or (s.status in ("cycled", "not converged", "singular") and s.message)
    assert solved[0.1] >= 5
    assert solved[0.8] <= 2
    assert any(s.status == "cycled" for s in found)


def test_what_can_not_be_posed_is_refused() -> None:
    """Velocities that are none."""
    plane = make_problem(np.eye(4), -np.ones(4), 0.3, 2)
    for wrong in ([1.0], [1.0, np.nan]):
        with pytest.raises(ProblemError, match="tangential_velocity"):
            solve_dantzig(plane, tangential_velocity=wrong)


def test_a_settled_packing() -> None:
    """227 contacts of settled discs at mu = 0.1: solved in most orders; with mu = 0 in all."""
    for mu, least in ((0.0, 5), (0.1, 4)):
        problem = stored("discs_125", mu)
        found = in_orders(problem, 5)
        assert sum(s.solved for s in found) >= least


@pytest.mark.parametrize("mu", [0.0, 0.05])
def test_a_shift_that_stays_leaves_exact_lists(mu: float) -> None:
    """Where events without end keep the shift of the diagonal from coming out (one of these ten
    orders without friction, four at mu = 0.05), the lists that the drives ended on are solved
    without it."""
    for found in in_orders(stored("discs_125", mu), 10):
        assert found.solved, found.message
