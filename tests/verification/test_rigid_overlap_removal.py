"""Overlaps taken out after a step: what is kept, what changes by how much, energy never grows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import rigid_lcp as r
from rigid_lcp.motion.overlap_removal import remove_lift, remove_overlap
from rigid_lcp.motion.state import Motion
from rigid_lcp.motion.world import World, make_world
from validation.bench.rigid.scenes import fill_trough

G = 9.81


def pair_in_flight(depth: float, speed: float) -> tuple[World, Motion]:
    """Two boxes of different mass that overlap by ``depth`` [m] and pass each other."""
    scene = r.Scene(2)
    scene.add(r.Polygon.rectangle(1, 1), density=2.0, position=(0, 5), velocity=(0, speed))
    scene.add(r.Polygon.rectangle(1, 1), density=1.0, position=(1 - depth, 5.3), spin=0.2)
    return make_world(scene)


def angular_momentum(world: World, motion: Motion) -> float:
    """About the origin, of plane bodies that all move."""
    cross = motion.position[:, 0] * motion.velocity[:, 1]
    cross = cross - motion.position[:, 1] * motion.velocity[:, 0]
    return float((world.mass * cross + world.inertia * motion.spin).sum())


@settings(max_examples=25)
@given(depth=st.floats(1e-8, 1e-2), speed=st.floats(-3, 3))
def test_bodies_in_flight(depth: float, speed: float) -> None:
    """Centre of mass, momentum and energy are kept; angular momentum changes by sum m dx x v."""
    world, motion = pair_in_flight(depth, speed)
    apart = remove_overlap(world, motion)
    gap = world.contacts(apart, 0.0).gap.min(initial=0.0)
    assert gap > -1e-9
    np.testing.assert_array_equal(apart.rates, motion.rates)
    mass = world.mass[:, None]
    move = apart.position - motion.position
    assert np.abs((mass * move).sum(axis=0)).max() < 1e-15
    assert world.energy(apart) == pytest.approx(world.energy(motion), rel=1e-14)
    change = angular_momentum(world, apart) - angular_momentum(world, motion)
    v = motion.velocity
    expected = float((world.mass * (move[:, 0] * v[:, 1] - move[:, 1] * v[:, 0])).sum())
    assert change == pytest.approx(expected, abs=1e-13)
    # the bound of the docstring: overlap times momentum about the common centre
    relative = v - (mass * v).sum(axis=0) / mass.sum()
    assert abs(change) <= depth * np.abs(mass * relative).sum() + 1e-13


def test_spinning_boxes_in_space_keep_their_energy() -> None:
    """A box that is turned out of another spins on about the same axes of its own."""
    scene = r.Scene(3, (0, 0, 0))
    scene.add(r.make_box(1, 0.5, 0.2), density=2.0, spin=(1, 2, 3))
    scene.add(r.make_box(1, 0.5, 0.2), density=1.0, position=(0.9, 0.1, 0.19), spin=(-3, 1, 2))
    world, motion = make_world(scene)
    apart = remove_overlap(world, motion)
    assert np.abs(apart.angle - motion.angle).max() > 1e-4
    assert world.energy(apart) == pytest.approx(world.energy(motion), rel=1e-14)
    assert world.contacts(apart, 0.0).gap.min(initial=0.0) >= -1e-9 * world.length
    np.testing.assert_allclose(
        np.linalg.norm(apart.spin, axis=1), np.linalg.norm(motion.spin, axis=1), rtol=1e-14
    )


@settings(max_examples=25)
@given(angle=st.floats(0, 3), aside=st.floats(-0.5, 0.5), depth=st.floats(0.01, 0.3))
def test_a_small_grain_squeezed_between_large_ones(angle, aside, depth):
    """Overlaps of up to a third of the small one, which has to turn to get out: all gone."""
    scene = r.Scene(2)
    small = r.Polygon.regular(5, 0.1)
    for side in (-1, 1):
        place = (side * (1.1 - 0.1 * depth), 0)
        scene.add(r.Disc(1.0), density=1.0, position=place)
    scene.add(small, density=1.0, position=(0, 0.1 * aside), angle=angle)
    world, motion = make_world(scene)
    apart = remove_overlap(world, motion)
    assert world.contacts(apart, 0.0).gap.min(initial=0.0) >= -1e-9 * world.length


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("speed", [1e-3, 1.0])
def test_the_lift_is_paid(dim: int, speed: float) -> None:
    """A box 1e-4 m deep in the floor: ``v'^2 = v^2 - 2 g depth`` where it is fast enough, else 0.

    Not if the energy is that of a step which lost as much; not where the floor moves.
    """
    depth = 1e-4
    scene = r.Scene(dim)
    shape = r.Polygon.rectangle(1, 1) if dim == 2 else r.make_box(1, 1, 1)
    place, along = np.zeros(dim), np.zeros(dim)
    place[-1], along[0] = 0.5 - depth, speed
    scene.add(shape, density=2.0, position=place, velocity=along)
    scene.add(r.HalfSpace(np.eye(dim)[-1]))
    world, end = make_world(scene)
    parted = remove_overlap(world, end)
    assert parted.position[0, -1] == pytest.approx(0.5, abs=1e-12)
    energy = world.energy(end)
    paid = remove_lift(world, end, parted, energy)
    squared = max(0.0, speed**2 - 2 * G * depth)
    assert paid.velocity[0, 0] == pytest.approx(squared**0.5, rel=1e-9, abs=1e-15)
    if squared > 0:
        assert world.energy(paid) == pytest.approx(energy, rel=1e-14)
    else:
        assert world.energy(paid) - energy <= world.mass[0] * G * depth * (1 + 1e-9)
    lossy = remove_lift(world, end, parted, energy + 1.1 * world.mass[0] * G * depth)
    assert lossy is parted
    floor = scene.bodies[1]
    scene.bodies[1] = replace(floor, velocity=0.1 * np.eye(dim)[0])
    moving, _ = make_world(scene)
    moved = replace(parted, velocity=np.array([along, 0.1 * np.eye(dim)[0]]))
    assert remove_lift(moving, moved, moved, energy - 1.0) is moved


@pytest.mark.parametrize(("seed", "step"), [(1, 1e-3), (5, 4e-3), (6, 8e-3)])
@pytest.mark.long
def test_no_step_of_a_pour_gains_energy(seed: int, step: float) -> None:
    """Round-off of the sums alone, 1e-13 of the energy (seed 1 gained 8e-6 J of 117 J in a step
    before lifts were paid)."""
    run = fill_trough(40, seed=seed, step=step)
    before = first = run.energy
    while run.time < 0.3:
        run.advance(step)
        after = run.energy
        assert after - before <= 1e-13 * first
        before = after
    assert run.overlap <= 1e-9 * run.world.length


def test_loads_may_lift() -> None:
    """A load that lifts a box adds its work: the box gains what the load gave, to round-off."""
    scene = r.Scene(2)
    scene.add(r.Polygon.rectangle(1, 1), density=2.0, position=(0, 0.5))
    scene.add(r.HalfSpace((0, 1)))
    pull = 3 * 2.0 * G
    run = r.Simulation(scene, loads=lambda time, motion: np.array([[0, pull, 0], [0, 0, 0.0]]))
    first = run.energy
    run.advance(0.1)
    way = run.positions[0, 1] - 0.5
    assert way > 0.05
    assert run.energy - first == pytest.approx(pull * way, rel=1e-12)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("step", [1e-3, 1e-4])
@pytest.mark.parametrize("speed", [0.02, 0.1, 1.0])
@pytest.mark.parametrize("gap", [0.0, 1e-6])
def test_who_got_the_velocity_pays_for_the_lift(dim, step, speed, gap):
    """A ball lands on a floor under a ball at rest that it touches, e = 1: it bounces and hands its
    velocity on.  Energy after the step is that before it, to round-off (before, ``m g v h / 2``
    more, half of it at 2 cm/s).  Where they touch, the upper ball leaves with what its climb of at
    most ``v h`` left, ``v^2 - 2 g v h <= v'^2 <= v^2``; else they may meet in the next step."""
    scene = r.Scene(dim)
    up = np.eye(dim)[-1]
    ball = r.Disc(0.01) if dim == 2 else r.Sphere(0.01)
    scene.add(ball, density=1000.0, position=0.01 * up, velocity=-speed * up, restitution=1)
    scene.add(ball, density=1000.0, position=(0.03 + gap) * up, restitution=1)
    scene.add(r.HalfSpace(up), restitution=1)
    run = r.Simulation(scene, step=step)
    begin = run.energy
    run.advance(step)
    assert run.energy == pytest.approx(begin, rel=1e-14)
    squared = run.velocities[1, -1] ** 2
    if gap == 0.0:
        assert speed**2 - 2 * G * speed * step <= squared <= speed**2 * (1 + 1e-12)
    assert run.overlap <= 1e-9 * run.world.length


@pytest.mark.parametrize("count", [2, 3, 5, 10])
@pytest.mark.parametrize("e", [1.0, 0.8, 0.3])
@pytest.mark.long
def test_a_struck_stack_never_gains_energy(count: int, e: float) -> None:
    """A column whose lowest ball comes down on the floor: no step of 1 ms gains more than round-off
    of the energy, 1e-13 of it."""
    scene = r.Scene(2)
    for k in range(count):
        scene.add(
            r.Disc(0.01), density=1000.0, position=(0, 0.01 + 0.020001 * k),
            velocity=(0, -0.1 * (k == 0)), restitution=e,
        )  # fmt: skip
    scene.add(r.HalfSpace((0, 1)), restitution=e)
    run = r.Simulation(scene)
    before = first = run.energy
    for _ in range(100):
        run.advance(1e-3)
        assert run.energy - before <= 1e-13 * first
        before = run.energy


def test_a_lift_keeps_momentum_along_the_floor() -> None:
    """A ball comes down on a floor at a slant, under another: what the lift costs is not taken from
    what both have along the floor."""
    scene = r.Scene(2)
    scene.add(r.Disc(0.01), density=1000.0, position=(0, 0.01), velocity=(0.3, -0.1), restitution=1)
    scene.add(r.Disc(0.01), density=1000.0, position=(0, 0.03), velocity=(0.3, 0), restitution=1)
    scene.add(r.HalfSpace((0, 1)), restitution=1)
    run = r.Simulation(scene)
    begin = run.energy
    run.advance(1e-3)
    assert run.energy == pytest.approx(begin, rel=1e-14)
    assert run.velocities[:2, 0].sum() == pytest.approx(0.6, rel=1e-13)
