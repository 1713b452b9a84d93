"""Micro-displacements by relaxation and their direct limit: closed forms, signs, steps, refusals.

Reference: Schwager and Poeschel 2002, section 8, eqs 37-40 with 26 and 27.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import fsolve

from rigid_lcp.errors import ProblemError
from rigid_lcp.friction.problem.definition import make_problem
from rigid_lcp.unique.elastic_limit import find_elastic_limit
from rigid_lcp.unique.micro_displacements import (
    bound_stiffest_mode,
    find_free_motion,
    find_stable_step,
    relax_displacements,
    scale_jacobian,
)
from tests.rigid_static_problems import (
    GRAVITY,
    beam,
    bodies_2d,
    difference,
    pyramid,
    table,
    tower,
    weights,
)


@pytest.mark.parametrize("stiffness", [1.0, [1.0, 3.0, 0.5]])
@pytest.mark.parametrize("method", [find_elastic_limit, relax_displacements])
def test_beam_on_three_supports(method, stiffness):
    """f_i = k_i (u + w x_i): two equations of balance for u and w, written out here."""
    k, x = np.broadcast_to(stiffness, 3).astype(float), np.array([-1.0, 0.2, 1.0]) - 0.3
    u, w = np.linalg.solve([[k.sum(), k @ x], [k @ x, k @ x**2]], [10 * GRAVITY, 0.0])
    answer = method(beam(), stiffness)
    assert answer.solved
    assert answer.r[0::2] == pytest.approx(k * (u + w * x), rel=1e-9)
    assert np.all(answer.r[1::2] == 0.0)


def test_a_force_law_of_ones_own():
    """Hertz' law at the three supports, f = k xi^1.5: the two equations solved by SciPy."""

    def hertz(xi, k, friction):
        return np.column_stack([k[:, 0] * np.maximum(xi[:, 0], 0) ** 1.5, 0 * xi[:, 1]])

    x = np.array([-1.0, 0.2, 1.0]) - 0.3

    def balance(uw):
        f = np.maximum(uw[0] + uw[1] * x, 0) ** 1.5
        return f.sum() - 10 * GRAVITY, f @ x

    u, w = fsolve(balance, (10.0, 0.0), xtol=1e-13)
    # its steepest slope is 1.5 xi^0.5 < 9: the step of a spring of 1 N/m, by nine
    jacobian, _ = scale_jacobian(beam().bodies)
    h = find_stable_step(jacobian, np.full((3, 2), 9.0))
    answer = relax_displacements(beam(), law=hertz, step=h)
    assert answer.solved
    assert answer.r[0::2] == pytest.approx((u + w * x) ** 1.5, rel=1e-9)


def test_beam_that_tips_off_a_support():
    """With the weight beyond the middle support, by much, the left one lifts off: two remain."""
    answer = find_elastic_limit(beam(position=0.9))
    lever = np.array([1.0 - 0.9, 0.9 - 0.2]) / 0.8
    assert answer.solved
    assert answer.r[0::2] == pytest.approx([0.0, *(10 * GRAVITY * lever)], abs=1e-9)


@pytest.mark.parametrize("method", [find_elastic_limit, relax_displacements])
@pytest.mark.parametrize("softness", [0.3, 1.0])
def test_wedge_that_sticks(method, softness):
    """A disc between walls at +-a from the vertical: sinking by d it pushes k_N d sin a and
    rubs k_T d cos a, and 2 (f_N sin a + f_T cos a) = m g fixes d."""
    a, mass = np.radians(50), np.array([2.0])
    walls = [(-np.cos(a), np.sin(a)), (np.cos(a), np.sin(a))]
    contacts = [(0, -1, -np.array(n), n) for n in walls]
    problem = bodies_2d(contacts, np.zeros((1, 2)), mass, mass / 2, weights(mass), 5.0)
    answer = method(problem, np.tile([1.0, softness], (2, 1)))
    d = 2 * GRAVITY / (2 * (np.sin(a) ** 2 + softness * np.cos(a) ** 2))
    assert answer.solved
    assert answer.r[0::2] == pytest.approx(d * np.sin(a), rel=1e-10)
    assert np.abs(answer.r[1::2]) == pytest.approx(softness * d * np.cos(a), rel=1e-10)


def test_table_on_four_legs():
    """Flat stiff floor: the leg forces are linear in the leg's place (plane of displacements)."""
    answer = find_elastic_limit(table())
    legs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    expected = 4 * GRAVITY / 4 * (1 + legs @ np.array([0.1, 0.2]))
    assert answer.solved
    assert answer.r.reshape(-1, 3)[:, 0] == pytest.approx(expected, rel=1e-12)
    assert np.abs(answer.r.reshape(-1, 3)[:, 1:]).max() < 1e-10
    assert relax_displacements(table()).r == pytest.approx(answer.r, abs=1e-9)


@pytest.mark.parametrize("method", [find_elastic_limit, relax_displacements])
def test_block_that_slides_down(method):
    """Steeper than friction holds: f_T = mu f_N, and the block accelerates by g(sin - mu cos)."""
    mass, angle = np.array([1.5]), np.radians(40)
    contacts = [(0, -1, (x, -0.2), (0, 1)) for x in (-0.5, 0.5)]
    load = [[1.5 * GRAVITY * np.sin(angle), -1.5 * GRAVITY * np.cos(angle), 0.0]]
    answer = method(
        bodies_2d(contacts, np.zeros((1, 2)), mass, mass / 6, load, 0.3), tolerance=1e-11
    )
    assert answer.solved
    normal, tangential = answer.r[0::2], answer.r[1::2]
    assert normal.sum() == pytest.approx(1.5 * GRAVITY * np.cos(angle), rel=1e-9)
    assert np.abs(tangential) == pytest.approx(0.3 * normal, rel=1e-9)


@pytest.mark.long
def test_relaxation_has_the_same_limit():
    """Explicit eq. 40 to the end and the direct limit: 1e-12 of residual is 1e-9 in the forces,
    as the softest mode of this pile is 1e3 times softer than the stiffest."""
    problem = pyramid(3, 0.9)
    direct, relaxed = find_elastic_limit(problem), relax_displacements(problem)
    assert direct.solved
    assert relaxed.solved
    assert difference(relaxed.r, direct.r) < 1e-9
    assert direct.iterations < relaxed.iterations / 10


def test_printed_sign_is_compression_positive():
    """A box dropped on its support has a < 0, its xi must grow and push: dq points down."""
    answer = relax_displacements(tower(1))
    assert (answer.r[0::2] > 0).all()
    assert answer.displacement[1] < 0


def test_step_bound():
    problem = pyramid(3, 0.9)
    jacobian, _ = scale_jacobian(problem.bodies)
    k = np.random.default_rng(0).uniform(0.1, 10, (problem.contacts, 2))
    scaled = np.sqrt(k.ravel())[:, None] * jacobian.toarray()
    stiffest = np.linalg.norm(scaled, 2) ** 2
    assert stiffest <= bound_stiffest_mode(jacobian, k) <= 4 * stiffest
    assert find_stable_step(jacobian, k) == 1 / bound_stiffest_mode(jacobian, k)
    sticks = tower(2, friction=1e6)
    j2, _ = scale_jacobian(sticks.bodies)
    true = np.linalg.norm(j2.toarray(), 2) ** 2
    pull = sticks.bodies.jacobian @ np.random.default_rng(0).normal(size=6)  # on all modes
    sticks = make_problem(sticks.bodies, sticks.offset + pull, 1e6, 2)
    # beyond 2 / l_max the printed relaxation does not settle
    for share, settles in ((1.5, True), (2.1, False)):
        relaxed = relax_displacements(
            sticks, step=share / true, tolerance=1e-10, iterations_max=3000
        )
        assert relaxed.solved is settles


def test_offset_outside_the_image_is_projected_once():
    """Two coincident contacts asked for different accelerations: the mean is what bodies can do."""
    problem = tower(1)
    jacobian, _ = scale_jacobian(problem.bodies)
    offset = np.random.default_rng(1).normal(size=len(problem.offset))
    left = offset - jacobian @ find_free_motion(jacobian, offset)
    assert np.abs(jacobian.T @ left).max() < 1e-13
    assert np.linalg.norm(left) > 0.1
    # no motion opens this: said by the status, at the best residual
    bad = make_problem(problem.bodies, problem.offset + np.array([0, 1.0, 0, -1.0]), 1e6, 2)
    for method in (find_elastic_limit, relax_displacements):
        answer = method(bad, iterations_max=300)
        assert not answer.solved
        assert "->" in answer.message
        assert np.isfinite(answer.r).all()


def test_no_contacts_and_free_flight():
    empty = bodies_2d([], np.zeros((1, 2)), np.ones(1), np.ones(1), [[0, 0, 0]], 0.3)
    for method in (find_elastic_limit, relax_displacements):
        assert method(empty).solved
        answer = method(bodies_2d([(0, -1, (0, -1), (0, 1))], np.zeros((1, 2)), np.ones(1),
                                  np.ones(1), [[0, 5.0, 0]], 0.3))  # fmt: skip
        assert answer.solved
        assert np.all(answer.r == 0)


def test_malformed_input_is_refused():
    problem = tower(2)
    matrix = make_problem(problem.delassus, problem.offset, 0.5, 2)
    for method in (find_elastic_limit, relax_displacements):
        with pytest.raises(ProblemError, match="no bodies"):
            method(matrix)
        for bad in (-1.0, [1.0, np.nan, 1.0, 1.0]):
            with pytest.raises(ProblemError, match="above zero"):
                method(problem, bad)
        with pytest.raises(ProblemError, match="shape"):
            method(problem, [1.0, 2.0])
        with pytest.raises(ProblemError, match="differ"):
            method(table(), np.tile([1.0, 1.0, 2.0], (4, 1)))
    for bad in ([1.0], np.full(6, np.nan)):
        with pytest.raises(ProblemError, match="begin"):
            find_elastic_limit(problem, begin=bad)
