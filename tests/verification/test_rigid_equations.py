"""The geometry equations: gap rates and inertial terms by finite differences of the gap itself."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigid_lcp import Disc, HalfSpace, Polygon, Scene
from rigid_lcp.contact.arrays import Contacts, match_keys
from rigid_lcp.motion.equations import (
    build_jacobian,
    find_contact_offset,
    find_inertial_acceleration,
    find_relative_velocity,
    make_body_space,
)
from rigid_lcp.motion.state import Motion, displace_motion, replace_rates
from rigid_lcp.motion.world import World, make_world

PAIRS = {
    "vertex on face": (Polygon.regular(3, 0.6), Polygon.rectangle(4, 1)),
    "disc on face": (Disc(0.4), Polygon.rectangle(4, 1)),
    "disc on disc": (Disc(0.4), Disc(0.7)),
    "disc on vertex": (Disc(0.4), Polygon.regular(3, 0.6)),
    "vertex on half-space": (Polygon.regular(5, 0.6), HalfSpace((0.3, 1))),
    "disc on half-space": (Disc(0.6), HalfSpace((0.3, 1))),
}


def touching(name: str, seed: int) -> tuple[World, Motion, Contacts]:
    """A pair at a gap of zero whose gap rate is zero, otherwise in random motion; one contact."""
    generator = np.random.default_rng(seed)
    upper, lower = PAIRS[name]
    scene = Scene(2)
    for shape in (upper, lower):
        scene.add(shape, density=2.0)
    world, motion = make_world(scene)
    position, angle = motion.position.copy(), motion.angle.copy()
    angle[:] = generator.uniform(0, 2 * np.pi, 2)
    if name == "vertex on face":
        angle[0] = angle[1] - np.pi / 2 + generator.uniform(-0.5, 0.5)  # a vertex down
    frame = np.array([[np.cos(angle[1]), -np.sin(angle[1])], [np.sin(angle[1]), np.cos(angle[1])]])
    if name == "disc on vertex":
        position[0] = position[1] + frame @ [0.8, generator.uniform(-0.2, 0.2)]
    elif isinstance(lower, HalfSpace):
        position[0] = lower.normal * 0.5
    else:
        position[0] = position[1] + frame @ [generator.uniform(-0.4, 0.4), 0.95]
    motion = Motion(position, angle, motion.velocity, motion.spin)
    contacts = world.contacts(motion, 1.0)
    contacts = contacts[np.array([np.argmin(contacts.gap)])]
    move = np.zeros((2, 3))
    move[0, :2] = -contacts.gap[0] * contacts.normal[0]
    motion = displace_motion(motion, move)
    rates = generator.normal(size=(2, 3))
    if isinstance(lower, HalfSpace):
        rates[1] = 0.0
    motion = replace_rates(motion, rates)
    contacts = again(world, motion, contacts)
    rates[0, :2] -= find_relative_velocity(contacts, motion)[0, 0] * contacts.normal[0]
    return world, replace_rates(motion, rates), contacts


def again(world: World, motion: Motion, contacts: Contacts) -> Contacts:
    """The same contact at another state."""
    found = world.contacts(motion, 1.0)
    rows, there = match_keys(found.key, contacts.key)
    assert there.all()
    return found[rows]


@pytest.mark.parametrize("name", PAIRS)
@pytest.mark.parametrize("seed", range(4))
def test_gap_rate(name: str, seed: int) -> None:
    """``dg/dq`` (eq. 13) by central differences: error h^2 = 1e-10, round-off 1e-16 / h = 1e-11."""
    world, motion, contacts = touching(name, seed)
    lower_moves = not isinstance(PAIRS[name][1], HalfSpace)
    rows = build_jacobian(contacts, motion.position, np.arange(2), 2).toarray()[0]
    h = 1e-5
    for freedom in range(6 if lower_moves else 3):
        move = np.zeros((2, 3))
        move.ravel()[freedom] = h
        ahead = again(world, displace_motion(motion, move), contacts).gap[0]
        behind = again(world, displace_motion(motion, -move), contacts).gap[0]
        assert rows[freedom] == pytest.approx((ahead - behind) / (2 * h), abs=1e-9)


@pytest.mark.parametrize("name", PAIRS)
@pytest.mark.parametrize("seed", range(4))
def test_normal_inertial_terms(name: str, seed: int) -> None:
    """``d2g/dq2 q' q'`` (eq. 14): second difference of the gap at constant rates.

    Error h^2 g''''/12 = 1e-7 for h = 1e-3, round-off 1e-16 / h^2 = 1e-10.
    """
    world, motion, contacts = touching(name, seed)
    h = 1e-3
    gap = [again(world, displace_motion(motion, k * h * motion.rates), contacts).gap[0]
           for k in (-1, 0, 1)]  # fmt: skip
    assert abs(gap[2] - gap[0]) < 1e-5  # the gap rate is zero
    expected = (gap[0] - 2 * gap[1] + gap[2]) / h**2
    assert find_inertial_acceleration(contacts, motion)[0, 0] == pytest.approx(expected, abs=1e-4)
    # Richardson: a quarter of the error at half the step
    half = [again(world, displace_motion(motion, k * h / 2 * motion.rates), contacts).gap[0]
            for k in (-1, 0, 1)]  # fmt: skip
    finer = (half[0] - 2 * half[1] + half[2]) / (h / 2) ** 2
    best = (4 * finer - expected) / 3
    assert find_inertial_acceleration(contacts, motion)[0, 0] == pytest.approx(best, abs=2e-8)


@pytest.mark.parametrize("name", PAIRS)
@pytest.mark.parametrize("seed", range(4))
def test_tangential_inertial_terms(name: str, seed: int) -> None:
    """Eq. 24: the rate of the tangential velocity at constant rates, gap and gap rate zero."""
    world, motion, contacts = touching(name, seed)
    h = 1e-5
    slip = []
    for k in (-1, 1):
        there = displace_motion(motion, k * h * motion.rates)
        slip.append(find_relative_velocity(again(world, there, contacts), there)[0, 1])
    expected = (slip[1] - slip[0]) / (2 * h)
    assert find_inertial_acceleration(contacts, motion)[0, 1] == pytest.approx(expected, abs=1e-8)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=20)
def test_relative_velocity_is_j_v(seed: int) -> None:
    """``u = J v``, and J^T f has no resultant on a pair: momentum and angular momentum are kept."""
    world, motion, contacts = touching("vertex on face", seed)
    rows = build_jacobian(contacts, motion.position, world.columns, 2)
    np.testing.assert_allclose(
        rows @ motion.rates.ravel(), find_relative_velocity(contacts, motion).ravel(), atol=1e-12
    )
    force = rows.T @ np.array([1.3, -0.4])
    pushes = force.reshape(2, 3)
    np.testing.assert_allclose(pushes[:, :2].sum(axis=0), 0, atol=1e-15)
    x = motion.position
    torque = pushes[:, 2].sum() + (x[:, 0] * pushes[:, 1] - x[:, 1] * pushes[:, 0]).sum()
    assert torque == pytest.approx(0, abs=1e-13)


def test_matrix_of_a_box_at_rest() -> None:
    """Eq. 17 for a box of mass m, sides 2a, 2b on two corners: A_NN = 1/m + a^2/J, 1/m - a^2/J."""
    scene = Scene(2)
    scene.add(Polygon.rectangle(2.0, 1.0), density=3.0, position=(0, 0.5))
    scene.add(HalfSpace((0, 1)))
    world, motion = make_world(scene)
    contacts = world.contacts(motion, 1e-9)
    bodies = make_body_space(contacts, motion.position, world.columns, world.inverse_mass(motion))
    mass, inertia = 6.0, 6.0 * (4 + 1) / 12
    assert bodies.jacobian.shape == (4, 3)  # the floor has no columns
    normal = bodies.matrix.toarray()[::2, ::2]
    np.testing.assert_allclose(normal[0, 0], 1 / mass + 1 / inertia)
    np.testing.assert_allclose(normal[0, 1], 1 / mass - 1 / inertia)
    free = replace_rates(motion, world.accelerations(motion, None))
    np.testing.assert_allclose(find_contact_offset(contacts, motion, free), [-9.81, 0, -9.81, 0])


def test_driven_body_has_velocity_but_no_columns() -> None:
    scene = Scene(2)
    scene.add(Polygon.rectangle(1, 1), density=1.0, position=(0, 1.0))
    scene.add(Polygon.rectangle(4, 1), fixed=True, velocity=(0.5, 0))
    world, motion = make_world(scene)
    contacts = world.contacts(motion, 1e-9)
    assert build_jacobian(contacts, motion.position, world.columns, 1).shape == (4, 3)
    np.testing.assert_allclose(np.abs(find_relative_velocity(contacts, motion)[:, 1]), 0.5)
