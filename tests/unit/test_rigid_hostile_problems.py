"""Hostile friction problems: named in a sentence, or solved, never silently wrong."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from rigid_lcp import solve_friction
from rigid_lcp.arrays import Floats
from rigid_lcp.friction.problem.cones import find_natural_map, find_natural_residual
from rigid_lcp.friction.problem.definition import judge_forces, make_problem
from tests.rigid_static_problems import tower

W = np.diag([1.0, 2.0, 1.0, 2.0])
Q = np.array([-1.0, 0.5, 1.0, 0.0])
R = np.array([1.0, -0.25, 0.0, 0.0])
"""Contact 0 sticks: ``r_T = -q_T / W_TT``, less than mu r_N = 0.5; contact 1 parts."""


# --- the measure of an answer -------------------------------------------------------------------


def test_great_friction_does_not_hide_an_approach():
    """r = 0, u = (-1, -s): what is projected is (1 - mu s, s), at 1 / (1 + mu^2) (1, mu) for any s.

    At mu s = 1e17 the one is lost in a sum of floats, and r = 0 was a solution.
    """
    mu = 1e6
    for slip in (1.0, 1e5, 1e11):
        error = find_natural_map(np.zeros((1, 2)), np.array([[-1.0, -slip]]), np.array([mu]), 1.0)
        expected = -np.array([1.0, mu]) / (1 + mu**2)
        np.testing.assert_allclose(error[0], expected, rtol=1e-12)


@pytest.mark.parametrize("scale", [1e-300, 1e-200, 1e-120, 1e120, 1e150])
def test_the_residual_of_tiny_and_huge_numbers(scale):
    """It has no units: squares that vanish or overflow made everything a solution."""
    force, velocity = np.array([[1.0, 0.2], [0.0, 0.0]]), np.array([[0.1, 0.3], [-1.0, 2.0]])
    mu = np.array([0.5, 0.3])
    once = find_natural_residual(force, velocity, mu, 1.0)
    assert find_natural_residual(scale * force, scale * velocity, mu, 1.0) == pytest.approx(once)
    assert find_natural_residual(scale * force, velocity, mu, scale) == pytest.approx(once)
    assert find_natural_residual(0 * force, scale * velocity, mu, 1.0) > 0.1
    assert not np.isfinite(find_natural_residual(force, np.nan * velocity, mu, 1.0))


@pytest.mark.parametrize("method", ["auto", "gauss-seidel", "pivoting"])
def test_sweeps_that_diverge_give_a_status_and_no_warning(method):
    """A W of no bodies (not symmetric, a negative mass): forces of 1e160 had no norm."""
    rng = np.random.default_rng(6)
    for _ in range(25):
        w = rng.normal(size=(6, 6)) + np.eye(6)
        found = solve_friction(w, rng.normal(size=6), 2.0, 2, method=method)
        assert found.solved or found.message


@pytest.mark.parametrize("scale", [1e-300, 1e-120, 1e-30, 1e90])
def test_bodies_may_come_to_rest_as_slowly_as_they_like(scale):
    """Round-off of round-off (1e-17, 1e-33, ...) of velocities is a problem like any other."""
    found = solve_friction(W, scale * Q, 0.5, 2)
    assert found.solved
    np.testing.assert_allclose(found.r, scale * R, rtol=1e-12)


def test_forces_without_bound_are_no_solution_and_the_message_says_so():
    """W = 0 at a contact that approaches: r = 1e18 has a residual of zero."""
    problem = make_problem(np.zeros((2, 2)), [-1.0, 0.0], 0.5, 2)
    found = judge_forces(problem, np.array([1e18, 0.0]), 1e-12, "any")
    assert found.status == "not converged"
    assert "without bound" in found.message


@pytest.mark.parametrize("tolerance", [1e-3, 1e-4, 1e-7, 1e-12])
@pytest.mark.parametrize("top", [1e4, 1e8])
def test_light_bodies_rest_at_any_tolerance(top, tolerance):
    """Beside the forces of a heavy top those of light boxes pass for nothing: a residual within the
    tolerance is not enough while they still fall, and the default goes on until they do not."""
    problem = tower(n=6, top=top)
    found = solve_friction(problem.bodies, problem.offset, problem.friction, 2, tolerance=tolerance)
    assert found.solved, found.message
    assert np.abs(found.u).max() <= 0.1 * np.linalg.norm(problem.offset)


# --- any 'solved' that is wrong? ------------------------------------------------------------------


def complementarity_error(w: Floats, q: Floats, mu: float, dim: int, r: Floats) -> float:
    """How far forces are from eq. 27, contact by contact, from its own words [-].

    No approach, no tension, ``|r_T| <= mu r_N``, ``u_N r_N = 0``, and where it slips r_T against
    the slip; forces over ``|r|`` (a billionth of what q would need at least), velocities over
    ``mean(diag W)`` times that.
    """
    u = (w.astype(np.longdouble) @ r + q).reshape(-1, dim)
    push = r.reshape(-1, dim)
    stiff = float(np.abs(np.diag(w)).mean()) or 1.0
    size = max(float(np.linalg.norm(r)), 1e-9 * float(np.linalg.norm(q)) / stiff) or 1.0
    worst = 0.0
    for force, velocity in zip(push / size, np.asarray(u / (size * stiff), float), strict=True):
        pull, slip = np.linalg.norm(force[1:]), np.linalg.norm(velocity[1:])
        against = np.linalg.norm(force[1:] * slip + mu * force[0] * velocity[1:]) if slip else 0.0
        worst = max(
            worst, -velocity[0], -force[0], pull - mu * force[0],
            min(abs(velocity[0]), abs(force[0])), min(against, against / slip if slip else 0.0),
        )  # fmt: skip
    return worst


@settings(max_examples=60)
@given(
    st.integers(0, 2**31), st.sampled_from([2, 3]), st.integers(1, 12),
    st.sampled_from(["regular", "deficient", "twice", "whole numbers", "skew", "a zero row"]),
    st.sampled_from([0.0, 0.3, 0.8, 2.0]),
)  # fmt: skip
def test_what_is_called_solved_obeys_signorini_and_coulomb(seed, dim, contacts, family, mu):
    """A residual of 1e-12 bounds every breach by some 1e-12 (1 + mu^2) and the size of u / r."""
    rng = np.random.default_rng(seed)
    n = contacts * dim
    part = rng.normal(size=(n, max(1, n // 3) if family == "deficient" else n))
    if family == "whole numbers":
        part = rng.integers(-1, 2, size=(n, n)).astype(float)
    if family == "twice":
        half = contacts // 2 * dim
        part[half : 2 * half] = part[:half]
    if family == "a zero row":
        part[rng.integers(0, n)] = 0.0
    w = part @ part.T
    if family == "skew":
        w *= 1 + 1e-3 * rng.normal(size=w.shape)
    q = rng.normal(size=n) if rng.random() < 0.7 else rng.integers(-2, 3, size=n).astype(float)
    found = solve_friction(w, q, mu, dim)
    assert found.status in ("solved", "not converged", "no solution")
    assert found.solved or found.message
    round_off = 1e-13 * (np.abs(w) @ np.abs(found.r) + np.abs(q))
    assert (np.abs(found.u - w @ found.r - q) <= round_off + 1e-300).all()
    if found.solved:
        assert complementarity_error(w, q, mu, dim, found.r) <= 1e-9


def some_solution(w: Floats, q: Floats, mu: float) -> bool:
    """Whether any of the 4^nc statuses (open, stick, two slips) of a 2D problem has a solution."""
    contacts = len(q) // 2
    for status in product(range(4), repeat=contacts):
        rows, right = np.eye(2 * contacts), np.zeros(2 * contacts)
        for c, what in enumerate(status):
            n, t = 2 * c, 2 * c + 1
            if what:
                rows[n], right[n] = w[n], -q[n]
            if what == 1:
                rows[t], right[t] = w[t], -q[t]
            elif what:
                rows[t, n] = mu if what == 2 else -mu
        r = np.linalg.lstsq(rows, right, rcond=1e-11)[0]
        small = np.abs(rows @ r - right).max() < 1e-9 and np.linalg.norm(r) < 1e9
        if small and complementarity_error(w, q, mu, 2, r) < 1e-9:
            return True
    return False


@pytest.mark.parametrize("method", ["auto", "pivoting", "dantzig"])
@pytest.mark.long
def test_no_solution_is_a_proof(method):
    """Every problem that is said to have none: all statuses are tried, none is a solution."""
    rng = np.random.default_rng(11)
    said = 0
    for _ in range(150):
        contacts = int(rng.integers(1, 4))
        n = 2 * contacts
        w = rng.normal(size=(n, n)) + 0.3 * np.sqrt(n) * np.eye(n)
        q, mu = rng.normal(size=n), float(rng.choice([0.3, 0.8, 2.0, 10.0]))
        q[::2] = -np.abs(q[::2])
        found = solve_friction(w, q, mu, 2, method=method)
        if found.status == "no solution":
            said += 1
            assert not some_solution(w, q, mu)
        elif found.solved:
            assert complementarity_error(w, q, mu, 2, found.r) <= 1e-9
    assert said > 0


@pytest.mark.long
@pytest.mark.parametrize("dim", [2, 3])
def test_a_contact_that_bears_on_nothing_among_many(dim):
    """Of 301 contacts one has no row in W, as between fixed bodies: it parts, the others solve."""
    rng = np.random.default_rng(9)
    part = sp.random_array((300 * dim, 300 * dim), density=0.01, rng=rng)
    w = sp.block_array([[part @ part.T + sp.eye_array(300 * dim), None],
                        [None, sp.csr_array((dim, dim))]], format="csr")  # fmt: skip
    q = rng.normal(size=301 * dim)
    q[-dim:] = 0.5
    for method in ("auto", "interior-point"):
        found = solve_friction(w, q, 0.3, dim, method=method)
        assert found.solved
        assert not found.r[-dim:].any()
