"""The guess that all contacts stick: W r + q = 0, right for what stands and for nothing else."""

from __future__ import annotations

import numpy as np
import pytest

from rigid_lcp import solve_friction
from rigid_lcp.friction.attempts.sticking import (
    STICKING,
    find_heaviness,
    seem_to_stick,
    solve_sticking,
)
from rigid_lcp.friction.linear.factorisation import choose_factorisation
from rigid_lcp.friction.methods.gauss_seidel import solve_gauss_seidel
from rigid_lcp.friction.problem.definition import FrictionProblem, make_problem
from tests.rigid_networks import GRAVITY, STEP, stack_on_slope, tower


@pytest.mark.parametrize("top", [1.0, 1e4])
@pytest.mark.parametrize("boxes", [1, 10, 60])
def test_a_tower_bears_its_weight_by_one_factorisation(boxes, top):
    """Face k carries all above it: N1 + N2 = m_above g h.  Three freedoms and four forces a face,
    so W is singular; the step's shift is gone after a few rounds.  Velocities are right to
    round-off of the greatest force; forces to that times W's condition, boxes^2 for a chain of so
    many times the ratio of masses."""
    problem = tower(boxes, 0.5, top)
    found = solve_sticking(problem, 1e-15)
    assert found.work == {"factorisations": 1.0}
    weights = (top + np.arange(boxes)) * GRAVITY * STEP  # from the top down
    normal = found.r.reshape(-1, 2)[:, 0].reshape(boxes, 2).sum(axis=1)
    assert normal == pytest.approx(weights[::-1], rel=1e-14 * max(10, boxes) ** 2 * top)
    assert found.residual < 1e-15


def test_a_tower_is_solved_by_the_default_in_one_factorisation():
    solution = solve_friction(tower(40, 0.5).matrix, tower(40, 0.5).offset, 0.5, dim=2)
    assert solution.solved
    assert solution.method == "sticking"
    assert solution.work["factorisations"] == 1


def test_what_slides_opens_or_bears_nothing_is_not_taken_for_sticking():
    slides = make_problem(np.eye(2), np.array([-1.0, 0.8]), 0.3, 2)
    force = solve_gauss_seidel(slides, None, 1e-12, 50).r
    assert not seem_to_stick(slides, force)
    opens = make_problem(np.eye(4), np.array([-1.0, 0.1, 1.0, 0.0]), 0.3, 2)
    assert not seem_to_stick(opens, solve_gauss_seidel(opens, None, 1e-12, 50).r)
    assert not seem_to_stick(opens, np.zeros(4))


def test_where_one_contact_slides_the_guess_says_so_and_the_default_goes_on():
    """Two blocks that do not touch, on floors of friction .5: one pushed at .3 of its weight, one
    at .8.  Sticking forces of the second leave its cone; its true speed is .8 - .5 = .3."""
    problem = make_problem(np.eye(6), np.array([-1, 0.3, -1, 0.3, -1, 0.8]), 0.5, 2)
    linear = choose_factorisation(problem)
    guess = solve_sticking(problem, 1e-12, linear=linear)
    assert not guess.solved
    assert guess.residual > 1e-2
    solution = solve_friction(np.eye(6), problem.offset, 0.5, dim=2)
    assert solution.solved
    assert solution.u[5] == pytest.approx(0.3, abs=1e-12)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_stack_of_any_masses_sticks_on_a_slope_that_it_can_not_leave(dim):
    """Three unit boxes topple at tan = 1/3 and slide at .5: at .1 the floor bears their weight.

    Plain shifted steps never find what bears the light box on top (1e-12 of the heaviest).
    The floor's force is a sum of four, of a system of 36 unknowns: 1e-12 is round-off of both."""
    masses, slope = np.array([1e-6, 1e6, 1e-6]), np.arctan(0.1)
    problem = stack_on_slope(masses, slope, dim=dim)
    found = solve_sticking(problem, 1e-15)
    assert found.work == {"factorisations": 1.0}
    floor = found.r.reshape(-1, dim)[: 2 * dim - 2].sum(axis=0)
    weight = masses.sum() * GRAVITY * STEP
    assert floor[0] == pytest.approx(weight * np.cos(slope), rel=1e-12)
    assert abs(floor[1]) == pytest.approx(weight * np.sin(slope), rel=1e-8)
    assert found.residual < 1e-15


def test_heaviness_asks_more_only_where_light_bodies_bear_heavy_ones():
    equal = tower(10, 0.5)
    assert find_heaviness(equal, solve_sticking(equal, 1e-12).r) == 1.0
    heavy = tower(10, 0.5, 1e6)
    stuck = solve_sticking(heavy, 1e-12).r
    needed = find_heaviness(heavy, stuck)
    assert needed > 1e3
    # kilograms to tonnes: W and r change by 1000, q does not
    other = FrictionProblem(heavy.delassus * 1e3, heavy.offset, heavy.friction, 2)
    assert find_heaviness(other, stuck / 1e3) == pytest.approx(needed, rel=1e-12)
    # as great, but as much along the contacts as across: the answer of a W that is nearly singular
    turned = stuck.reshape(-1, 2).copy()
    turned[:, 1] = turned[:, 0]
    assert np.linalg.norm(turned) > STICKING.heavy * heavy.rho * np.linalg.norm(heavy.offset)
    assert find_heaviness(heavy, turned.ravel()) == 1.0


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("top", [1e4, 1e6])
def test_toppling_stacks_under_a_great_weight_take_few_factorisations(dim, top):
    """A slope of .2 turns over 20 boxes.  Measured: 10 to 24, 41 to 72 without the finer path."""
    masses = np.ones(20)
    masses[-1] = top
    problem = stack_on_slope(masses, 0.2, 0.5, dim)
    solution = solve_friction(problem.bodies, problem.offset, problem.friction, dim)
    assert solution.solved
    assert solution.work["factorisations"] <= 36
