"""Scenes in space with known answers: rest, rolling, towers, piles."""

from __future__ import annotations

import numpy as np
import pytest

from rigid_lcp import HalfSpace, Polyhedron, Scene, Simulation, Sphere, make_box
from rigid_lcp.arrays import Floats
from rigid_lcp.shapes.rotations import make_quaternion, normalise, rotate
from tests.rigid_solids import angular_momentum, make_stone

G = 9.81
FLOOR = HalfSpace([0.0, 0.0, 1.0], 0.0)


def on_floor(shape: object, **state: object) -> Simulation:
    scene = Scene(dim=3)
    scene.add(shape, density=2000.0, **state)  # type: ignore[arg-type]
    scene.add(FLOOR)
    return Simulation(scene)


@pytest.mark.parametrize("corners", [5, 8])
@pytest.mark.parametrize("below", ["floor", "block"])
@pytest.mark.long
def test_a_leaning_prism_stands_on_all_of_its_face(corners: int, below: str) -> None:
    """Its centre is over the face, a thirtieth from an edge: with four of the corners for all of
    them it tips towards those left out, and creeps by 0.1 mm a second."""
    around = 2 * np.pi * np.arange(corners) / corners
    ring = np.column_stack([np.cos(around), np.sin(around), np.zeros(corners)])
    for k in range(corners):
        edge = (ring[k] + ring[(k + 1) % corners]) / 2
        prism = Polyhedron(np.vstack([ring, ring + 2 * 0.97 * edge + [0.0, 0.0, 1.0]]))
        scene = Scene(dim=3)
        if below == "floor":
            scene.add(FLOOR, friction=0.8)
        else:
            scene.add(make_box(6, 6, 1), fixed=True, position=[0, 0, -0.5], friction=0.8)
        scene.add(prism, density=1000, friction=0.8)
        run = Simulation(scene)
        start = run.positions.copy()
        run.advance(0.01)
        assert np.abs(run.positions - start).max() < 1e-14
        assert len(run.contacts) == corners


# --- spheres ---


@pytest.mark.long
def test_a_sphere_spins_on_like_a_top() -> None:
    """A point contact has no moment about its normal: a sphere that stands keeps its spin."""
    run = on_floor(Sphere(0.1), position=[0.0, 0.0, 0.1], spin=[0.0, 0.0, 50.0], friction=0.8)
    run.advance(0.3)
    assert np.allclose(run.spins[0], [0.0, 0.0, 50.0], rtol=1e-13)
    assert np.abs(run.positions[0] - [0.0, 0.0, 0.1]).max() < 1e-13


@pytest.mark.long
def test_a_spinning_stone_flies_on_a_parabola_with_its_momentum() -> None:
    stone = make_stone(np.random.default_rng(0), 0.05)
    scene = Scene(dim=3)
    spin = np.array([20.0, -35.0, 10.0])
    scene.add(stone, density=2700.0, position=[0.0, 0.0, 1.0], velocity=[1.0, 2.0, 3.0], spin=spin)
    run = Simulation(scene, step=1e-3)
    inertia = stone.mass_properties(2700.0)[1]
    momentum = angular_momentum(inertia, run.angles[0], spin)
    energy = run.energy
    run.advance(0.2)
    fallen = np.array([0.2, 0.4, 1.0 + 0.6 - G * 0.02])
    assert np.allclose(run.positions[0], fallen, atol=1e-12)
    found = angular_momentum(inertia, run.angles[0], run.spins[0])
    assert np.allclose(found, momentum, rtol=0, atol=1e-12 * np.linalg.norm(momentum))
    # second order: (w h)^2 = 1.6e-3 of the energy of rotation, which is bounded
    assert run.energy == pytest.approx(energy, rel=1e-4)


def precessing_top(step: float, seconds: float) -> float:
    """Error of a steadily precessing top [-]: a pyramid of twelve sides on its tip, which sticks.

    At the angle theta and the precession Omega, with the moments of inertia I1 about the tip and
    I3 about the axis:  ``I1 Omega^2 cos(theta) - I3 w3 Omega + m g l = 0`` (Goldstein, 5.7).
    """
    theta, precession = 0.3, 6.0
    around = 2 * np.pi * np.arange(12) / 12
    ring = np.column_stack([0.04 * np.cos(around), 0.04 * np.sin(around), np.full(12, 0.06)])
    top = Polyhedron(np.vstack([ring, np.zeros(3)]))
    mass, inertia = top.mass_properties(1e3)
    length = float(top.centroid[2])
    tip = inertia[0, 0] + mass * length**2
    spin = (tip * precession**2 * np.cos(theta) + mass * G * length) / inertia[2, 2] / precession
    turn = make_quaternion([0.0, theta, 0.0])
    axis = rotate(turn, [0.0, 0.0, 1.0])
    vertical = np.array([0.0, 0.0, 1.0])
    omega = precession * vertical + (spin - precession * np.cos(theta)) * axis
    scene = Scene(dim=3)
    scene.add(top, density=1e3, position=length * axis, angle=turn, spin=omega,
              velocity=np.cross(omega, length * axis), friction=1.0)  # fmt: skip
    scene.add(FLOOR)
    run = Simulation(scene, step=step)
    run.advance(seconds)
    gone = precession * seconds
    wanted = [np.sin(theta) * np.cos(gone), np.sin(theta) * np.sin(gone), np.cos(theta)]
    return float(np.linalg.norm(run.positions[0] / length - wanted))


@pytest.mark.long
def test_a_top_precesses_at_second_order() -> None:
    """190 rad/s about its axis: without the gyroscopic change of spin within the step, the order
    is one and the error of the finer run twice as large."""
    coarse, fine = (precessing_top(step, 0.1) for step in (1e-3, 5e-4))
    assert fine < 2e-3
    assert np.log2(coarse / fine) == pytest.approx(2.0, abs=0.15)


# --- towers and piles ---


@pytest.mark.parametrize("top", [1.0, 1e4])
@pytest.mark.long
def test_a_tower_of_ten_boxes_stands(top: float) -> None:
    scene = Scene(dim=3)
    start = np.array([[0.0, 0.0, 0.5 + k] for k in range(10)])
    for k, place in enumerate(start):
        density = 1e3 * (top if k == 9 else 1.0)
        scene.add(make_box(1.0, 1.0, 1.0), density=density, position=place, friction=0.5)
    scene.add(FLOOR)
    run = Simulation(scene, step=5e-3)
    run.advance(0.5)
    assert len(run.contacts) == 40
    assert np.abs(run.positions[:10] - start).max() < 1e-9
    weight = 1e3 * G * (9 + top)
    below = run.contacts.body_b == 10
    assert run.contacts.normal_force[below].sum() == pytest.approx(weight, rel=1e-9)


def test_a_twisted_tower_stands_on_crossing_edges() -> None:
    """Every cube is turned by 30 degrees on the one below; the shared faces are dodecagons."""
    scene = Scene(dim=3)
    start = np.array([[0.0, 0.0, 0.5 + k] for k in range(5)])
    for k, place in enumerate(start):
        turn = make_quaternion([0.0, 0.0, k * np.pi / 6])
        scene.add(make_box(1.0, 1.0, 1.0), density=1e3, position=place, angle=turn, friction=0.5)
    scene.add(FLOOR)
    run = Simulation(scene, step=5e-3)
    run.advance(0.25)
    assert np.abs(run.positions[:5] - start).max() < 1e-9


def poured(count: int, size: float, seed: int) -> Scene:
    """Stones at random angles in layers of nine, just apart, above the floor."""
    generator = np.random.default_rng(seed)
    scene = Scene(dim=3)
    for number in range(count):
        layer, cell = divmod(number, 9)
        across = 1.35 * size * np.array([cell % 3 - 1.0, cell // 3 - 1.0])
        scene.add(
            make_stone(generator, size), density=2700.0, friction=0.6,
            position=[*across, size * (0.8 + 1.4 * layer)],
            angle=normalise(generator.normal(size=4)),
        )  # fmt: skip
    scene.add(FLOOR)
    return scene


def settle(run: Simulation, seconds: float, step: float) -> tuple[float, Floats]:
    """Run; returns the greatest overlap on the way [m] and the energies [J]."""
    overlap, energies = 0.0, [run.energy]
    for _ in range(round(seconds / step)):
        run.advance(step)
        overlap = max(overlap, run.overlap)
        energies.append(run.energy)
    return overlap, np.array(energies)


def check_pile(count: int, seconds: float) -> None:
    size, step = 0.05, 4e-3
    run = Simulation(poured(count, size, 7), step=step, tolerance=1e-8)
    overlap, energies = settle(run, seconds, step)
    # What the curved path of a corner leaves of overlap in a step: reach (w h)^2 / 2, for a stone
    # that was stopped at its rim, w = v / (size / 2), after the fall from the top of the pour.
    speed = np.sqrt(2 * G * size * (0.8 + 1.4 * (count // 9)))
    assert overlap < 0.5 * 0.65 * size * (2 * speed / size * step) ** 2
    assert run.overlap < 1e-3 * size
    assert np.abs(run.velocities[:count]).max() < 0.02  # was 1 to 3 m/s
    assert run.positions[:count, 2].min() > 0.2 * size
    # A body that comes to rest within a step may gain m (g h)^2 / 8.
    mass = sum(body.mass for body in run.world.scene.bodies[:count])
    assert np.diff(energies).max() < mass * (G * step) ** 2 / 8 + 1e-9 * energies[0]
    weight = mass * G
    floor = run.contacts.body_b == count
    assert run.contacts.force[floor, 2].sum() == pytest.approx(weight, rel=0.05)


@pytest.mark.long
def test_a_handful_of_stones_comes_to_rest() -> None:
    check_pile(9, 0.8)


@pytest.mark.validate
def test_a_pile_of_fifty_stones_comes_to_rest() -> None:
    check_pile(50, 1.2)
