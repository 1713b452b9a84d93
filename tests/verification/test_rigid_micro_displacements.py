"""Static indeterminacy: closed forms, uniqueness, minimum norm, the direct limit, stiff springs.

Reference: Schwager and Poeschel 2002, section 8, eqs 37-40 with 26 and 27.
"""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import fsolve

from rigid_lcp.elastic_limit import elastic_limit, minimum_norm_forces
from rigid_lcp.elastic_network import slider_energy, slider_forces, slider_slope
from rigid_lcp.errors import ProblemError
from rigid_lcp.friction_problem import BodySpace, FrictionProblem, friction_problem
from rigid_lcp.micro_displacements import (
    coulomb_slider,
    coulomb_spring,
    free_motion,
    mass_free_jacobian,
    micro_displacements,
    stable_step,
    stiffest_mode,
)

GRAVITY = 9.81


def bodies_2d(contacts, centre, mass, inertia, load, friction) -> FrictionProblem:
    """Problem of contacts (a, b, point, normal) in 2D; load (n, 3) forces and torque."""
    jacobian = np.zeros((2 * len(contacts), 3 * len(mass)))
    for c, (a, b, point, normal) in enumerate(contacts):
        n = np.asarray(normal, float) / np.linalg.norm(normal)
        for body, sign in ((a, 1.0), (b, -1.0)):
            if body < 0:
                continue
            arm = np.asarray(point, float) - centre[body]
            for row, d in ((2 * c, n), (2 * c + 1, np.array([-n[1], n[0]]))):
                spin = arm[0] * d[1] - arm[1] * d[0]
                jacobian[row, 3 * body : 3 * body + 3] += sign * np.array([d[0], d[1], spin])
    inverse = np.column_stack([1 / mass, 1 / mass, 1 / inertia]).ravel()
    space = BodySpace(sp.csr_array(jacobian), sp.csr_array(sp.diags_array(inverse)), 3)
    return friction_problem(space, jacobian @ (inverse * np.ravel(load)), friction, 2)


def weights(mass, across=0.0):
    return np.column_stack([across * mass, -GRAVITY * mass, 0 * mass])


def beam(position=0.3, friction=0.0) -> FrictionProblem:
    """A beam of 10 kg on supports at x = -1, 0.2, 1 m with its centre of mass at ``position``."""
    mass = np.array([10.0])
    contacts = [(0, -1, (x, 0.0), (0, 1)) for x in (-1.0, 0.2, 1.0)]
    return bodies_2d(contacts, np.array([[position, 0.1]]), mass, 3 * mass, weights(mass), friction)


def tower(n=10, top=1.0, friction=0.5) -> FrictionProblem:
    mass = np.append(np.ones(n - 1), top)
    contacts = [(i, i - 1, (x, i), (0, 1)) for i in range(n) for x in (-0.5, 0.5)]
    centre = np.column_stack([np.zeros(n), np.arange(n) + 0.5])
    return bodies_2d(contacts, centre, mass, mass / 6, weights(mass), friction)


def pyramid(rows, friction, contact_order=None, body_order=None, across=0.0, masses=1):
    """Rows of touching discs of diameter 1 m on a floor, unequal masses."""
    place = {}
    for r in range(rows):
        for i in range(rows - r):
            place[r, i] = len(place)
    centre = np.array([[i + 0.5 * r, 0.5 + r * np.sqrt(3) / 2] for r, i in place])
    mass = np.random.default_rng(masses).uniform(0.5, 2.0, len(place))
    order = np.arange(len(place)) if body_order is None else body_order
    number = np.argsort(order)
    contacts = []
    for (r, i), b in place.items():
        if r == 0:
            contacts.append((number[b], -1, centre[b] - [0, 0.5], (0, 1)))
        for step in ((0, 1), (1, 0), (1, -1)):
            a = place.get((r + step[0], i + step[1]))
            if a is not None:
                middle, between = (centre[a] + centre[b]) / 2, centre[a] - centre[b]
                contacts.append((number[a], number[b], middle, between))
    if contact_order is not None:
        contacts = [contacts[c] for c in contact_order]
    m = mass[order]
    return bodies_2d(contacts, centre[order], m, m / 8, weights(m, across), friction)


def table(load_at=(0.1, 0.2)) -> FrictionProblem:
    """A table of 4 kg in 3D on four legs at (+-1, +-1) m, centre of mass at ``load_at``."""
    rows = []
    for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
        arm = np.array([x - load_at[0], y - load_at[1], -0.7])
        rows += [np.concatenate([d, np.cross(arm, d)]) for d in np.eye(3)[[2, 0, 1]]]
    inverse = np.diag([0.25] * 3 + [0.5, 0.7, 0.3])
    inverse[3, 4] = inverse[4, 3] = 0.1
    space = BodySpace(sp.csr_array(np.array(rows)), sp.csr_array(inverse), 6)
    fall = np.array([0, 0, -GRAVITY, 0, 0, 0])
    return friction_problem(space, np.array(rows) @ fall, 0.6, 3)


def difference(a, b) -> float:
    return float(np.linalg.norm(a - b) / np.linalg.norm(b))


# ---- closed forms -------------------------------------------------------------------------------


@pytest.mark.parametrize("stiffness", [1.0, [1.0, 3.0, 0.5]])
@pytest.mark.parametrize("method", [elastic_limit, micro_displacements])
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

    def hertz(xi, slip, k, friction):
        return np.column_stack([k[:, 0] * np.maximum(xi[:, 0], 0) ** 1.5, 0 * xi[:, 1]]), slip

    x = np.array([-1.0, 0.2, 1.0]) - 0.3

    def balance(uw):
        f = np.maximum(uw[0] + uw[1] * x, 0) ** 1.5
        return f.sum() - 10 * GRAVITY, f @ x

    u, w = fsolve(balance, (10.0, 0.0), xtol=1e-13)
    # its steepest slope is 1.5 xi^0.5 < 9: the step of a spring of 1 N/m, by nine
    jacobian, _ = mass_free_jacobian(beam().bodies)
    h = stable_step(jacobian, np.full((3, 2), 9.0))
    answer = micro_displacements(beam(), law=hertz, step=h)
    assert answer.solved
    assert answer.r[0::2] == pytest.approx((u + w * x) ** 1.5, rel=1e-9)


def test_beam_that_tips_off_a_support():
    """With the weight beyond the middle support, by much, the left one lifts off: two remain."""
    answer = elastic_limit(beam(position=0.9))
    lever = np.array([1.0 - 0.9, 0.9 - 0.2]) / 0.8
    assert answer.solved
    assert answer.r[0::2] == pytest.approx([0.0, *(10 * GRAVITY * lever)], abs=1e-9)


@pytest.mark.parametrize("method", [elastic_limit, micro_displacements])
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
    answer = elastic_limit(table())
    legs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    expected = 4 * GRAVITY / 4 * (1 + legs @ np.array([0.1, 0.2]))
    assert answer.solved
    assert answer.r.reshape(-1, 3)[:, 0] == pytest.approx(expected, rel=1e-12)
    assert np.abs(answer.r.reshape(-1, 3)[:, 1:]).max() < 1e-10
    assert micro_displacements(table()).r == pytest.approx(answer.r, abs=1e-9)


@pytest.mark.parametrize("method", [elastic_limit, micro_displacements])
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


# ---- the limit is the minimum-norm solution, and unique -----------------------------------------


@pytest.mark.parametrize("top", [1.0, 1e4])
def test_sticking_tower_has_the_minimum_norm(top):
    problem = tower(10, top)
    answer = elastic_limit(problem)
    assert answer.solved
    assert difference(answer.r, minimum_norm_forces(problem)) < 1e-11
    # a heavier top: every box carries all above it, half at each corner
    above = top + 9 - np.arange(10)
    assert answer.r[0::2] == pytest.approx(np.repeat(above, 2) * GRAVITY / 2, rel=1e-11)


@pytest.mark.parametrize("across", [0.0, 2.0])
def test_frictionless_limit_obeys_the_conditions_of_least_energy(across):
    """f = k (-J dq)_+ and equilibrium are the conditions of min sum f^2/k, f >= 0, J^T f + Q = M a
    with contacts that part left out; across the pile accelerates, and they hold all the same."""
    problem = pyramid(6, 0.0, across=across)
    k = np.random.default_rng(3).uniform(0.5, 2.0, problem.contacts)
    answer = elastic_limit(problem, k)
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
def test_forces_do_not_depend_on_order_numbering_or_start(friction, across):
    problem = pyramid(4, friction, across=across)
    answer = elastic_limit(problem)
    rng = np.random.default_rng(7)
    order = rng.permutation(problem.contacts)
    other = pyramid(4, friction, order, rng.permutation(10), across=across)
    begun = rng.normal(size=30) * 0.1 * np.abs(answer.r).max()
    again = elastic_limit(other, start=begun)
    assert answer.solved
    assert again.solved
    sorted_back = np.empty((problem.contacts, 2))
    sorted_back[order] = again.r.reshape(-1, 2)
    assert difference(sorted_back.ravel(), answer.r) < 1e-10


@settings(max_examples=15, deadline=None)
@given(masses=st.integers(0, 10**6), spread=st.floats(0, 1))
def test_any_stiffness_frictionless_or_sticking(masses, spread):
    """Unique by order and equal to the least norm wherever nothing opens or slides."""
    problem = pyramid(3, 5.0, masses=masses)
    rng = np.random.default_rng(masses)
    k = np.repeat(10 ** rng.uniform(-spread / 2, spread / 2, (problem.contacts, 1)), 2, axis=1)
    answer = elastic_limit(problem, k)
    assert answer.solved
    least = minimum_norm_forces(problem, k)
    if (np.abs(least[1::2]) < 5.0 * least[0::2]).all():
        assert difference(answer.r, least) < 1e-9


def test_relaxation_has_the_same_limit():
    """Explicit eq. 40 to the end and the direct limit: 1e-12 of residual is 1e-9 in the forces,
    as the softest mode of this pile is 1e3 times softer than the stiffest."""
    problem = pyramid(3, 0.9)
    direct, relaxed = elastic_limit(problem), micro_displacements(problem)
    assert direct.solved
    assert relaxed.solved
    assert difference(relaxed.r, direct.r) < 1e-9
    assert direct.iterations < relaxed.iterations / 10


def test_relaxation_starts_warm():
    cold = micro_displacements(tower(4))
    warm = micro_displacements(tower(4, top=1.001), start=cold)
    assert micro_displacements(tower(4), start=cold).iterations == 0
    assert warm.solved
    assert warm.iterations < 0.9 * cold.iterations


def test_units_do_not_matter():
    """Millimetres and grams: forces in g mm / s^2 are 1e6 times those in N."""
    problem = pyramid(3, 0.4, across=1.0)
    space = problem.bodies
    freedom = np.tile([1e3, 1e3, 1.0], 6)
    jacobian = sp.csr_array(1e3 * space.jacobian @ sp.diags_array(1 / freedom))
    # energy, so mass by both freedoms, is 1e9 times as many g mm^2 / s^2
    inverse = sp.csr_array(sp.diags_array(1e-9 * freedom**2) @ space.inverse_mass)
    small = friction_problem(BodySpace(jacobian, inverse, 3), 1e3 * problem.offset, 0.4, 2)
    a, b = elastic_limit(problem), elastic_limit(small)
    assert difference(b.r, a.r * 1e6) < 1e-10


# ---- where it is not unique, and what is refused ------------------------------------------------


def test_friction_can_be_mobilised_in_more_ways_than_one():
    """The price of friction: from far away springs and sliders settle in other forces.

    Both are solutions, to the last digit; uniqueness is for frictionless and sticking contacts.
    """
    problem = pyramid(4, 0.9)
    near = elastic_limit(problem)
    start = np.random.default_rng(0).normal(size=30) * np.abs(near.r).max()
    far = elastic_limit(problem, start=start)
    assert near.solved
    assert far.solved
    assert max(near.residual, far.residual) < 1e-12
    assert difference(far.r, near.r) > 0.1


def test_sliding_contacts_remember_their_path():
    """A wedge between rough walls, pressed down hard first and then left to its weight: sliders
    with memory keep it jammed tighter than it would be from nothing; both obey eqs 26 and 27."""
    a, mass, friction = np.radians(20), np.array([1.0]), 0.5
    walls = [(-np.cos(a), np.sin(a)), (np.cos(a), np.sin(a))]
    contacts = [(0, -1, -0.1 * np.array(n), n) for n in walls]

    def wedge(push):
        load = [[0.0, -GRAVITY - push, 0.0]]
        # a heavy inertia: the wedge does not turn
        return bodies_2d(contacts, np.zeros((1, 2)), mass, 1e3 * mass, load, friction)

    from_nothing = micro_displacements(wedge(0.0), law=coulomb_slider)
    pressed = micro_displacements(wedge(100.0), law=coulomb_slider)
    unloaded = micro_displacements(wedge(0.0), law=coulomb_slider, start=pressed)
    assert from_nothing.solved
    assert pressed.solved
    assert unloaded.solved
    assert difference(unloaded.r, from_nothing.r) > 0.5
    # without memory, and in the direct limit, the path is forgotten
    forgets = micro_displacements(wedge(0.0), law=coulomb_spring, start=pressed.displacement)
    assert difference(forgets.r, elastic_limit(wedge(0.0)).r) < 1e-9
    assert difference(from_nothing.r, elastic_limit(wedge(0.0)).r) < 1e-9


def test_printed_sign_is_compression_positive():
    """A box dropped on its support has a < 0, its xi must grow and push: dq points down."""
    answer = micro_displacements(tower(1))
    assert (answer.r[0::2] > 0).all()
    assert answer.displacement[1] < 0


def test_step_bound():
    problem = pyramid(3, 0.9)
    jacobian, _ = mass_free_jacobian(problem.bodies)
    k = np.random.default_rng(0).uniform(0.1, 10, (problem.contacts, 2))
    scaled = np.sqrt(k.ravel())[:, None] * jacobian.toarray()
    stiffest = np.linalg.norm(scaled, 2) ** 2
    assert stiffest <= stiffest_mode(jacobian, k) <= 4 * stiffest
    assert stable_step(jacobian, k) == 1 / stiffest_mode(jacobian, k)
    sticks = tower(2, friction=1e6)
    j2, _ = mass_free_jacobian(sticks.bodies)
    true = np.linalg.norm(j2.toarray(), 2) ** 2
    # beyond 2 / l_max the printed relaxation does not settle
    begun = np.random.default_rng(0).normal(size=6)
    for share, settles in ((1.5, True), (2.1, False)):
        relaxed = micro_displacements(sticks, start=begun, step=share / true, iterations_max=3000)
        assert relaxed.solved is settles


def test_offset_outside_the_image_is_projected_once():
    """Two coincident contacts asked for different accelerations: the mean is what bodies can do."""
    problem = tower(1)
    jacobian, _ = mass_free_jacobian(problem.bodies)
    offset = np.random.default_rng(1).normal(size=len(problem.offset))
    left = offset - jacobian @ free_motion(jacobian, offset)
    assert np.abs(jacobian.T @ left).max() < 1e-13
    assert np.linalg.norm(left) > 0.1
    # no motion opens this: said by the status, at the best residual
    bad = friction_problem(problem.bodies, problem.offset + np.array([0, 1.0, 0, -1.0]), 1e6, 2)
    for method in (elastic_limit, micro_displacements):
        answer = method(bad, iterations_max=300)
        assert not answer.solved
        assert "->" in answer.message
        assert np.isfinite(answer.r).all()


def test_no_contacts_and_free_flight():
    empty = bodies_2d([], np.zeros((1, 2)), np.ones(1), np.ones(1), [[0, 0, 0]], 0.3)
    for method in (elastic_limit, micro_displacements):
        assert method(empty).solved
        answer = method(bodies_2d([(0, -1, (0, -1), (0, 1))], np.zeros((1, 2)), np.ones(1),
                                  np.ones(1), [[0, 5.0, 0]], 0.3))  # fmt: skip
        assert answer.solved
        assert np.all(answer.r == 0)


def test_malformed_input_is_refused():
    problem = tower(2)
    matrix = friction_problem(problem.delassus, problem.offset, 0.5, 2)
    for method in (elastic_limit, micro_displacements):
        with pytest.raises(ProblemError, match="no bodies"):
            method(matrix)
        for bad in (-1.0, [1.0, np.nan, 1.0, 1.0]):
            with pytest.raises(ProblemError, match="above zero"):
                method(problem, bad)
        with pytest.raises(ProblemError, match="shape"):
            method(problem, [1.0, 2.0])
        with pytest.raises(ProblemError, match="start"):
            method(problem, start=[1.0])
        with pytest.raises(ProblemError, match="differ"):
            method(table(), np.tile([1.0, 1.0, 2.0], (4, 1)))


# ---- kernels ------------------------------------------------------------------------------------


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10**6), dim=st.sampled_from([2, 3]))
def test_slider_slope_and_energy_by_differences(seed, dim):
    rng = np.random.default_rng(seed)
    k = rng.uniform(0.5, 2.0, (5, 1)) * np.ones((1, dim))
    xi, mu = rng.normal(size=(5, dim)), rng.uniform(0, 1, 5)
    limits = rng.uniform(0, 1, 5)
    e = 1e-6
    coulomb = slider_slope(k * xi, k, mu * np.maximum((k * xi)[:, 0], 0), mu)
    tresca = slider_slope(k * xi, k, limits)
    force = slider_forces(k * xi, limits)
    for j in range(dim):
        up, down = xi.copy(), xi.copy()
        up[:, j] += e
        down[:, j] -= e
        slope = coulomb_spring(up, 0 * xi, k, mu)[0] - coulomb_spring(down, 0 * xi, k, mu)[0]
        assert coulomb[:, :, j] == pytest.approx(slope / (2 * e), abs=1e-7)
        slope = slider_forces(k * up, limits) - slider_forces(k * down, limits)
        assert tresca[:, :, j] == pytest.approx(slope / (2 * e), abs=1e-7)
        for c in range(5):
            one = xi.copy()
            one[c, j] += e
            gain = slider_energy(k * one, k, limits) - slider_energy(k * xi, k, limits)
            assert gain / e == pytest.approx(force[c, j], abs=1e-5)


# ---- against a network of stiff springs, integrated in time -------------------------------------


class Springs:
    """Discs on linear springs, normal and tangential, with large displacements, damped.

    The geometry is the real one: overlaps, turning normals, rolling; so it differs from the
    rigid answer by the displacements, which are of order 1 / k.
    """

    def __init__(self, centre, radius, mass, pairs, planes, softness):
        self.centre, self.radius, self.mass = centre, radius, mass
        self.pairs, self.planes, self.softness = (
            np.array(pairs, int).reshape(-1, 2),
            planes,
            softness,
        )

    def rest(self, k, steps):
        """Forces (nc, 2) at rest, pairs first, planes after."""
        a = np.concatenate([self.pairs[:, 0], [p[0] for p in self.planes]]).astype(int)
        b = np.concatenate([self.pairs[:, 1], [-1] * len(self.planes)]).astype(int)
        plane_n = np.array([p[1] for p in self.planes], float)
        plane_d = np.array([p[2] for p in self.planes], float)
        x, phi_rate = self.centre.copy(), np.zeros(len(self.mass))
        v, shear = np.zeros_like(x), np.zeros(len(a))
        inertia = self.mass * self.radius**2 / 2
        dt = 0.15 * np.sqrt(self.mass.min() / k)
        damping = 0.25 * np.sqrt(k / self.mass.max())
        inside, m = b >= 0, len(self.pairs)
        other_radius = np.where(inside, self.radius[b], 0.0)
        for _ in range(steps):
            n = np.empty((len(a), 2))
            gap = np.empty(len(a))
            between = x[a[:m]] - x[b[:m]]
            distance = np.linalg.norm(between, axis=1)
            n[:m], gap[:m] = (
                between / distance[:, None],
                distance - self.radius[a[:m]] - other_radius[:m],
            )
            n[m:], gap[m:] = plane_n, (x[a[m:]] * plane_n).sum(1) - plane_d - self.radius[a[m:]]
            t = np.column_stack([-n[:, 1], n[:, 0]])
            relative = v[a] - np.where(inside[:, None], v[b], 0.0)
            spin = self.radius[a] * phi_rate[a] + np.where(inside, other_radius * phi_rate[b], 0.0)
            shear -= dt * ((relative * t).sum(1) - spin)
            normal = np.maximum(-k * gap, 0.0)
            most = 1e3 * normal / (self.softness * k)  # so much friction that only open ones slide
            shear = np.clip(shear, -most, most)
            f = np.column_stack([normal, self.softness * k * shear])
            push = f[:, :1] * n + f[:, 1:] * t
            total = np.zeros_like(x)
            total[:, 1] -= GRAVITY * self.mass
            torque = np.zeros(len(x))
            np.add.at(total, a, push)
            np.add.at(total, b[inside], -push[inside])
            np.add.at(torque, a, -self.radius[a] * f[:, 1])
            np.add.at(torque, b[inside], -(other_radius * f[:, 1])[inside])
            v += dt * (total / self.mass[:, None] - damping * v)
            phi_rate += dt * (torque / inertia - damping * phi_rate)
            x += dt * v
        assert np.linalg.norm(total) < 1e-7 * GRAVITY * self.mass.sum()
        return f

    def rigid(self):
        contacts = []
        for i, j in self.pairs:
            n = (self.centre[i] - self.centre[j]) / np.linalg.norm(self.centre[i] - self.centre[j])
            contacts.append((i, j, self.centre[i] - self.radius[i] * n, n))
        for i, n, _ in self.planes:
            contacts.append((i, -1, self.centre[i] - self.radius[i] * np.array(n), n))
        inertia = self.mass * self.radius**2 / 2
        return bodies_2d(contacts, self.centre, self.mass, inertia, weights(self.mass), 5.0)


def wedge_scene():
    """A disc in an uneven V."""
    n = [(np.cos(0.5), np.sin(0.5)), (-np.cos(0.9), np.sin(0.9))]
    planes = [(0, n[0], -1.0), (0, n[1], -1.0)]
    return Springs(np.zeros((1, 2)), np.ones(1), np.array([2.0]), [], planes, 0.7)


def pyramid_scene():
    """Six discs, 3 + 2 + 1, on a floor: 24 forces, 18 equations."""
    place = {(r, i): None for r in range(3) for i in range(3 - r)}
    keys = list(place)
    centre = np.array([[2 * i + r, 1 + r * np.sqrt(3)] for r, i in keys])
    pairs = [
        (p, q)
        for q, (r, i) in enumerate(keys)
        for p, other in enumerate(keys)
        if other in ((r, i + 1), (r + 1, i), (r + 1, i - 1))
    ]
    planes = [(p, (0.0, 1.0), 0.0) for p, (r, _) in enumerate(keys) if r == 0]
    mass = np.array([1.0, 1.2, 0.9, 1.5, 1.1, 2.0])
    return Springs(centre, np.ones(6), mass, pairs, planes, 0.7)


def springs_against_limit(springs, stiffness, steps):
    """Greatest difference of forces over the weight of all, and the rigid limit's forces."""
    problem = springs.rigid()
    answer = elastic_limit(problem, np.tile([1.0, springs.softness], (problem.contacts, 1)))
    assert answer.solved
    rigid = answer.r.reshape(-1, 2)
    return np.abs(springs.rest(stiffness, steps) - rigid).max() / (GRAVITY * springs.mass.sum())


@pytest.mark.parametrize("stiffness", [1e4, 1e7])
def test_springs_on_plane_walls_agree_at_any_stiffness(stiffness):
    """A disc keeps its normals as it sinks into plane walls: only round-off is left."""
    assert springs_against_limit(wedge_scene(), stiffness, 3000) < 1e-9


def test_stiff_springs_end_in_the_same_forces():
    """Springs ten times stiffer have a tenth of the error: normals turn by the displacements."""
    errors = [springs_against_limit(pyramid_scene(), k, 5000) for k in (1e5, 1e6, 1e7)]
    order = np.log10(errors[0] / errors[1]), np.log10(errors[1] / errors[2])
    assert errors[2] < 1e-5
    assert order == pytest.approx((1.0, 1.0), abs=0.1)
