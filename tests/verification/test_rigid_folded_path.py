"""The path by arc length: its points lie on the curve, it goes round folds, and it solves."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from rigid_lcp import folded_path as folded
from rigid_lcp.body_factorisation import factorisation
from rigid_lcp.folded_path import Border, Curve, Place, Step, curve_begin, folded_path, settled
from rigid_lcp.friction_problem import FrictionProblem, friction_problem
from rigid_lcp.smoothed_path import smoothed_path
from tests.verification.test_rigid_smoothed_path import plain_map, units_change_nothing
from validation.rigid_packings import packing

SEEDS = range(4)


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
def steps() -> list[tuple[Curve, Place, Place]]:
    """Of each bed up to sixty steps: the curve, the point and its tangent."""
    taken = []
    for seed in SEEDS:
        problem = wedged(seed)
        step = Step(*curve_begin(problem, factorisation(problem)))
        for _ in range(60):
            if not step.take():
                break
            size = step.curve.length(step.tangent)
            assert size == pytest.approx(1.0, abs=folded.RESIZED)
            taken.append((step.curve, step.here, step.tangent))
    return taken


def test_points_lie_on_the_curve(steps: list[tuple[Curve, Place, Place]]) -> None:
    """``F = 0`` by the plain twin, the term |u_T| counting by ``1 - sigma / sigma_1``, to within
    the error at which a point counts as found, `CLOSE` of ``sqrt(sigma)``."""
    assert len(steps) > 60
    for curve, here, _ in steps:
        problem, shape = curve.problem, (-1, 2)
        share = 1.0 - np.exp(here.level)
        sigma = curve.sigma * np.exp(here.level)
        eps = folded.ROUNDING * np.sqrt(sigma) / curve.rho.mean()
        velocity = problem.velocity(here.force).reshape(shape)
        found = plain_map(
            here.force.reshape(shape), velocity, problem.friction, curve.rho, sigma, eps, share
        )
        assert np.abs(found).max() < folded.CLOSE * np.sqrt(sigma)


def test_tangents_lead_along_the_curve(steps: list[tuple[Curve, Place, Place]]) -> None:
    """``F_r t_r + F_level t_level = 0``, to within 1e-3 of ``sqrt(sigma)`` and of what F changes by
    along the level alone (differences, and the shift in the matrix).  A step keeps the tangent of
    its last factorisation, not quite at the point: off by less than a step may turn."""
    for curve, here, tangent in steps:
        exact = Border(curve, here, *curve.at(here)[1:]).tangent(tangent)
        ends = [curve.at(here.plus(exact, sign * 1e-6))[0] for sign in (1, -1)]
        along = np.linalg.norm(ends[0] - ends[1]) / 2e-6
        assert along < 1e-3 * (1.0 + np.linalg.norm(curve.by_level(here)))
        cosine = curve.product(exact, tangent) / curve.length(tangent)
        assert cosine > folded.TURN


def test_it_goes_round_folds(steps: list[tuple[Curve, Place, Place]]) -> None:
    """On some bed sigma rises again, and falls again behind that; it never comes back to where the
    curve began."""
    rising = [tangent.level > 0.0 for _, _, tangent in steps]
    assert any(one and not other for one, other in pairwise(rising))
    assert all(here.level < 0.0 for _, here, _ in steps)


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
    curve, here = curve_begin(still, factorisation(still))
    assert here.level == 0.0
    here = settled(curve, here, 1e-12)
    other = settled(curve, Place(3.0 * here.force, 0.0), 1e-12)
    assert np.abs(curve.at(here)[0]).max() < 1e-10
    assert other.force == pytest.approx(here.force, abs=1e-6 * np.abs(here.force).max())


def test_units_change_nothing() -> None:
    assert units_change_nothing(folded_path, wedged(1))


def test_it_spends_no_more_than_it_may() -> None:
    """A point takes `FACTORED` at most, and a try of extrapolated points one point more."""
    problem = wedged(1)
    for most in (30, 100):
        found = folded_path(problem, 1e-300, factorisations=most)
        assert not found.solved
        assert found.work["factorisations"] <= most + folded.POINTS_STEPS
        assert found.work["points"] < most


def test_what_has_no_solution_ends_and_says_so() -> None:
    """One contact that nothing can keep from approaching."""
    problem = friction_problem(np.zeros((3, 3)), [-1.0, 0.0, 0.0], 0.5, 3)
    found = folded_path(problem)
    assert not found.solved
    assert np.isfinite(found.r).all()
