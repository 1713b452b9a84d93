"""Proximal points: towers and jammed random problems to round-off, units, work in its budget."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from rigid_lcp.friction.attempts.proximal_newton import (
    find_proximal_point,
    hopeless,
    proximal_newton,
)
from rigid_lcp.friction.linear.factorisation import factorisation
from rigid_lcp.friction.methods.gauss_seidel import gauss_seidel
from rigid_lcp.friction.problem.definition import FrictionProblem, friction_problem
from validation.bench.rigid.packings import tower

Floats = NDArray[np.float64]


def jammed(seed: int, contacts: int, freedoms: int, dim: int) -> FrictionProblem:
    """More contacts than freedoms, ``q = J v`` so that all can be stopped: redundant."""
    g = np.random.default_rng(seed)
    jacobian = g.standard_normal((contacts * dim, freedoms))
    offset = jacobian @ g.standard_normal(freedoms)
    made: FrictionProblem = friction_problem(
        jacobian @ jacobian.T, offset, g.uniform(0.1, 1.0, contacts), dim
    )
    return made


@pytest.mark.parametrize("dim", [2, 3])
def test_towers_to_round_off_from_a_few_sweeps(dim: int) -> None:
    """Redundant corners, nothing slides: W is singular, each shifted system is not."""
    problem = tower(20, dim)
    start = gauss_seidel(problem, tolerance=1e-12, sweeps=50)
    found = proximal_newton(problem, start.r, 1e-13)
    assert found.solved, found.message
    assert found.work["factorisations"] < 40


@settings(max_examples=30, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10**6), dim=st.sampled_from([2, 3]), contacts=st.integers(2, 20))
def test_never_worse_than_its_start_and_within_its_budget(
    seed: int, dim: int, contacts: int
) -> None:
    problem = jammed(seed, contacts, max(2, contacts // 2), dim)
    start = gauss_seidel(problem, tolerance=1e-10, sweeps=20)
    found = proximal_newton(problem, start.r, 1e-11, factorisations=25)
    assert found.residual <= start.residual
    assert found.residual == pytest.approx(problem.residual(found.r), abs=1e-16)
    assert found.work["factorisations"] <= 25
    assert found.solved or "->" in found.message


def test_a_proximal_point_is_the_answer_of_the_shifted_problem() -> None:
    """``u = (W + alpha) r + q - alpha r_k``, judged by the residual of that problem."""
    problem = jammed(3, 12, 8, 2)
    centre = gauss_seidel(problem, tolerance=1e-10, sweeps=3).r
    alpha = 1.0 / problem.rho
    force, found, _ = find_proximal_point(problem, centre, alpha, factorisation(problem), 1e-14, 20)
    assert found
    shifted = friction_problem(
        sp.csr_array(problem.delassus + alpha * sp.eye_array(24)),
        problem.offset - alpha * centre, problem.friction, 2,
    )  # fmt: skip
    assert shifted.residual(force) < 1e-12
    assert problem.residual(force) > 1e-9  # one point is not yet the limit


def test_units_change_nothing() -> None:
    """W in other units (metres to millimetres, kg to g): the same points."""
    problem = jammed(5, 10, 6, 3)
    start = gauss_seidel(problem, tolerance=1e-10, sweeps=30).r
    here = proximal_newton(problem, start, 1e-12, factorisations=15)
    scaled = friction_problem(
        problem.delassus * 2.0**-10, problem.offset * 2.0**10, problem.friction, 3
    )
    there = proximal_newton(scaled, start * 2.0**20, 1e-12, factorisations=15)
    np.testing.assert_allclose(there.r, here.r * 2.0**20, rtol=1e-6, atol=1e-6 * abs(there.r).max())
    assert there.work == here.work


def test_ends_at_once_at_a_solution_and_without_a_start() -> None:
    problem = tower(3, 2)
    found = proximal_newton(problem, None, 1e-12)
    assert found.solved
    again = proximal_newton(problem, found.r, 1e-12)
    assert again.work["factorisations"] == 0
    np.testing.assert_array_equal(again.r, found.r)


def test_a_point_that_goes_in_a_circle_is_given_up() -> None:
    """Errors of a circle, of a way astray, and of points that were found, as they were measured."""
    circle = [4e-7, 7e-5, 5e-7, 7.00001e-5]
    astray = [7e-6, 9e-3, 2e-1, 8e-1]
    found = [2e-4, 2e-5, 9e-4, 6e-5, 3e-5, 3e-5 * 1.1, 6e-17]
    assert hopeless(circle)
    assert not hopeless(circle[:3])
    assert hopeless(astray)
    assert hopeless([1.0, np.nan])
    late = [2e-5, 8e-5, 4e-6, 2e-4, 8.5e-5, 3e-6, 6e-17]
    for errors in (found, late):
        assert not any(hopeless(errors[: k + 1]) for k in range(len(errors)))
