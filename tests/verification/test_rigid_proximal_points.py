"""Proximal points, plain and with a centre that runs ahead: towers and jammed random problems to
round-off, a drift of known length, what nothing else solves, units, work in its budget."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from rigid_lcp import solve_friction
from rigid_lcp.friction.attempts.proximal_points import (
    POINTS,
    extrapolate_points,
    find_proximal_point,
    is_hopeless,
    solve_proximal,
)
from rigid_lcp.friction.auto.paths import turn_from_paths
from rigid_lcp.friction.auto.trial import Trial
from rigid_lcp.friction.linear.factorisation import choose_factorisation
from rigid_lcp.friction.methods.gauss_seidel import solve_gauss_seidel
from rigid_lcp.friction.problem.definition import FrictionProblem, make_problem
from validation.bench.rigid.examination import find_family
from validation.bench.rigid.packings import build_packing, build_tower

FRICTION, APPROACH = 0.5, 1e-9


def jammed(seed: int, contacts: int, freedoms: int, dim: int) -> FrictionProblem:
    """More contacts than freedoms, ``q = J v`` so that all can be stopped: redundant."""
    g = np.random.default_rng(seed)
    jacobian = g.standard_normal((contacts * dim, freedoms))
    offset = jacobian @ g.standard_normal(freedoms)
    made: FrictionProblem = make_problem(
        jacobian @ jacobian.T, offset, g.choice([0.0, 0.1, 0.5, 2.0], contacts), dim
    )
    return made


@pytest.mark.parametrize("dim", [2, 3])
def test_towers_to_round_off_from_a_few_sweeps(dim: int) -> None:
    """Redundant corners, nothing slides: W is singular, each shifted system is not."""
    problem = build_tower(20, dim)
    start = solve_gauss_seidel(problem, tolerance=1e-12, sweeps=50)
    found = solve_proximal(problem, start.r, 1e-13)
    assert found.solved, found.message
    assert found.work["factorisations"] < 40


@settings(max_examples=30, derandomize=True)
@given(
    method=st.sampled_from([solve_proximal, extrapolate_points]), seed=st.integers(0, 10**6),
    dim=st.sampled_from([2, 3]), contacts=st.integers(1, 20),
)  # fmt: skip
def test_never_worse_than_its_start_and_within_its_budget(method, seed, dim, contacts) -> None:
    """Random redundant contacts that can all be stopped."""
    problem = jammed(seed, contacts, max(2, contacts // 2), dim)
    start = solve_gauss_seidel(problem, tolerance=1e-10, sweeps=20)
    found = method(problem, start.r, 1e-11, factorisations=25)
    assert found.residual <= start.residual
    assert found.residual == pytest.approx(problem.residual(found.r), abs=1e-16)
    assert found.work["factorisations"] <= 25
    assert found.solved or "->" in found.message


def test_a_proximal_point_is_the_answer_of_the_shifted_problem() -> None:
    """``u = (W + alpha) r + q - alpha r_k``, judged by the residual of that problem."""
    problem = jammed(3, 12, 8, 2)
    centre = solve_gauss_seidel(problem, tolerance=1e-10, sweeps=3).r
    alpha = 1.0 / problem.rho
    force, found, _ = find_proximal_point(
        problem, centre, alpha, choose_factorisation(problem), 1e-14, 20
    )
    assert found
    shifted = make_problem(
        sp.csr_array(problem.delassus + alpha * sp.eye_array(24)),
        problem.offset - alpha * centre, problem.friction, 2,
    )  # fmt: skip
    assert shifted.residual(force) < 1e-12
    assert problem.residual(force) > 1e-9  # one point is not yet the limit


def test_a_point_that_goes_in_a_circle_is_given_up() -> None:
    """Errors of a circle, of a way astray, and of points that were found, as they were measured."""
    circle = [4e-7, 7e-5, 5e-7, 7.00001e-5]
    astray = [7e-6, 9e-3, 2e-1, 8e-1]
    found = [2e-4, 2e-5, 9e-4, 6e-5, 3e-5, 3e-5 * 1.1, 6e-17]
    assert is_hopeless(circle)
    assert not is_hopeless(circle[:3])
    assert is_hopeless(astray)
    assert is_hopeless([1.0, np.nan])
    late = [2e-5, 8e-5, 4e-6, 2e-4, 8.5e-5, 3e-6, 6e-17]
    for errors in (found, late):
        assert not any(is_hopeless(errors[: k + 1]) for k in range(len(errors)))


def squeezed_row() -> FrictionProblem:
    """A wall that comes nearer pushes block a, that pushes block b, which lies on the ground.

    Freedoms (x_a, x_b, z_b), masses one; contacts wall-a, a-b (smooth) and b-ground, which sticks
    until the squeeze is FRICTION: the squeeze is a self-stress, in the null space of W.
    """
    jacobian = np.zeros((6, 3))
    jacobian[0, 0] = 1.0
    jacobian[2, :2] = -1.0, 1.0
    jacobian[4, 2] = jacobian[5, 1] = 1.0
    offset = np.array([-APPROACH, 0.0, 0.0, 0.0, -1.0, 0.0])
    made: FrictionProblem = make_problem(
        jacobian @ jacobian.T, offset, np.array([0.0, 0.0, FRICTION]), 2
    )
    return made


def test_a_drift_ends_where_the_ground_gives_way(monkeypatch: pytest.MonkeyPatch) -> None:
    """Both blocks move with the wall: ``r_ab = mu + eps``, ``r_wall = mu + 2 eps``.

    With the ground sticking ``u = (-eps, 0, 0)`` has a part ``eps / sqrt 3`` along the self-stress
    ``(1, 1, -1) / sqrt 3``: a point of shift alpha moves the squeeze by ``eps / (3 alpha)``, and
    plain points would take ``3 alpha mu / eps`` of them.  The shift is held: the centre runs ahead.
    """
    first = replace(POINTS, least_shift=POINTS.first_shift)
    monkeypatch.setattr(sys.modules[extrapolate_points.__module__], "POINTS", first)
    problem = squeezed_row()
    start = np.array([0.0, 0.0, 0.0, 0.0, 1.0, 0.0])
    linear, alpha = choose_factorisation(problem), POINTS.first_shift / problem.rho
    once, found, _ = find_proximal_point(problem, start, alpha, linear, 1e-14, 5)
    assert found
    squeeze = np.array([1.0, 0.0, 1.0, 0.0, 0.0, -1.0]) / 3.0
    assert squeeze @ once == pytest.approx(APPROACH / (3.0 * alpha), rel=1e-4)
    plain = FRICTION * 3.0 * alpha / APPROACH
    ended = extrapolate_points(problem, start, 1e-14)
    assert ended.solved, ended.message
    exact = [FRICTION + 2 * APPROACH, 0, FRICTION + APPROACH, 0, 1, -FRICTION]
    np.testing.assert_allclose(ended.r, exact, atol=1e-13)
    np.testing.assert_allclose(ended.u[5], APPROACH, rtol=1e-4)
    assert ended.work["points"] < 50 < plain / 50


@pytest.mark.long
def test_solves_a_packing_of_low_friction_that_nothing_else_does() -> None:
    """100 spheres, friction 0.1: Newton, proximal points and the interior point end above 1e-9."""
    problem = build_packing(100, 3, seed=101, friction=0.1)
    near = solve_gauss_seidel(problem, None, 1e-10, 300)
    plain = solve_proximal(problem, near.r, 1e-12)
    assert plain.residual > 1e-9
    found = solve_friction(problem.bodies, problem.offset, problem.friction, 3)
    assert found.solved, found.message
    assert found.residual <= 1e-12


def test_points_without_gain_are_left_after_their_patience() -> None:
    """A wall that comes nearer and nearer with no ground to give way: no residual is halved."""
    problem = squeezed_row()
    problem = make_problem(problem.delassus, problem.offset, np.array([0.0, 0.0, 1e6]), 2)
    start = np.array([0.0, 0.0, 0.0, 0.0, 1.0, 0.0])
    found = extrapolate_points(problem, start, 1e-16, patience=10)
    assert not found.solved
    assert found.work["factorisations"] <= 10 + POINTS.steps


@pytest.mark.long
def test_sweeps_and_points_by_turns_solve_a_bed_that_each_alone_leaves() -> None:
    """A plane bed pushed against a wall (beds kicked 2 of the examination): turns take about 10,000
    sweeps and 500 factorisations; so many sweeps end above 1e-6, and twice as many factorisations
    from there above 1e-9."""
    problem = find_family("beds kicked").pose(2026, 2).problem
    space = problem.bodies
    found = solve_friction(space, problem.offset, problem.friction, 2)
    assert found.solved, found.message
    assert found.method.startswith("gauss-seidel + extrapolated points")
    swept = solve_gauss_seidel(problem, None, 1e-12, 10_000)
    assert swept.residual > 1e-6
    assert extrapolate_points(problem, swept.r, factorisations=1000).residual > 1e-9
    half = solve_gauss_seidel(problem, None, 1e-12, 1000, last=True)
    assert (
        half.residual > solve_gauss_seidel(problem, None, 1e-12, 1000).residual
    )  # the best one is past


@pytest.mark.long
def test_the_end_of_a_path_is_a_start_too() -> None:
    """A bed that sweeps, Newton and proximal points leave at 1e-8, from paths' ends alone."""
    trial = Trial(build_packing(60, 3, seed=208, friction=0.1), None, 1e-12)
    assert turn_from_paths(trial)
    assert trial.best.method.startswith("gauss-seidel + extrapolated points")
    assert trial.best.residual <= 1e-12


@pytest.mark.parametrize("method", [solve_proximal, extrapolate_points])
def test_an_answer_needs_no_mending(method) -> None:
    """An answer given as start is kept, at no cost."""
    problem = squeezed_row()
    exact = np.array([FRICTION + 2 * APPROACH, 0, FRICTION + APPROACH, 0, 1, -FRICTION])
    found = method(problem, exact, 1e-12)
    assert found.solved
    assert found.work["factorisations"] == 0
    np.testing.assert_array_equal(found.r, exact)
