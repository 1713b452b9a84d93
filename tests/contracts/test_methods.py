"""What every friction method satisfies: closed forms, a true residual, and a word where it fails.

A method need not solve everything, but must say what it did not.
"""

from __future__ import annotations

import inspect
from importlib import import_module

import numpy as np
import pytest

from rigid_lcp import solve_friction
from rigid_lcp.errors import RigidError
from rigid_lcp.friction.auto.solve import find_methods
from rigid_lcp.friction.problem.cones import find_natural_residual
from rigid_lcp.friction.problem.definition import FrictionProblem, FrictionSolution, make_problem
from tests.rigid_static_problems import beam, pyramid, table, tower

pytestmark = pytest.mark.lowest

TOLERANCE = 1e-10
SMALL = {
    "beam": beam(), "rough beam": beam(0.1, 0.5), "tower": tower(3), "pyramid": pyramid(3, 0.6),
    "table": table(),
}  # fmt: skip

every_method = pytest.mark.parametrize("name", find_methods())


def solve(problem: FrictionProblem, name: str) -> FrictionSolution | None:
    """What a method by itself finds; None where one of the plane refuses space with a remedy."""
    try:
        return solve_friction(
            problem.bodies or problem.delassus, problem.offset, problem.friction, problem.dim,
            tolerance=TOLERANCE, method=name,
        )  # fmt: skip
    except RigidError as refusal:
        if problem.dim == 2 or not refusal.remedy:
            raise
        return None


@every_method
def test_nothing_is_missing(name: str) -> None:
    """``METHOD`` is a function of problem, start and tolerance."""
    method = import_module(find_methods()[name]).METHOD
    assert callable(method), f"METHOD of {name} is no function"
    arguments = list(inspect.signature(method).parameters)
    assert arguments[:3] == ["problem", "start", "tolerance"], f"{name} takes {arguments}"


@every_method
@pytest.mark.parametrize("mu", [0.0, 0.2, 0.6])
@pytest.mark.parametrize("dim", [2, 3])
def test_block_on_a_slope(name: str, mu: float, dim: int) -> None:
    """A unit mass on a slope of 0.4: slides where mu < 0.4; r_N = m g cos, |r_T| <= mu r_N.

    By hand: r_T = -min(g sin, mu g cos).  A method of the plane refuses the block in space.
    """
    weight = 9.81 / np.hypot(1.0, 0.4)
    q = np.zeros(dim)
    q[0], q[-1] = -weight, 0.4 * weight
    friction = min(0.4, mu) * weight
    found = solve(make_problem(np.eye(dim), q, mu, dim), name)
    if found is None:
        return
    assert found.solved, found.message
    assert found.r[0] == pytest.approx(weight, rel=1e-9)
    assert found.r[-1] == pytest.approx(-friction, abs=1e-8)
    assert found.u[-1] == pytest.approx(0.4 * weight - friction, abs=1e-8)


@every_method
def test_nothing_approaches_so_there_are_no_forces(name: str) -> None:
    """Two contacts that open bear nothing."""
    found = solve_friction(np.eye(4), [1.0, 3.0, 0.5, -2.0], 0.7, 2, method=name)
    assert found.solved, found.message
    np.testing.assert_allclose(found.r, 0.0, atol=1e-12)


@every_method
@pytest.mark.parametrize("case", SMALL)
def test_what_is_said_is_true(name: str, case: str) -> None:
    """u = W r + q and the residual is that of r and u; solved, or a message with a remedy."""
    problem = SMALL[case]
    found = solve(problem, name)
    if found is None:
        return
    assert np.isfinite(found.r).all()
    np.testing.assert_allclose(found.u, problem.velocity(found.r), atol=1e-9)
    force, velocity = (x.reshape(-1, problem.dim) for x in (found.r, problem.velocity(found.r)))
    residual = find_natural_residual(force, velocity, problem.friction, problem.rho)
    assert found.residual == pytest.approx(residual, rel=1e-3, abs=1e-14)
    assert not found.solved or residual <= TOLERANCE
    assert found.solved or "->" in found.message, f"{name} does not say what to do about a {case}"
