"""Extrapolated proximal points: a drift of known length, a packing that nothing else solves, units,
work in its budget."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from rigid_lcp import solve_friction
from rigid_lcp.friction.attempts.extrapolated_points import POINTS, extrapolated_points
from rigid_lcp.friction.attempts.proximal_newton import find_proximal_point, proximal_newton
from rigid_lcp.friction.auto.paths import turn_from_paths
from rigid_lcp.friction.auto.trial import Trial
from rigid_lcp.friction.linear.factorisation import factorisation
from rigid_lcp.friction.methods.gauss_seidel import gauss_seidel
from rigid_lcp.friction.problem.definition import FrictionProblem, friction_problem
from validation.bench.rigid.examination import family_named
from validation.bench.rigid.packings import packing

Floats = NDArray[np.float64]

FRICTION, APPROACH = 0.5, 1e-9


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
    made: FrictionProblem = friction_problem(
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
    monkeypatch.setattr(sys.modules[extrapolated_points.__module__], "POINTS", first)
    problem = squeezed_row()
    start = np.array([0.0, 0.0, 0.0, 0.0, 1.0, 0.0])
    linear, alpha = factorisation(problem), POINTS.first_shift / problem.rho
    once, found, _ = find_proximal_point(problem, start, alpha, linear, 1e-14, 5)
    assert found
    squeeze = np.array([1.0, 0.0, 1.0, 0.0, 0.0, -1.0]) / 3.0
    assert squeeze @ once == pytest.approx(APPROACH / (3.0 * alpha), rel=1e-4)
    plain = FRICTION * 3.0 * alpha / APPROACH
    ended = extrapolated_points(problem, start, 1e-14)
    assert ended.solved, ended.message
    exact = [FRICTION + 2 * APPROACH, 0, FRICTION + APPROACH, 0, 1, -FRICTION]
    np.testing.assert_allclose(ended.r, exact, atol=1e-13)
    np.testing.assert_allclose(ended.u[5], APPROACH, rtol=1e-4)
    assert ended.work["points"] < 50 < plain / 50


@pytest.mark.long
def test_solves_a_packing_of_low_friction_that_nothing_else_does() -> None:
    """100 spheres, friction 0.1: Newton, proximal points and the interior point end above 1e-9."""
    problem = packing(100, 3, seed=101, friction=0.1)
    near = gauss_seidel(problem, None, 1e-10, 300)
    plain = proximal_newton(problem, near.r, 1e-12)
    assert plain.residual > 1e-9
    found = solve_friction(problem.bodies, problem.offset, problem.friction, 3)
    assert found.solved, found.message
    assert found.residual <= 1e-12


def test_points_without_gain_are_left_after_their_patience() -> None:
    """A wall that comes nearer and nearer with no ground to give way: no residual is halved."""
    problem = squeezed_row()
    problem = friction_problem(problem.delassus, problem.offset, np.array([0.0, 0.0, 1e6]), 2)
    start = np.array([0.0, 0.0, 0.0, 0.0, 1.0, 0.0])
    found = extrapolated_points(problem, start, 1e-16, patience=10)
    assert not found.solved
    assert found.work["factorisations"] <= 10 + POINTS.steps


@pytest.mark.long
def test_sweeps_and_points_by_turns_solve_a_bed_that_each_alone_leaves() -> None:
    """A plane bed pushed against a wall (beds kicked 2 of the examination): turns take about 10,000
    sweeps and 500 factorisations; so many sweeps end above 1e-6, and twice as many factorisations
    from there above 1e-9."""
    problem = family_named("beds kicked").posed(2026, 2).problem
    space = problem.bodies
    found = solve_friction(space, problem.offset, problem.friction, 2)
    assert found.solved, found.message
    assert found.method.startswith("gauss-seidel + extrapolated points")
    swept = gauss_seidel(problem, None, 1e-12, 10_000)
    assert swept.residual > 1e-6
    assert extrapolated_points(problem, swept.r, factorisations=1000).residual > 1e-9
    half = gauss_seidel(problem, None, 1e-12, 1000, last=True)
    assert half.residual > gauss_seidel(problem, None, 1e-12, 1000).residual  # the best one is past


def test_the_end_of_a_path_is_a_start_too() -> None:
    """A bed that sweeps, Newton and proximal points leave at 1e-8, from paths' ends alone."""
    trial = Trial(packing(60, 3, seed=208, friction=0.1), None, 1e-12)
    assert turn_from_paths(trial)
    assert trial.best.method.startswith("gauss-seidel + extrapolated points")
    assert trial.best.residual <= 1e-12


@settings(max_examples=20, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10**6), dim=st.sampled_from([2, 3]), contacts=st.integers(1, 20))
def test_never_worse_than_its_start_and_within_its_budget(
    seed: int, dim: int, contacts: int
) -> None:
    """Random redundant contacts that can all be stopped, ``q = J v``."""
    g = np.random.default_rng(seed)
    jacobian = g.standard_normal((contacts * dim, max(2, contacts // 2)))
    problem = friction_problem(
        jacobian @ jacobian.T, jacobian @ g.standard_normal(jacobian.shape[1]),
        g.choice([0.0, 0.1, 0.5, 2.0], contacts), dim,
    )  # fmt: skip
    start = gauss_seidel(problem, tolerance=1e-10, sweeps=20)
    found = extrapolated_points(problem, start.r, 1e-11, factorisations=40)
    assert found.residual <= start.residual
    assert found.residual == pytest.approx(problem.residual(found.r), abs=1e-16)
    assert found.work["factorisations"] <= 40
    assert found.solved or "->" in found.message


@pytest.mark.parametrize("units", [(1e3, 1.0), (1.0, 1e-6), (1e3, 1e3)])
def test_units_change_nothing(units: tuple[float, float]) -> None:
    """Lengths and masses in other units (powers of ten): the same squeeze, to round-off."""
    length, mass = units
    problem = squeezed_row()
    other = friction_problem(
        problem.delassus.toarray() / mass, problem.offset * length, problem.friction, 2
    )
    found = extrapolated_points(other, None, 1e-13)
    assert found.solved, found.message
    force = found.r / (mass * length)
    np.testing.assert_allclose(force[[0, 2]], [FRICTION, FRICTION], atol=1e-8)


def test_an_answer_needs_no_mending() -> None:
    """An answer given as start is kept, at no cost."""
    problem = squeezed_row()
    exact = np.array([FRICTION + 2 * APPROACH, 0, FRICTION + APPROACH, 0, 1, -FRICTION])
    found = extrapolated_points(problem, exact, 1e-12)
    assert found.solved
    assert found.work["factorisations"] == 0
    np.testing.assert_array_equal(found.r, exact)
