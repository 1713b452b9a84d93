"""The soft grains that rigid ones are measured against: closed forms, balances, a NumPy twin."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigid_lcp.motion.world import Scene, make_world
from rigid_lcp.scene.file import place_grains
from rigid_lcp.scene.types import Grains
from rigid_lcp.shapes.half_space import HalfSpace
from rigid_lcp.shapes.polygon import Polygon
from validation.studies.rigid_ballast import soft as md

pytestmark = pytest.mark.studies

MU, K = 0.6, 1e7


def block_on_floor(angle: float = 0.0, speed: float = 0.0) -> md.SoftGrains:
    """A block 0.1 m wide and 0.05 m high on a floor; gravity tilted by ``angle`` [rad]."""
    scene = Scene(2, gravity=9.81 * np.array([np.sin(angle), -np.cos(angle)]))
    scene.add(HalfSpace([0, 1], 0.0))
    scene.add(Polygon.rectangle(0.1, 0.05), density=2600, position=(0, 0.025), velocity=(speed, 0))
    world, motion = make_world(scene)
    return md.soften_grains(world, motion, K, MU)


def advance(run: md.SoftGrains, seconds: float, force: tuple[float, float] = (0.0, 0.0)) -> None:
    md.advance_grains(run, 1, np.array([force, force]), seconds)


def test_block_sinks_by_its_weight_over_the_stiffness() -> None:
    """Two corners carry m g: d = m g / (2 k), and the block is at rest."""
    run = block_on_floor()
    advance(run, 0.2)
    weight = run.world.mass[1] * 9.81
    assert 0.025 - run.motion.position[1, 1] == pytest.approx(weight / (2 * K), rel=1e-9)
    assert np.abs(run.motion.velocity[1]).max() < 1e-12
    assert run.contacts[2][:, 0].sum() == pytest.approx(weight, rel=1e-9)


def test_block_on_a_slope_sticks_below_the_friction_angle() -> None:
    """tan(angle) < mu: at rest, the springs carry m g sin(angle), moved by that over 2 k_t."""
    run = block_on_floor(angle=0.4)
    advance(run, 0.3)
    down = run.world.mass[1] * 9.81 * np.sin(0.4)
    assert run.contacts[2][:, 1].sum() == pytest.approx(down, rel=1e-8)  # along -x
    assert np.abs(run.motion.velocity[1]).max() < 1e-10
    start = run.motion.position[1, 0]
    advance(run, 0.5)
    assert abs(run.motion.position[1, 0] - start) < 1e-12


def test_block_slides_beyond_the_friction_angle() -> None:
    """v = g (sin(angle) - mu cos(angle)) t once the load is carried."""
    run = block_on_floor(angle=0.7)
    advance(run, 0.1)
    before = run.motion.velocity[1, 0]
    advance(run, 0.1)
    gained = 9.81 * (np.sin(0.7) - MU * np.cos(0.7)) * 0.1
    assert run.motion.velocity[1, 0] - before == pytest.approx(gained, rel=1e-3)


def test_work_of_the_load_is_kinetic_energy_in_free_flight() -> None:
    run = block_on_floor()
    lifted = run.motion.position.copy()
    lifted[1, 1] = 1.0
    run.motion = type(run.motion)(lifted, run.motion.angle, run.motion.velocity, run.motion.spin)
    before = run.world.energy(run.motion)
    advance(run, 0.01, (300.0, 200.0))
    gained = run.world.energy(run.motion) - before
    mass = run.world.mass[1]
    first_order = (np.hypot(300, 200) + mass * 9.81) ** 2 / mass * 0.01 * run.step
    assert run.work == pytest.approx(gained, abs=first_order)
    assert run.work > 10 * first_order
    assert len(run.contacts[0]) == 0


def test_friction_of_a_wall_is_remembered_in_a_scene_of_many_bodies() -> None:
    """Walls have small numbers: their springs must survive beside those of other pairs.

    Lost springs let the stack slide on; with them it rests but for some ringing of the edges.
    """
    scene = Scene(2, gravity=9.81 * np.array([np.sin(0.3), -np.cos(0.3)]))
    scene.add(HalfSpace([0, 1], 0.0))
    for k in range(4):
        scene.add(Polygon.rectangle(0.1, 0.05), density=2600, position=(0, 0.025 + 0.05 * k))
    world, motion = make_world(scene)
    run = md.soften_grains(world, motion, K, MU)
    md.advance_grains(run, 1, np.zeros((2, 2)), 1.0)
    start = run.motion.position[1:, 0].copy()
    md.advance_grains(run, 1, np.zeros((2, 2)), 0.4)
    assert np.abs(run.motion.position[1:, 0] - start).max() < 1e-4 * np.abs(start).max()


def law_twin(
    gap: float, normal: float, slip: float, spring: float, masses: tuple[float, float], h: float
) -> tuple[float, float, float]:
    k, k_t, zeta, mu = K, md.TANGENTIAL * K, md.DAMPING, MU
    force = np.maximum(0.0, -k * gap - 2 * zeta * np.sqrt(k * masses[0]) * normal)
    spring = np.clip(spring - k_t * slip * h, -mu * force, mu * force)
    total = spring - 2 * zeta * np.sqrt(k_t * masses[1]) * slip
    return float(force), float(np.clip(total, -mu * force, mu * force)), float(spring)


@settings(max_examples=50)
@given(
    gap=st.floats(-1e-3, 0), normal=st.floats(-1, 1), slip=st.floats(-1, 1),
    spring=st.floats(-1e4, 1e4), mass=st.floats(0.1, 10),
)  # fmt: skip
def test_law_is_that_of_its_twin_and_never_pulls(gap, normal, slip, spring, mass):
    law = np.array([K, md.TANGENTIAL * K, md.DAMPING, MU])
    found = md.apply_law(law, gap, normal, slip, spring, mass, 0.5 * mass, 1e-5)
    twin = law_twin(gap, normal, slip, spring, (mass, 0.5 * mass), 1e-5)
    assert found == pytest.approx(twin, rel=1e-12)
    assert found[0] >= 0
    assert abs(found[1]) <= MU * found[0] * (1 + 1e-12)


def test_spring_passes_to_the_nearest_contact_of_the_same_pair() -> None:
    """Key 8 of pair 5 is gone: key 9 takes its spring; pair 6 begins without one."""
    pair, key = np.array([5, 5, 6]), np.array([7, 9, 8])
    point = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 0.0]])
    old_pair, old_key = np.array([5, 5]), np.array([8, 7])
    old_point = np.array([[0.9, 0.0], [0.0, 0.0]])
    kept = md.keep_springs(pair, key, point, old_pair, old_key, old_point, np.array([3.0, 4.0]))
    np.testing.assert_array_equal(kept, [4.0, 3.0, 0.0])


def test_falling_polygons_never_gain_energy() -> None:
    """Kinetic, gravitational and spring energy ``k d^2 / 2 + s^2 / (2 k_t)`` of stones that fall on
    each other: contacts that pass from corner to corner and slide only lose it.

    In free flight the explicit step loses or gains ``m g v h / 2`` of ``m g v``: first order.
    """
    scene = Scene(2)
    scene.add(HalfSpace([0, 1], 0.0))
    scene.add(HalfSpace([1, 0], -0.07))
    scene.add(HalfSpace([-1, 0], -0.07))
    grains = Grains(count=8, size=[0.03, 0.05], corners=[3, 6], density=2600.0,
                    region_low=[-0.07, 0.0], region_high=[0.07, 0.3], seed=5)  # fmt: skip
    for shape, position, angle in place_grains(grains, 2):
        scene.add(shape, density=2600.0, position=position, angle=angle)
    world, motion = make_world(scene)
    run = md.soften_grains(world, motion, K, MU)

    def energy() -> float:
        gap, spring = run.contacts[1][:, 4], run.springs.force
        stored = K * np.minimum(gap, 0.0) ** 2 + spring**2 / (md.TANGENTIAL * K)
        return float(run.world.energy(run.motion) + 0.5 * stored.sum())

    found = [energy()]
    for _ in range(400):
        advance(run, 5e-4)
        found.append(energy())
    assert np.diff(found).max() < 2e-3 * (found[0] - found[-1])
    assert found[-1] < 0.9 * found[0]
