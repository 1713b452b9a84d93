"""The race's peers and its reading: same problem, same judge; no run is lost."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from rigid_lcp.friction.auto.solve import solve_friction
from rigid_lcp.friction.problem.definition import FrictionProblem, make_problem
from validation.bench.rigid.examination import find_family
from validation.bench.rigid.friction_problems import NamedProblem
from validation.bench.rigid.packings import build_tower
from validation.studies.rigid_solvers import peers, reading, run
from validation.studies.rigid_solvers.newton import _evaluate_map, polish_forces

pytestmark = pytest.mark.studies
needs_clarabel = pytest.mark.skipif(not peers.is_installed("clarabel"), reason="needs clarabel")
needs_osqp = pytest.mark.skipif(not peers.is_installed("osqp"), reason="needs osqp")
needs_siconos = pytest.mark.skipif(not peers.has_siconos(), reason="needs Siconos")


def random_problem(dim: int, contacts: int) -> FrictionProblem:
    """Contacts with any symmetric positive definite W."""
    generator = np.random.default_rng(2)
    factor = generator.normal(size=(dim * contacts, dim * contacts))
    made: FrictionProblem = make_problem(
        factor @ factor.T, 10 * generator.normal(size=dim * contacts),
        generator.uniform(0, 1, contacts), dim,
    )  # fmt: skip
    return made


def contact_space(problem: FrictionProblem) -> FrictionProblem:
    """The same problem without its bodies."""
    made: FrictionProblem = make_problem(
        problem.delassus, problem.offset, problem.friction, problem.dim
    )
    return made


@needs_clarabel
@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("form", [contact_space, lambda problem: problem])
def test_clarabel(dim: int, form: Callable[[FrictionProblem], FrictionProblem]) -> None:
    """A tower sticks, so one convex program is Coulomb's law; in both spaces."""
    problem = form(build_tower(4, dim))
    found = peers.solve_by_clarabel(problem, 1e-6, 5.0, outer=1)
    assert found.claims
    assert problem.residual(found.force) <= 1e-6


@needs_clarabel
def test_clarabel_freezes_sliding_again() -> None:
    """A block pushed along: convex alone it would lift off, with |u_T| frozen it slides on; without
    time for a second program what it has is not claimed."""
    problem = make_problem(np.eye(2), np.array([-1.0, 3.0]), 0.5, 2)
    found = peers.solve_by_clarabel(problem, 1e-8, 5.0)
    assert found.force == pytest.approx([1.0, -0.5], abs=1e-7)  # r_T = -mu r_N, u_N = 0
    assert not peers.solve_by_clarabel(problem, 1e-8, 0.0).claims


@needs_clarabel
@pytest.mark.parametrize("dim", [2, 3])
def test_hybrid(dim: int) -> None:
    """To round-off on problems of random bodies, one contact without friction."""
    problem = find_family("random assemblies").pose(5, dim - 2).problem
    problem.friction[0] = 0.0
    found = peers.solve_by_hybrid(problem, 1e-12, 5.0)
    assert found.claims == (problem.residual(found.force) <= 1e-12)


@pytest.mark.parametrize("dim", [2, 3])
def test_derivative_of_newtons_map(dim: int) -> None:
    """``I - P' + P' rho S W`` against central differences of F, away from its kinks: 1e-6 for
    steps of 1e-6 and second derivatives of order one."""
    problem = random_problem(dim, 30)
    force = np.random.default_rng(0).normal(size=30 * dim)
    rho = np.full(len(force), problem.rho)
    x = force - problem.rho * problem.velocity(force)  # not shifted by mu |u_T|: near enough
    normal, tangential = x[::dim], np.linalg.norm(x.reshape(-1, dim)[:, 1:], axis=1)
    assert (tangential < problem.friction * normal).any()  # sticking contacts,
    assert (np.abs(normal) < tangential).any()  # sliding ones
    assert (problem.friction * tangential < -normal).any()  # and open ones are among them
    _, (projection, dual) = _evaluate_map(problem, force, rho)
    blocks = (projection @ dual).toarray()
    exact = np.eye(len(force)) - projection.toarray()
    exact += rho[:, None] * (blocks @ problem.delassus.toarray())
    step = 1e-6
    for k, unit in enumerate(np.eye(len(force))):
        ahead, behind = (
            _evaluate_map(problem, force + sign * step * unit, rho)[0] for sign in (1, -1)
        )
        assert (ahead - behind) / (2 * step) == pytest.approx(exact[:, k], abs=1e-6)


def test_newton_keeps_its_best_point() -> None:
    """Out of time at once: the start comes back."""
    problem = random_problem(3, 4)
    start = np.ones(12)
    force, steps = polish_forces(problem, start, 1e-12, -1.0)
    assert (force == start).all()
    assert steps == 0


@needs_osqp
def test_osqp() -> None:
    """Two masses on each other, f = their weights, and a third that parts; friction is refused."""
    a = np.array([[1.0, -1, 0], [-1, 2, 0], [0, 0, 1]])  # u_1 = f_1 - f_2, u_2 = 2 f_2 - f_1
    w = np.kron(a, np.diag([1.0, 0.0])) + np.diag([0.0, 1, 0, 1, 0, 1])
    problem = make_problem(w, np.array([-1.0, 0, -1, 0, 1, 0]), 0.0, 2)
    found = peers.solve_by_osqp(problem, 1e-8)
    assert found.force == pytest.approx([3.0, 0, 2, 0, 0, 0], rel=1e-12)
    with pytest.raises(ValueError, match="no friction"):
        peers.solve_by_osqp(build_tower(2, 2), 1e-8)


@needs_siconos
@pytest.mark.parametrize(("dim", "solver"), [(2, "2D_CPG"), (3, "3D_ADMM"), (2, "3D_ADMM")])
def test_siconos(dim: int, solver: str) -> None:
    """The same problem in, an answer out that our judge accepts; one that dies gives none."""
    problem = build_tower(5, dim)
    found = peers.solve_by_siconos(problem, solver, 1e-8, 1.0)
    assert min(problem.residual(answer.force) for answer in found) <= 1e-6
    assert peers.solve_by_siconos(problem, f"{dim}D_NO_SUCH_SOLVER", 1e-8, 1.0) == []


def test_plane_problem_in_space() -> None:
    """A solution stays one, with zeros along t2; no other coupling comes in."""
    problem = build_tower(3, 2)
    found = solve_friction(problem.delassus, problem.offset, problem.friction, 2)
    force = np.column_stack([found.r.reshape(-1, 2), np.zeros(problem.contacts)]).ravel()
    assert peers.lift_to_space(problem).residual(force) <= 1e-12


@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_what_takes_too_long_is_ended() -> None:
    """By its processor time; a job that ends in time is reported."""

    def endless() -> dict[str, float]:
        while True:
            pass

    assert run.run_limited(endless, 1.0) is None
    assert run.run_limited(lambda: {"value": 1.0}, 10.0) == {"value": 1.0}


def test_race_and_reading() -> None:
    """A small tower: ours reaches the bar; of other runs those stay that none beats in both."""
    row = run.race(NamedProblem("tower2d_2", "towers 2D", lambda: build_tower(2, 2)))
    row["part"] = "tower2d_2"
    assert reading.find_cost(row, run.OURS) < 1.0
    assert reading.find_least_error(row, run.OURS) <= row["bar"]
    row["runs"]["Siconos"] = run.keep_best([
        [1e-4, 2.0, 1e-5, True], [1e-8, 3.0, 1e-4, True], [1e-8, 4.0, 1e-13, True],
        [1e-8, 1.0, None, False],
    ])  # fmt: skip
    assert [kept[1] for kept in row["runs"]["Siconos"]] == [2.0, 4.0]
    assert reading.list_ratios([row], "Siconos")["tower2d_2"] < 1.0
    assert reading.find_profile([row], "Siconos", (run.OURS, "Siconos"), [1.0, 1e9]).tolist() == [
        0,
        1,
    ]
