"""The direct limit of section 8: least energy, unique where it must be, and where it is not.

Reference: Schwager and Poeschel 2002, section 8, eqs 37-40 with 26 and 27.
"""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from rigid_lcp import BodySpace, HalfSpace, Scene, Simulation, make_box
from rigid_lcp.friction.problem.definition import make_problem
from rigid_lcp.unique.elastic_limit import find_elastic_limit, reorder_problem
from tests.rigid_elastic import find_least_forces
from tests.rigid_static_problems import GRAVITY, beam, bodies_2d, difference, pyramid, table, tower
from validation.bench.rigid.packings import build_packing
from validation.bench.rigid.static_grains import build_pyramid as pile
from validation.bench.rigid.static_grains import renumber


@pytest.mark.parametrize("top", [1.0, 1e4])
def test_sticking_tower_has_the_minimum_norm(top):
    problem = tower(10, top)
    answer = find_elastic_limit(problem)
    assert answer.solved
    assert difference(answer.r, find_least_forces(problem)) < 1e-11
    # a heavier top: every box carries all above it, half at each corner
    above = top + 9 - np.arange(10)
    assert answer.r[0::2] == pytest.approx(np.repeat(above, 2) * GRAVITY / 2, rel=1e-11)


@pytest.mark.parametrize("across", [0.0, 2.0])
def test_frictionless_limit_obeys_the_conditions_of_least_energy(across):
    """f = k (-J dq)_+ and equilibrium are the conditions of min sum f^2/k, f >= 0, J^T f + Q = M a
    with contacts that part left out; across the pile accelerates, and they hold all the same."""
    problem = pyramid(6, 0.0, across=across)
    k = np.random.default_rng(3).uniform(0.5, 2.0, problem.contacts)
    answer = find_elastic_limit(problem, k)
    assert answer.solved
    normal = answer.r[0::2]
    deformation = -(problem.bodies.jacobian @ answer.displacement)[0::2]
    # displacements are in units in which k are as given; motion enters by round-off of a long step
    assert difference(normal, np.maximum(k * deformation, 0.0)) < 1e-8
    assert problem.residual(answer.r) < 1e-12
    # no other solution has less: go from it to any other and energy grows
    active = np.flatnonzero(normal > 1e-9 * normal.max())
    rows = problem.bodies.jacobian[2 * active].toarray()
    free = np.linalg.svd(rows.T)[2][np.linalg.matrix_rank(rows) :]
    assert np.abs(free @ (normal / k)[active]).max(initial=0.0) < 1e-9 * normal.max()


@pytest.mark.parametrize("friction", [0.0, 0.05, 0.2, 0.5, 0.9])
@pytest.mark.parametrize("across", [0.0, 2.0])
def test_forces_do_not_depend_on_order_or_numbering(friction, across):
    problem = pyramid(4, friction, across=across)
    answer = find_elastic_limit(problem)
    rng = np.random.default_rng(7)
    order = rng.permutation(problem.contacts)
    other = pyramid(4, friction, order, rng.permutation(10), across=across)
    again = find_elastic_limit(other)
    assert answer.solved
    assert again.solved
    sorted_back = np.empty((problem.contacts, 2))
    sorted_back[order] = again.r.reshape(-1, 2)
    assert difference(sorted_back.ravel(), answer.r) < 1e-10


def test_contacts_that_only_move_along_their_normals_have_an_order():
    """Three discs one on another: the same problem, to the bit, whichever contact comes first."""
    high, mass = np.arange(3.0), np.array([1.0, 2.0, 4.0])
    stack = [(k, k - 1, (0, high[k]), (0, 1)) for k in range(3)]
    centre, load = np.outer(high + 0.5, [0, 1]), np.outer(mass, [0, -GRAVITY, 0])
    one, other = (
        reorder_problem(bodies_2d(some, centre, mass, mass / 8, load, 0.5))[0]
        for some in (stack, stack[::-1])
    )
    np.testing.assert_array_equal(one.offset, other.offset)
    np.testing.assert_array_equal(one.bodies.jacobian.toarray(), other.bodies.jacobian.toarray())


@settings(max_examples=15)
@given(masses=st.integers(0, 10**6), spread=st.floats(0, 1))
def test_any_stiffness_frictionless_or_sticking(masses, spread):
    """Unique by order and equal to the least norm wherever nothing opens or slides."""
    problem = pyramid(3, 5.0, masses=masses)
    rng = np.random.default_rng(masses)
    k = np.repeat(10 ** rng.uniform(-spread / 2, spread / 2, (problem.contacts, 1)), 2, axis=1)
    answer = find_elastic_limit(problem, k)
    assert answer.solved
    least = find_least_forces(problem, k)
    if (np.abs(least[1::2]) < 5.0 * least[0::2]).all():
        assert difference(answer.r, least) < 1e-9


def test_units_do_not_matter():
    """Millimetres and grams: forces in g mm / s^2 are 1e6 times those in N."""
    problem = pyramid(3, 0.4, across=1.0)
    space = problem.bodies
    freedom = np.tile([1e3, 1e3, 1.0], 6)
    jacobian = sp.csr_array(1e3 * space.jacobian @ sp.diags_array(1 / freedom))
    # energy, so mass by both freedoms, is 1e9 times as many g mm^2 / s^2
    inverse = sp.csr_array(sp.diags_array(1e-9 * freedom**2) @ space.inverse_mass)
    small = make_problem(BodySpace(jacobian, inverse, 3), 1e3 * problem.offset, 0.4, 2)
    a, b = find_elastic_limit(problem), find_elastic_limit(small)
    assert difference(b.r, a.r * 1e6) < 1e-10


def test_friction_can_be_mobilised_in_more_ways_than_one():
    """The price of friction: begun far away springs and sliders settle in other forces.

    Both are solutions, to the last digit.  Without friction, and where all hold, there is one.
    """
    for problem, unique in ((pyramid(4, 0.9), False), (pyramid(4, 0.0), True)):
        near = find_elastic_limit(problem)
        start = np.random.default_rng(0).normal(size=30) * np.abs(near.r).max()
        far = find_elastic_limit(problem, begin=start)
        assert near.solved
        assert far.solved
        assert max(near.residual, far.residual) < 1e-12
        assert difference(far.r, near.r) < 1e-10 if unique else difference(far.r, near.r) > 0.1


@pytest.mark.parametrize("seed", [95, 98])
@pytest.mark.long
def test_grains_that_go_on_sliding_in_space(seed):
    """Friction along the velocity: springs alone turn into it as 1 over the way, and ended with a
    residual of 3e-9.  The same forces with the contacts the other way round, on these beds: of 16
    (seeds 90 to 105) 11 are found both ways round, and 2 of those have two answers."""
    problem = build_packing(60, 3, seed=seed, friction=1.0)
    answer = find_elastic_limit(problem)
    assert answer.solved
    assert problem.residual(answer.r) < 1e-12
    velocity = problem.velocity(answer.r).reshape(-1, 3)
    force = answer.r.reshape(-1, 3)
    speed = np.linalg.norm(velocity[:, 1:], axis=1)
    slides = (speed > 1e-6 * speed.max()) & (force[:, 0] > 0)
    assert slides.any()
    along = -velocity[slides, 1:] / speed[slides, None]
    grip = force[slides, 1:] / (problem.friction[slides] * force[slides, 0])[:, None]
    np.testing.assert_allclose(grip, along, atol=1e-8)
    bodies = problem.bodies
    backwards = np.arange(len(answer.r)).reshape(-1, 3)[::-1].ravel()
    other = make_problem(
        BodySpace(bodies.jacobian[backwards], bodies.inverse_mass, bodies.body_size),
        problem.offset[backwards], problem.friction[::-1].copy(), 3,
    )  # fmt: skip
    assert difference(find_elastic_limit(other).r, answer.r[backwards]) < 1e-10


@pytest.mark.parametrize(
    ("rows", "friction", "walls", "orders"), [(10, 0.3, True, 4), (30, 5.0, False, 1)]
)
@pytest.mark.long
def test_round_off_does_not_choose_between_states(rows, friction, walls, orders):
    """55 discs at friction 0.3, 465 at 5: random orders ended in another of two states, 6.5 and
    6.9 % apart, before the way there was made with rounded numbers in an order of their own."""
    grains = pile(rows, walls=walls, seed=1 if walls else rows)
    first = find_elastic_limit(grains.problem(friction))
    assert first.solved
    rng = np.random.default_rng(1)
    for _ in range(orders):
        contact = rng.permutation(len(grains.body_a))
        body = rng.permutation(len(grains.mass))
        again = find_elastic_limit(renumber(grains, contact, body).problem(friction))
        assert again.solved
        back = again.r.reshape(-1, 2)[np.argsort(contact)]
        assert difference(back.ravel(), first.r) < 1e-10


def test_steps_that_run_out_leave_the_forces_of_the_last():
    """Also where they run out between the rounded load, 1e-9 off, and the load itself."""
    problem = pile(4, walls=True, seed=0).problem(0.3)
    whole = find_elastic_limit(problem)
    assert whole.solved
    errors = [
        difference(find_elastic_limit(problem, iterations_max=most).r, whole.r)
        for most in range(whole.iterations - 5, whole.iterations + 1)
    ]
    assert max(errors) < 1e-7


@pytest.mark.parametrize("make", [beam, table, tower])
def test_contacts_that_hold_need_one_step(make):
    """All stick: least norm of all forces in balance, from one factorisation."""
    problem = make()
    answer = find_elastic_limit(problem)
    assert answer.solved
    if problem.friction.any():
        assert difference(answer.r, find_least_forces(problem)) < 1e-11
        assert answer.iterations == 1


def test_forces_of_a_run_are_those_of_equal_springs():
    """A box of 1 kg on its four corners: a quarter of its weight on each."""
    scene = Scene(3)
    scene.add(make_box(1, 1, 1), density=1.0, position=(0, 0, 0.5), friction=0.5)
    scene.add(HalfSpace((0, 0, 1)))
    assert Simulation(scene).unique_forces().normal_force == pytest.approx([GRAVITY / 4] * 4)
