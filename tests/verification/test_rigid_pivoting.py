"""Pivoting along a path: it does not cycle at any friction, and a near start saves pivots."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigid_lcp.errors import ProblemError
from rigid_lcp.friction.methods.dantzig import solve_dantzig
from rigid_lcp.friction.methods.pivoting import solve_pivoting
from rigid_lcp.friction.problem.definition import FrictionSolution, make_problem
from rigid_lcp.friction.problem.proofs import prove_forces_insufficient
from tests.rigid_networks import network, stored, tower

TOLERANCE = 1e-12
Method = Callable[..., FrictionSolution]
both = pytest.mark.parametrize("method", [solve_pivoting, solve_dantzig])


@pytest.mark.parametrize("mu", [0.0, 0.1, 0.3, 0.5, 0.8, 1.0])
@pytest.mark.parametrize("seed", range(3))
def test_networks_at_every_friction(mu: float, seed: int) -> None:
    """Where the paper's driving cycles (mu >= 0.3) the path ends in a solution, to 1e-12."""
    found = solve_pivoting(network(120, mu, seed))
    assert found.solved, found.message
    assert found.residual <= TOLERANCE


@pytest.mark.parametrize("mu", [0.1, 0.3, 0.5, 0.8])
def test_lemkes_path_from_no_forces(mu: float) -> None:
    """d = n from far: it needs no start at all."""
    found = solve_pivoting(network(60, mu, 5), sweeps=0)
    assert found.solved, found.message
    assert found.work["sweeps"] == 0
    assert found.work["pivots"] > 0


def test_a_near_start_saves_pivots() -> None:
    """From the solution of a problem that is 1e-3 away: a tenth of the pivots of Lemke's path."""
    problem = network(120, 0.5)
    first = solve_pivoting(problem, sweeps=0)
    moved = make_problem(
        problem.delassus,
        problem.offset * (1 + 1e-3 * np.random.default_rng(0).normal(size=len(problem.offset))),
        0.5, 2,
    )  # fmt: skip
    warm = solve_pivoting(moved, first.r)
    assert first.solved
    assert warm.solved, warm.message
    assert warm.work["pivots"] < 0.1 * first.work["pivots"]


def test_a_solution_is_returned_as_it_is() -> None:
    """A start at or below the tolerance needs no pivot."""
    problem = network(60, 0.5)
    first = solve_pivoting(problem)
    again = solve_pivoting(problem, first.r)
    assert (again.r == first.r).all()
    assert again.work["pivots"] == 0


@pytest.mark.parametrize("start", ["zero", "random", "far"])
def test_any_start_will_do(start: str) -> None:
    """Forces outside the cones, or 1e6 times too large, are only a place to begin."""
    problem = network(60, 0.5, 2)
    g = np.random.default_rng(1)
    size = {"zero": 0.0, "random": 1e-2, "far": 1e4}[start]
    found = solve_pivoting(problem, size * g.normal(size=len(problem.offset)))
    assert found.solved, found.message


@both
@pytest.mark.parametrize("top", [1.0, 1e4])
@pytest.mark.parametrize("mu", [0.1, 0.5])
def test_redundant_towers(mu: float, top: float, method: Method) -> None:
    """10 boxes, the top one up to 1e4 heavier: each face carries what is above it."""
    found = method(tower(10, mu, top))
    assert found.solved, found.message
    weight = 9.81e-3 * (top + np.arange(9, -1, -1.0))
    assert found.r[::2].reshape(10, 2).sum(axis=1) == pytest.approx(weight, rel=1e-9)


OFFSETS = st.floats(-2.0, 2.0).map(lambda x: x if abs(x) > 1e-9 else 0.0)
"""Where b_N is 1e-79 of b_T, round-off in the one is all there is of the other's forces."""


@given(
    st.sampled_from([partial(solve_pivoting, sweeps=0), solve_dantzig]), OFFSETS, OFFSETS,
    st.floats(0.0, 3.0), st.floats(-0.9, 0.9),
)  # fmt: skip
@settings(max_examples=100)
def test_one_contact_by_cases(method, normal, tangential, mu, skew):
    """One contact with W = [[1, k], [k, 1]]: whatever is found obeys eq. 27."""
    skew = skew if method is not solve_dantzig else 0.0  # it may cycle where W couples strongly
    problem = make_problem([[1.0, skew], [skew, 1.0]], [normal, tangential], mu, 2)
    found = method(problem)
    force, velocity = found.r, found.u
    small = 1e-9 * (1.0 + abs(force).max())
    assert found.solved
    assert force[0] >= 0
    assert velocity[0] >= -small
    assert abs(force[0] * velocity[0]) <= small
    assert abs(force[1]) <= mu * force[0] + small
    assert abs(velocity[1]) * (mu * force[0] - abs(force[1])) <= small
    assert force[1] * velocity[1] <= small


def test_no_solution_is_proved() -> None:
    """The sliding rod beyond Painleve's limit: a linear programme finds no forces at all."""
    w = [[1.6, 1.2], [1.2, 3.4]]
    assert solve_pivoting(
        make_problem(w, [-1.0, 0.0], 2.0, 2), tangential_velocity=np.array([1.0])
    ).status == "no solution"  # fmt: skip
    immovable = make_problem(np.zeros((3, 3)), [-1.0, 0.0, 0.0], 0.0, 3)
    assert solve_pivoting(immovable).status == "no solution"
    at_rest = solve_pivoting(make_problem(w, [-1.0, 0.0], 2.0, 2))
    assert at_rest.solved


def test_a_matrix_not_quite_symmetric() -> None:
    """Stored problems are asymmetric by 1e-3."""
    problem = network(60, 0.5)
    w = problem.delassus.copy()
    w.data *= 1 + 1e-3 * np.random.default_rng(0).uniform(-1, 1, w.nnz)
    assert solve_pivoting(make_problem(w, problem.offset, 0.5, 2)).solved


def test_a_few_pivots_only(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is given up says so, with its best point."""
    module = sys.modules[solve_pivoting.__module__]
    monkeypatch.setattr(module, "PIVOTING", replace(module.PIVOTING, pivots=-1))
    problem = network(60, 0.5)
    found = solve_pivoting(problem, sweeps=0)
    assert found.status == "not converged"
    assert found.residual == problem.residual(found.r) > TOLERANCE
    assert found.message


@both
def test_nothing_to_do(method: Method) -> None:
    """No contacts; only parting ones; 3D with friction is refused."""
    assert method(make_problem(np.zeros((0, 0)), [], 0.3, 2)).solved
    parting = method(make_problem(np.eye(4), [1.0, 0.0, 0.0, 0.0], 0.3, 2))
    assert parting.solved
    assert (parting.r == 0).all()
    assert parting.work["pivots"] == 0
    with pytest.raises(ProblemError, match="circle"):
        method(make_problem(np.eye(3), -np.ones(3), 0.3, 3))


@pytest.mark.parametrize(
    "name", ["tower2d_10", "tower2d_10_m1e4", "discs_125", "FrictionContactProblem00237.dat"]
)
def test_real_problems(name: str) -> None:
    """Stored problems, at the friction they came with and at 0.3 and 0.8."""
    for mu in (None, 0.3, 0.8):
        assert solve_pivoting(stored(name, mu)).solved


@both
@pytest.mark.parametrize("below", [1e-3, 1e-6, 1e-8, 1e-10, -1e-10, -1e-8, -1e-6, -1e-3, 0.0])
def test_either_side_of_painleves_limit(below: float, method: Method) -> None:
    """W = [[1, 3/4], [3/4, 2]], slip against it: ``f_N = 1 / (1 - 3/4 mu)`` below mu = 4/3.

    The shift that the methods begin with is larger than that pivot; it must hide neither its size
    nor its sign.  The pivot is known to round-off only.
    """
    mu = 4 / 3 * (1 - below)
    problem = make_problem([[1.0, 0.75], [0.75, 2.0]], [-1.0, 0.0], mu, 2)
    found = method(problem, None, TOLERANCE, tangential_velocity=np.array([1.0]))
    if below > 0:
        assert found.solved, found.message
        assert found.r[0] == pytest.approx(1 / (1 - 0.75 * mu), rel=1e-9 + 4e-16 / below)
    else:
        assert found.status == "no solution"


@both
@pytest.mark.parametrize("mu", [0.0, 0.5])
def test_a_contact_that_bears_on_no_mass(mu: float, method: Method) -> None:
    """It approaches whatever its force is; as that grows the residual falls, and solves nothing."""
    w, q = np.diag([1.0, 1.0, 0.0, 0.0]), np.array([-1.0, 0.3, -1.0, 0.0])
    found = method(make_problem(w, q, mu, 2), None, 1e-6)
    assert found.residual <= 1e-6
    assert found.status == "no solution"


@pytest.mark.parametrize("light", [1e-6, 1e-9, 1e-12])
def test_a_contact_that_bears_on_much_mass(light: float) -> None:
    """W = 1e-12 of another contact's is small, not zero: the force is ``1 / light``."""
    w, q = np.diag([1.0, 1.0, light, light]), np.array([-1.0, 0.3, -1.0, 0.0])
    problem = make_problem(w, q, 0.5, 2)
    found = solve_pivoting(problem)
    assert found.solved
    assert found.r[2] == pytest.approx(1 / light)
    assert not prove_forces_insufficient(problem, np.zeros(2, dtype=np.int64))
