"""Peers of the friction solvers: same problem, same judge; how they fail is told, never lost.

The residual that judges all of them is checked against a plain twin in extended precision.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from rigid_lcp.errors import LibraryMissing
from rigid_lcp.friction_problem import BodySpace, FrictionProblem, friction_problem
from rigid_lcp.solver import solve_friction
from validation import rigid_peers as peers
from validation import rigid_report as report
from validation import rigid_runs as runs
from validation.rigid_cone_programs import library_missing, library_named
from validation.rigid_newton_polish import _natural_map, newton_polish
from validation.rigid_packings import tower
from validation.rigid_problems import NamedProblem, stored_problems

Floats = NDArray[np.float64]
needs_clarabel = pytest.mark.skipif(library_missing("clarabel"), reason="needs clarabel")
needs_osqp = pytest.mark.skipif(library_missing("osqp"), reason="needs osqp")
needs_siconos = pytest.mark.skipif(
    bool(peers.siconos_missing()), reason=f"needs Siconos: {peers.siconos_missing()}"
)


def residual_extended(problem: FrictionProblem, force: Floats) -> float:
    """``|r - P_K(r - rho (u + mu |u_T| n))| / |r|`` contact after contact in extended precision."""
    big = np.longdouble
    w = problem.delassus.toarray().astype(big)
    r = force.astype(big).reshape(-1, problem.dim)
    u = (w @ force.astype(big) + problem.offset.astype(big)).reshape(-1, problem.dim)
    rho = big(1) / np.diag(w).mean()
    squares = big(0)
    for c, mu in enumerate(problem.friction.astype(big)):
        slip = np.sqrt((u[c, 1:] ** 2).sum())
        x = r[c] - rho * np.concatenate([[u[c, 0] + mu * slip], u[c, 1:]])
        normal, tangential = x[0], np.sqrt((x[1:] ** 2).sum())
        if tangential <= mu * normal:
            nearest = x
        elif mu * tangential <= -normal:
            nearest = np.zeros_like(x)
        else:
            length = (normal + mu * tangential) / (1 + mu * mu)
            nearest = length * np.concatenate([[big(1)], mu * x[1:] / tangential])
        squares += ((r[c] - nearest) ** 2).sum()
    return float(np.sqrt(squares) / np.sqrt((r**2).sum()))


def random_problem(dim: int, contacts: int, seed: int, bodies: int = 3) -> FrictionProblem:
    """Contacts among a few bodies: W singular as soon as there are many of them."""
    generator = np.random.default_rng(seed)
    size = 3 * dim - 3
    jacobian = sp.csr_array(generator.normal(size=(dim * contacts, size * bodies)))
    inverse = sp.csr_array(sp.diags_array(generator.uniform(0.5, 2.0, size * bodies)))
    space = BodySpace(jacobian, inverse, size)
    offset = jacobian @ generator.normal(size=size * bodies)
    return friction_problem(space, offset, generator.uniform(0, 1, contacts), dim)  # type: ignore[no-any-return]


# --- the judge --------------------------------------------------------------------------------


@given(
    dim=st.sampled_from([2, 3]), contacts=st.integers(1, 8), seed=st.integers(0, 10**6),
    scale=st.sampled_from([1e-6, 1.0, 1e6]),
)  # fmt: skip
@settings(max_examples=40, deadline=None)
def test_residual_is_that_of_its_twin(dim: int, contacts: int, seed: int, scale: float) -> None:
    """Errors of order one agree to round-off: some ten roundings of sums of 24 terms at most."""
    problem = random_problem(dim, contacts, seed)
    force = scale * np.random.default_rng(seed).normal(size=dim * contacts)
    assert problem.residual(force) == pytest.approx(residual_extended(problem, force), rel=1e-13)


@pytest.mark.parametrize("dim", [2, 3])
def test_our_answers_hold_in_extended_precision(dim: int) -> None:
    """A residual of 1e-12 is no round-off of the judge's own."""
    for problem in (tower(5, dim), random_problem(dim, 6, 1)):
        w = problem.bodies if problem.bodies is not None else problem.delassus
        found = solve_friction(w, problem.offset, problem.friction, dim)
        assert found.solved
        assert residual_extended(problem, found.r) <= 2e-12


# --- peers that are Python packages -----------------------------------------------------------


def contact_space(problem: FrictionProblem) -> FrictionProblem:
    """The same problem without its bodies."""
    made: FrictionProblem = friction_problem(
        problem.delassus, problem.offset, problem.friction, problem.dim
    )
    return made


@needs_clarabel
@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("form", [contact_space, lambda problem: problem])
def test_clarabel(dim: int, form: Callable[[FrictionProblem], FrictionProblem]) -> None:
    """A tower sticks, so one convex program is Coulomb's law; in both spaces, with its cost."""
    problem = form(tower(4, dim))
    found = peers.clarabel(problem, 1e-6, 5.0)
    assert found.claims
    assert found.force is not None
    assert problem.residual(found.force) <= 1e-6
    assert (found.work, found.work_unit) == (1, "convex programs")
    assert found.cost_s is not None
    assert 0 < found.cost_s < 5.0


@needs_clarabel
def test_clarabel_freezes_sliding_again() -> None:
    """A block pushed along: convex alone it would lift off, with |u_T| frozen it slides on."""
    problem = friction_problem(np.eye(2), np.array([-1.0, 3.0]), 0.5, 2)
    found = peers.clarabel(problem, 1e-8, 5.0)
    assert found.force is not None
    assert found.force == pytest.approx([1.0, -0.5], abs=1e-7)  # r_T = -mu r_N, u_N = 0
    assert found.work is not None
    assert found.work > 1


@needs_clarabel
def test_clarabel_says_that_it_failed() -> None:
    """Without time for a second program, what it has is not claimed."""
    problem = friction_problem(np.eye(2), np.array([-1.0, 3.0]), 0.5, 2)
    found = peers.clarabel(problem, 1e-8, 1e-9)
    assert not found.claims
    assert found.why.startswith("1 programs")


@needs_clarabel
@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("dim", [2, 3])
def test_clarabel_with_newton(dim: int, seed: int) -> None:
    """To round-off on singular problems, some contacts sliding, one without friction."""
    problem = random_problem(dim, 5, seed)
    problem.friction[0] = 0.0
    found = peers.clarabel_newton(problem, 1e-12, 5.0)
    assert found.force is not None
    assert found.claims == (problem.residual(found.force) <= 1e-12)
    assert found.claims


@pytest.mark.parametrize("dim", [2, 3])
def test_derivative_of_newtons_map(dim: int) -> None:
    """``I - P' + P' rho S W`` against central differences of F, away from its kinks: 1e-6 for
    steps of 1e-6 and second derivatives of order one."""
    problem = random_problem(dim, 30, 2)
    force = np.random.default_rng(0).normal(size=30 * dim)
    rho = np.full(len(force), problem.rho)
    x = force - problem.rho * problem.velocity(force)  # not shifted by mu |u_T|: near enough
    normal, tangential = x[::dim], np.linalg.norm(x.reshape(-1, dim)[:, 1:], axis=1)
    assert (tangential < problem.friction * normal).any()  # sticking contacts,
    assert (np.abs(normal) < tangential).any()  # sliding ones
    assert (problem.friction * tangential < -normal).any()  # and open ones are among them
    _, (projection, dual) = _natural_map(problem, force, rho)
    blocks = (projection @ dual).toarray()
    exact = np.eye(len(force)) - projection.toarray()
    exact += rho[:, None] * (blocks @ problem.delassus.toarray())
    step = 1e-6
    for k, unit in enumerate(np.eye(len(force))):
        ahead, behind = (
            _natural_map(problem, force + sign * step * unit, rho)[0] for sign in (1, -1)
        )
        assert (ahead - behind) / (2 * step) == pytest.approx(exact[:, k], abs=1e-6)


def test_newton_keeps_its_best_point() -> None:
    """Out of time at once: the start comes back."""
    problem = random_problem(3, 4, 0)
    start = np.ones(12)
    force, steps = newton_polish(problem, start, 1e-12, -1.0)
    assert (force == start).all()
    assert steps == 0


@needs_osqp
def test_osqp() -> None:
    """Two masses on each other, f = their weights, and a third that parts; friction is refused."""
    a = np.array([[1.0, -1, 0], [-1, 2, 0], [0, 0, 1]])  # u_1 = f_1 - f_2, u_2 = 2 f_2 - f_1
    w = np.kron(a, np.diag([1.0, 0.0])) + np.diag([0.0, 1, 0, 1, 0, 1])
    problem = friction_problem(w, np.array([-1.0, 0, -1, 0, 1, 0]), 0.0, 2)
    found = peers.osqp(problem, 1e-8)
    assert found.claims
    assert found.force == pytest.approx([3.0, 0, 2, 0, 0, 0], rel=1e-12)
    assert found.force is not None
    assert problem.residual(found.force) <= 1e-14
    with pytest.raises(ValueError, match="no friction"):
        peers.osqp(tower(2, 2), 1e-8)


def test_missing_package() -> None:
    """What to install."""
    with pytest.raises(LibraryMissing, match="pip install no_such_peer"):
        library_named("no_such_peer")


# --- Siconos ----------------------------------------------------------------------------------


@needs_siconos
@pytest.mark.parametrize(("dim", "solver"), [(2, "2D_CPG"), (3, "3D_ADMM")])
def test_siconos(dim: int, solver: str) -> None:
    """The same problem in, an answer out that our judge accepts."""
    problem = tower(5, dim)
    found = peers.siconos(problem, solver, (1e-4, 1e-8), 1.0)
    assert found
    best = min(found, key=lambda run: problem.residual(run.force))  # type: ignore[arg-type]
    assert best.force is not None
    assert problem.residual(best.force) <= 1e-7
    assert all(run.cost_s is not None and run.cost_s >= 0 for run in found)


@needs_siconos
def test_siconos_in_space() -> None:
    """A plane problem given to a solver in space: forces of the plane come back."""
    problem = tower(5, 2)
    found = peers.siconos(problem, "3D_ADMM", (1e-8,), 1.0)
    assert any(run.force is not None and problem.residual(run.force) <= 1e-6 for run in found)


def test_plane_problem_in_space() -> None:
    """A solution stays one, with zeros along t2; no other coupling comes in."""
    problem = tower(3, 2)
    found = solve_friction(problem.delassus, problem.offset, problem.friction, 2)
    wide = peers.in_space(problem)
    force = np.column_stack([found.r.reshape(-1, 2), np.zeros(problem.contacts)]).ravel()
    assert wide.residual(force) <= 1e-12
    velocity = wide.velocity(force).reshape(-1, 3)
    assert velocity[:, :2].ravel() == pytest.approx(found.u, abs=1e-15)
    assert (velocity[:, 2] == 0).all()


def test_solvers_of_siconos_by_size() -> None:
    """Large plane problems go to sparse solvers too, and to no dense ones."""
    small, large = tower(10, 2), tower(600, 2)
    assert peers.siconos_solvers(small) == ["2D_NSGS", "2D_CPG", "2D_LEMKE"]
    assert peers.siconos_solvers(large) == ["3D_NSGS", "3D_ADMM"]


def test_budgets() -> None:
    """More time for Siconos on large packings alone."""
    large = tower(300, 2)
    tall, packed = (NamedProblem(name, "x", lambda: large) for name in ("tower", "discs"))
    assert runs.budget(tall, large, "Siconos 3D_NSGS") == runs.SICONOS_S[0]
    assert runs.budget(packed, large, "Siconos 3D_NSGS") == runs.SICONOS_S[runs.LARGE]
    assert runs.budget(packed, large, "rigid_lcp") == runs.MOST_S
    assert runs.tolerances(large) == runs.LADDER
    assert runs.tolerances(tower(2, 2)) == runs.TOLERANCES


@needs_siconos
def test_siconos_wrong_answer_is_seen() -> None:
    """Its 2D Lemke solver reports success on a stored tower with an answer that is none."""
    stored = {each.name: each for each in stored_problems()}
    if "tower2d_10" not in stored:
        pytest.skip("TRACKBED_DATA does not name the folder that holds friction_problems")
    named = stored["tower2d_10"]
    problem = named.make()
    (found,) = peers.siconos(problem, "2D_LEMKE", (1e-8,), 1.0)
    assert found.claims
    line = runs.row_of(named, problem, "Siconos 2D_LEMKE", found, 1.0)
    assert not line["ok"]
    assert report.wrong_answers([line]) == [line]
    assert report.outcome([line]) == "wrong, though it says solved"


@needs_siconos
def test_siconos_that_dies_is_named() -> None:
    """A process that ends is a result; the next tolerance is tried."""
    found = peers.siconos(tower(2, 3), "3D_NO_SUCH_SOLVER", (1e-4, 1e-8), 1.0)
    assert [run.force for run in found] == [None, None]
    assert all("SICONOS_FRICTION_3D_NO_SUCH_SOLVER" in run.why for run in found)


def test_siconos_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    """What to install."""
    monkeypatch.setattr(peers, "siconos_missing", lambda: "apt-get install it")
    with pytest.raises(LibraryMissing, match="apt-get install it"):
        peers.siconos(tower(2, 2), "2D_CPG", (1e-4,), 1.0)


@pytest.mark.parametrize(
    ("code", "said", "words"),
    [
        (0, "nonsense", ""),
        (-24, "", "out of time"),
        (-6, "a\nAssertion `x' failed.\n\n", "died of SIGABRT: Assertion `x' failed."),
        (-11, "", "died of SIGSEGV: "),
        (3, "no", "ended with code 3: no"),
    ],
)
def test_how_a_process_died(code: int, said: str, words: str) -> None:
    """Signals by name, with the last that was said."""
    assert peers.death_words(code, said) == words
