"""An earlier state of section 8 may change the cost and never the forces.

Reference: Schwager and Poeschel 2002, section 8, eqs 37-40.  With friction springs and sliders have
more than one equilibrium, so where the relaxation begins decides where it ends; the unique forces
are those reached from no displacements.  Round-off of the 2-norm of all forces is 1e-15 times the
condition of the springs' stiffness (1e3 and below here): 1e-10 leaves two digits and more.
"""

from __future__ import annotations

from math import sqrt

import numpy as np
import pytest

from rigid_lcp.friction.problem.definition import FrictionProblem, friction_problem
from rigid_lcp.motion.equations import body_space, find_contact_offset
from rigid_lcp.motion.state import replace_rates
from rigid_lcp.motion.world import Scene, make_world
from rigid_lcp.shapes.disc import Disc
from rigid_lcp.shapes.half_space import HalfSpace
from rigid_lcp.unique.elastic_limit import elastic_limit, relax_from
from rigid_lcp.unique.micro_displacements import micro_displacements
from tests.rigid_elastic import find_least_forces
from tests.rigid_static_problems import beam, difference, pyramid, table, tower
from validation.bench.rigid.static_grains import pyramid as pile
from validation.bench.rigid.static_grains import renumbered


def box_of_discs(rows: int, friction: float, seed: int) -> FrictionProblem:
    """Discs of densities that differ by up to 100, hexagonal between walls and on a floor."""
    rng = np.random.default_rng(seed)
    scene = Scene(dim=2)
    for j in range(rows):
        for i in range(rows - j % 2):
            place = 0.2 * i + 0.1 * (j % 2), 0.1 + 0.1 * sqrt(3) * j
            scene.add(Disc(0.1), density=10 ** rng.uniform(2, 4), position=place, friction=friction)
    for normal, offset in (((0, 1), 0.0), ((1, 0), -0.1), ((-1, 0), 0.1 - 0.2 * rows)):
        scene.add(HalfSpace(normal, offset), friction=friction)
    world, motion = make_world(scene)
    contacts = world.contacts(motion, 1e-7 * world.length)
    space = body_space(contacts, motion.position, world.columns, world.inverse_mass(motion))
    free = replace_rates(motion, world.accelerations(motion, None))
    return friction_problem(
        space, find_contact_offset(contacts, motion, free), contacts.friction, 2
    )


@pytest.mark.parametrize(("friction", "seed"), [(1.0, 0), (1.0, 1), (5.0, 0), (5.0, 3)])
@pytest.mark.parametrize("size", [0.01, 0.1, 3.0])
def test_a_start_leaves_the_forces_of_a_box_where_contacts_slide(friction, seed, size):
    problem = box_of_discs(4, friction, seed)
    first = elastic_limit(problem)
    noise = np.random.default_rng(17).normal(size=len(first.displacement))
    again = elastic_limit(problem, start=size * np.abs(first.displacement).max() * noise)
    assert first.solved
    assert again.solved
    assert difference(again.r, first.r) < 1e-10


@pytest.mark.long
def test_a_box_has_more_states_than_one():
    """Why: of 12 states reached from elsewhere, all exact, some are not that reached from none."""
    others = []
    for seed in range(4):
        problem = box_of_discs(4, 5.0, seed)
        first = elastic_limit(problem)
        rng = np.random.default_rng(seed)
        for size in (0.03, 0.1, 1.0):
            noise = rng.normal(size=len(first.displacement))
            far = relax_from(problem, size * np.abs(first.displacement).max() * noise)
            if far.solved:
                assert problem.residual(far.r) < 1e-12
                others.append(difference(far.r, first.r))
    assert max(others) > 1e-3


@pytest.mark.parametrize("friction", [0.0, 0.3, 0.9, 5.0])
@pytest.mark.long
def test_a_start_leaves_the_relaxed_forces(friction):
    """The printed relaxation ends at a residual: 1e-12 of it is 1e-9 in the forces (as the softest
    mode is 1e3 times softer), from any start."""
    problem = pyramid(3, friction)
    first = micro_displacements(problem)
    for size in (0.1, 3.0):
        noise = np.random.default_rng(5).normal(size=18) * np.abs(first.displacement).max()
        again = micro_displacements(problem, start=size * noise)
        assert again.solved
        assert difference(again.r, first.r) < 1e-9


@pytest.mark.parametrize("make", [beam, table, tower])
def test_contacts_that_hold_need_one_step_from_any_start(make):
    """All stick: least norm of all forces in balance, from one factorisation."""
    problem = make()
    answer = elastic_limit(problem)
    start = 1e9 * np.random.default_rng(1).normal(size=len(answer.displacement))
    again = elastic_limit(problem, start=start)
    assert answer.solved
    assert difference(again.r, answer.r) < 1e-12
    if problem.friction.any():
        assert difference(answer.r, find_least_forces(problem)) < 1e-11
        assert answer.iterations == again.iterations == 1


def test_contacts_that_slide_on_the_way_and_hold_in_the_end():
    """A tower begun from displacements that slide every contact: the relaxation ends where all
    hold, as one begun from none."""
    problem = tower(4)
    first = micro_displacements(problem)
    start = first.displacement + 5.0 * np.random.default_rng(2).normal(size=12)
    again = micro_displacements(problem, start=start)
    assert again.solved
    assert difference(again.r, first.r) < 1e-9


def test_a_start_without_friction_saves_steps():
    problem, other = box_of_discs(4, 0.0, 0), box_of_discs(4, 0.0, 1)
    near = elastic_limit(problem)
    for start in (near, elastic_limit(other)):
        again = elastic_limit(problem, start=start)
        assert again.solved
        assert difference(again.r, near.r) < 1e-10
    assert elastic_limit(problem, start=near).iterations < near.iterations


def test_a_start_out_of_all_proportion_is_left_aside():
    """1e-16 of displacements 1e12 times the final ones would be an error of 1e-4."""
    problem = pyramid(4, 0.0)
    first = elastic_limit(problem)
    noise = np.random.default_rng(3).normal(size=30) * np.abs(first.displacement).max()
    for method in (elastic_limit, micro_displacements):
        again = method(problem, start=1e12 * noise)
        assert again.solved
        assert difference(again.r, first.r) < 1e-8
    assert difference(elastic_limit(problem, start=1e12 * noise).r, first.r) < 1e-12


@pytest.mark.parametrize(
    ("rows", "friction", "walls", "orders"), [(10, 0.3, True, 4), (30, 5.0, False, 1)]
)
@pytest.mark.long
def test_round_off_does_not_choose_between_states(rows, friction, walls, orders):
    """55 discs at friction 0.3, 465 at 5: random orders ended in another of two states, 6.5 and
    6.9 % apart, before the way there was made with rounded numbers in an order of their own."""
    grains = pile(rows, walls=walls, seed=1 if walls else rows)
    first = elastic_limit(grains.problem(friction))
    assert first.solved
    rng = np.random.default_rng(1)
    for _ in range(orders):
        contact = rng.permutation(len(grains.body_a))
        body = rng.permutation(len(grains.mass))
        again = elastic_limit(renumbered(grains, contact, body).problem(friction))
        assert again.solved
        back = again.r.reshape(-1, 2)[np.argsort(contact)]
        assert difference(back.ravel(), first.r) < 1e-10


def test_steps_that_run_out_leave_the_forces_of_the_last():
    """Also where they run out between the rounded load, 1e-9 off, and the load itself."""
    problem = box_of_discs(4, 0.3, 0)
    whole = elastic_limit(problem)
    assert whole.solved
    errors = [
        difference(elastic_limit(problem, iterations_max=most).r, whole.r)
        for most in range(whole.iterations - 7, whole.iterations + 1)
    ]
    assert max(errors) < 1e-7
