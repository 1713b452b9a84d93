"""Options of the methods called by themselves: kept, or refused in one of our sentences."""

from __future__ import annotations

import numpy as np
import pytest

from rigid_lcp.errors import ProblemError, UsageError
from rigid_lcp.friction.methods.dantzig import solve_dantzig
from rigid_lcp.friction.methods.gauss_seidel import solve_gauss_seidel
from rigid_lcp.friction.methods.interior_point import solve_interior_point
from rigid_lcp.friction.methods.newton import solve_newton
from rigid_lcp.friction.methods.pivoting import solve_pivoting
from rigid_lcp.friction.problem.definition import make_problem

PROBLEM = make_problem(np.diag([1.0, 2.0, 1.0, 2.0]), [-1.0, 0.5, 1.0, 0.0], 0.5, 2)


@pytest.mark.parametrize("method", [solve_dantzig, solve_pivoting])
@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, "a", None])
def test_tolerances_that_are_none_are_named(method, value):
    with pytest.raises(UsageError, match=rf"^tolerance: .*{value}.*\n  -> give"):
        method(PROBLEM, tolerance=value)


@pytest.mark.parametrize("value", ["a", -1, 0.5, None])
def test_sweeps_that_are_none_are_named(value):
    with pytest.raises(UsageError, match=r"^sweeps: .*\n  -> give a count"):
        solve_pivoting(PROBLEM, sweeps=value)


@pytest.mark.parametrize("method", [solve_dantzig, solve_pivoting])
@pytest.mark.parametrize("value", ["a", [1.0], [np.nan, 1.0], ["a", "b"], [1j, 0.0]])
def test_tangential_velocities_that_are_none_are_named(method, value):
    with pytest.raises(ProblemError, match="tangential_velocity"):
        method(PROBLEM, tangential_velocity=value)


COUNTS = {
    solve_newton: "iterations",
    solve_gauss_seidel: "sweeps",
    solve_interior_point: "iterations",
}


@pytest.mark.parametrize("method", COUNTS)
def test_tolerances_and_counts_that_are_none_are_named(method):
    """Text was an error of the compiler, -1 a solve without an end or without a step."""
    for tolerance in (-1.0, np.nan, "a", None):
        with pytest.raises(UsageError, match=rf"^tolerance: .*{tolerance}.*\n  -> give"):
            method(PROBLEM, tolerance=tolerance)
    for count in (-1, 2.5, "a", None, True):
        with pytest.raises(UsageError, match=rf"^{COUNTS[method]}: .*\n  -> give a count"):
            method(PROBLEM, **{COUNTS[method]: count})
    assert method(PROBLEM, **{COUNTS[method]: 0}).status == "not converged"


@pytest.mark.parametrize("method", [solve_newton, solve_gauss_seidel])
@pytest.mark.parametrize("start", [[np.nan] * 4, [np.inf] * 4, [1.0, 2.0], "a", [1j] * 4])
def test_starts_that_are_none_are_named(method, start):
    """NaN came back as the best forces known."""
    with pytest.raises(ProblemError, match=r"^start: .*\n  -> "):
        method(PROBLEM, start=start)
    assert method(PROBLEM, start=[[1.0, 0.0], [0.0, 0.0]]).solved
