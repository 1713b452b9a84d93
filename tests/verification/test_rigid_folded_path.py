"""The path by arc length: its points lie on the curve, it goes round folds, and it solves."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

from rigid_lcp import folded_path as folded
from rigid_lcp.body_factorisation import SingularSystem, Solve, factorisation
from rigid_lcp.folded_path import Border, Curve, Place, Step, curve_begin, folded_path, settled
from rigid_lcp.friction_problem import FrictionProblem, friction_problem
from rigid_lcp.smoothed_path import smoothed_path
from tests.verification.test_rigid_smoothed_path import plain_map, units_change_nothing
from validation.bench.rigid.packings import packing

Floats = NDArray[np.float64]
SEEDS = range(4)
Taken = tuple[Curve, Place, Place, float]
"""A curve, a point of it, its tangent, and the |r| that measured it."""


def wedged(seed: int, count: int = 30, friction: float = 0.8) -> FrictionProblem:
    """A settled bed of discs in a box, hit by thirty times what its weight does in a time step: the
    walls hold it by a self-stress."""
    still = packing(count, 2, seed=seed, friction=friction)
    assert still.bodies is not None
    hit = np.random.default_rng(seed).standard_normal(still.bodies.jacobian.shape[1])
    push = still.bodies.jacobian @ hit
    push *= 30.0 * np.linalg.norm(still.offset) / np.linalg.norm(push)
    made: FrictionProblem = friction_problem(still.bodies, still.offset + push, still.friction, 2)
    return made


@pytest.fixture(scope="module")
def steps() -> list[Taken]:
    """Of each bed up to sixty steps."""
    taken = []
    for seed in SEEDS:
        problem = wedged(seed)
        curve = Curve(problem, factorisation(problem), np.inf)
        step = Step(curve, curve_begin(curve))
        for _ in range(60):
            if not step.take():
                break
            size = step.curve.length(step.tangent)
            assert size == pytest.approx(1.0, abs=folded.RESIZED)
            taken.append((step.curve, step.here, step.tangent, curve.size))
    return taken


def test_points_lie_on_the_curve(steps: list[Taken]) -> None:
    """``F = 0`` by the plain twin, the term |u_T| counting by ``1 - sigma / sigma_1``, to within
    the error at which a point counts as found, `CLOSE` of ``sqrt(sigma)``."""
    assert len(steps) > 60
    for curve, here, *_ in steps:
        problem, shape = curve.problem, (-1, 2)
        share = 1.0 - np.exp(here.level)
        sigma = curve.sigma * np.exp(here.level)
        eps = folded.ROUNDING * np.sqrt(sigma) / curve.rho.mean()
        velocity = problem.velocity(here.force).reshape(shape)
        found = plain_map(
            here.force.reshape(shape), velocity, problem.friction, curve.rho, sigma, eps, share
        )
        assert np.abs(found).max() < folded.CLOSE * np.sqrt(sigma)


def test_tangents_lead_along_the_curve(steps: list[Taken]) -> None:
    """``F_r t_r + F_level t_level = 0``, to within a hundredth of ``sqrt(sigma)`` and of what F
    changes by along the level alone (differences, and the shift in the matrix).  A step keeps the
    tangent of its last factorisation, not quite at the point: off by less than a step may turn."""
    for curve, here, tangent, size in steps:
        curve.size = size
        exact = Border(curve, here, *curve.at(here)[1:]).tangent(tangent)
        ends = [curve.at(here.plus(exact, sign * 1e-6))[0] for sign in (1, -1)]
        along = np.linalg.norm(ends[0] - ends[1]) / 2e-6
        assert along < 1e-2 * (1.0 + np.linalg.norm(curve.by_level(here)))
        cosine = curve.product(exact, tangent) / curve.length(tangent)
        assert cosine > folded.TURN


def test_it_goes_round_folds(steps: list[Taken]) -> None:
    """On some bed sigma rises again, and falls again behind that; it never comes back to where the
    curve began."""
    rising = [tangent.level > 0.0 for _, _, tangent, _ in steps]
    assert any(one and not other for one, other in pairwise(rising))
    assert all(here.level < 0.0 for _, here, *_ in steps)


def test_it_solves_beds_whose_path_folds() -> None:
    """By itself; the smoothed path ends short on some of them.  The residual is the judge."""
    problems = [wedged(seed) for seed in SEEDS]
    found = [folded_path(problem) for problem in problems]
    for problem, one in zip(problems, found, strict=True):
        assert one.solved
        assert problem.residual(one.r) <= 1e-12
    assert any(one.work["folds"] >= 2.0 for one in found)
    assert not all(smoothed_path(problem).solved for problem in problems)


def test_the_curve_begins_at_the_one_point_of_a_convex_problem() -> None:
    """From forces three times as great Newton's method comes to the same."""
    still = packing(20, 2, seed=1, friction=0.8)
    curve = Curve(still, factorisation(still), np.inf)
    here = curve_begin(curve)
    assert here.level == 0.0
    here = settled(curve, here, 1e-12)
    other = settled(curve, Place(3.0 * here.force, 0.0), 1e-12)
    assert np.abs(curve.at(here)[0]).max() < 1e-10
    assert other.force == pytest.approx(here.force, abs=1e-6 * np.abs(here.force).max())


def test_units_change_nothing() -> None:
    assert units_change_nothing(folded_path, wedged(1))


class Counted:
    """Factorisations that are counted, singular from a number of them on."""

    def __init__(self, problem: FrictionProblem, singular: float = np.inf) -> None:
        self.linear, self.made, self.singular = factorisation(problem), 0, singular
        self.flops = self.linear.flops

    def factor(self, a: Floats, b: Floats) -> Solve:
        self.made += 1
        if self.made > self.singular:
            raise SingularSystem
        return self.linear.factor(a, b)


@pytest.mark.parametrize("most", [0, 1, 10, 50, 200])
def test_it_spends_no_more_than_it_may_and_says_what(most: int) -> None:
    """One factorisation finds where to begin; a try of extrapolated points may take more."""
    problem = wedged(1)
    linear = Counted(problem)
    found = folded_path(problem, 1e-300, linear=linear, factorisations=most)
    assert not found.solved
    assert found.work["factorisations"] == linear.made
    assert linear.made <= max(1, most) + (folded.POINTS_STEPS if most > 50 else 0)


@pytest.mark.parametrize("singular", [0, 1, 15, 40])
def test_where_a_system_is_singular_the_best_point_is_given_back(singular: int) -> None:
    problem = wedged(1)
    linear = Counted(problem, singular)
    found = folded_path(problem, linear=linear)
    assert found.work["factorisations"] == linear.made
    assert np.isfinite(found.r).all()
    assert found.residual == problem.residual(found.r)


@pytest.mark.parametrize("offset", [0.0, 1e-200, 1.0])
def test_where_nothing_approaches_there_are_no_forces(offset: float) -> None:
    """Contacts that rest or part; and ones that approach by less than can be squared."""
    problem = friction_problem(np.eye(6), np.array([offset, 0.0, 0.0] * 2), 0.5, 3)
    assert folded_path(problem).solved
    assert not folded_path(problem).r.any()
    close = friction_problem(np.eye(6), np.array([-1e-200, 0.0, 0.0] * 2), 0.5, 3)
    assert np.isfinite(folded_path(close).r).all()


def test_what_has_no_solution_ends_and_says_so() -> None:
    """One contact that nothing can keep from approaching."""
    problem = friction_problem(np.zeros((3, 3)), [-1.0, 0.0, 0.0], 0.5, 3)
    found = folded_path(problem)
    assert not found.solved
    assert np.isfinite(found.r).all()
