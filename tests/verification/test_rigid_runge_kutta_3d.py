"""Acceleration level in space: closed forms, Euler's equations, orders, both methods' one limit."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from rigid_lcp import HalfSpace, Polyhedron, Scene, Simulation, Sphere, make_box
from rigid_lcp.arrays import Floats
from rigid_lcp.scene.simulation import Method
from rigid_lcp.shapes.rotations import make_quaternion, rotate
from tests import rigid_motions as motions

G = 9.81
DENSITY = 1e3
FLOOR = HalfSpace([0.0, 0.0, 1.0], 0.0)


def orders(error: Callable[[float], float], steps: list[float]) -> Floats:
    """Orders of convergence between steps that halve."""
    errors = np.array([error(step) for step in steps])
    return np.asarray(np.log2(errors[:-1] / errors[1:]))


# --- free flight ---


@pytest.mark.long
@pytest.mark.parametrize(("method", "order"), [("acceleration", 4.0), ("time-stepping", 2.0)])
def test_a_free_stone_obeys_eulers_equations(method: Method, order: float) -> None:
    """Spun 42 rad/s about no principal axis for half a turn; both to their orders."""
    seconds = 0.08
    wanted = motions.stone_in_flight_answer(seconds)

    def error(step: float) -> float:
        run = motions.stone_in_flight(method, step)
        run.advance(seconds)
        turned = run.angles[0]
        return float(np.linalg.norm(turned * np.sign(turned @ wanted) - wanted))

    assert np.allclose(orders(error, [2e-3, 1e-3, 5e-4]), order, atol=0.25)


# --- rolling ---


@pytest.mark.long
@pytest.mark.parametrize(
    ("method", "step"), [("acceleration", 0.02), ("acceleration", 0.01), ("time-stepping", 1e-3)]
)
def test_a_sphere_stops_slipping_and_rolls(method: Method, step: float) -> None:
    """Slip s0 = v0 + w0 x x, gone at t = 2 |s0| / (7 mu g); then v = (5 v0 - 2 w0 x x) / 7.

    Not straight on: with oblique backspin the path before is a parabola.  Constant forces in both
    phases, so only the event limits the accuracy.
    """
    radius, mu = 0.1, 0.5
    v0, spin0, arm = np.array([1.0, 0.2, 0]), np.array([3.0, -10, 7]), np.array([0, 0, -radius])
    scene = Scene(3)
    scene.add(Sphere(radius), density=DENSITY, position=-arm, velocity=v0, spin=spin0, friction=mu)
    scene.add(FLOOR)
    run = Simulation(scene, method, step=step)
    slip = v0 + np.cross(spin0, arm)
    seconds = 2 * np.linalg.norm(slip) / (7 * mu * G)
    run.advance(0.7 * seconds)
    sliding = v0 - mu * G * 0.7 * seconds * slip / np.linalg.norm(slip)
    assert np.allclose(run.velocities[0], sliding, atol=1e-13 if method == "acceleration" else 1e-9)
    run.advance(0.8 * seconds)
    rolling = (5 * v0 - 2 * np.cross(spin0, arm)) / 7
    assert np.allclose(run.velocities[0], rolling, atol=1e-9)
    assert np.allclose(np.cross(arm, run.spins[0])[:2], rolling[:2], atol=1e-9)
    assert run.spins[0, 2] == pytest.approx(7.0, rel=1e-9)
    assert run.contacts.status.tolist() == ["stick"]


@pytest.mark.parametrize("azimuth", [0.0, 1.0])
def test_a_sphere_rolls_down_with_five_sevenths(azimuth: float) -> None:
    """``a = 5/7 g sin(alpha)``, whichever way is down."""
    alpha, radius, seconds = np.deg2rad(20.0), 0.1, 0.3
    downhill = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    normal = np.sin(alpha) * downhill + [0.0, 0.0, np.cos(alpha)]
    scene = Scene(3)
    scene.add(Sphere(radius), density=DENSITY, position=radius * normal, friction=0.5)
    scene.add(HalfSpace(normal, 0.0))
    run = Simulation(scene, "acceleration", step=0.02)
    run.advance(seconds)
    slope = np.cos(alpha) * downhill - [0.0, 0.0, np.sin(alpha)]
    way = 5 / 14 * G * np.sin(alpha) * seconds**2
    assert np.allclose(run.positions[0] - radius * normal, way * slope, atol=1e-12)


@pytest.mark.long
@pytest.mark.parametrize("method", ["acceleration", "time-stepping"])
def test_a_sphere_rolls_in_circles_on_a_turntable(method: Method) -> None:
    """``v' = 2/7 W z x v`` on a table that turns by W, whatever its spin about z (Milne 1948).

    Nothing but b^T of eq. 24 bends its way.
    """
    radius, turning, h = 0.1, 3.0, 5e-3
    v0, x0 = np.array([0.2, 0.5, 0.0]), np.array([0.3, 0.0, radius])
    slip = np.cross([0.0, 0.0, turning], x0) - v0
    spin = [slip[1] / radius, -slip[0] / radius, 0.7]  # w x (0, 0, -R) = slip: it rolls
    scene = Scene(3)
    scene.add(
        make_box(4.0, 4.0, 0.2),
        fixed=True,
        position=(0, 0, -0.1),
        spin=(0, 0, turning),
        friction=0.9,
    )
    scene.add(Sphere(radius), density=DENSITY, position=x0, velocity=v0, spin=spin, friction=0.9)
    run = Simulation(scene, method, step=h)
    run.advance(0.2)
    rate = 2 / 7 * turning
    angle = rate * 0.2
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    # time stepping: of second order, (W h)^2 = 2e-4 of what changed; fourth order: to round-off
    off = 1e-12 if method == "acceleration" else 2e-5
    np.testing.assert_allclose(run.velocities[1, :2], turn @ v0[:2], atol=off)
    friction = np.linalg.norm(run.contacts.tangential_force[0])
    mass = Sphere(radius).mass_properties(DENSITY)[0]
    assert friction == pytest.approx(mass * rate * np.linalg.norm(v0), rel=max(off, 1e-10) * 10)


# --- a block that slides and turns on an incline ---


@pytest.mark.parametrize(
    ("method", "order", "steps"),
    [("acceleration", 4.0, [0.02, 0.01, 0.005]), ("time-stepping", 1.0, [8e-3, 4e-3, 2e-3])],
)
@pytest.mark.long
def test_a_block_slides_and_turns(method: Method, order: float, steps: list[float]) -> None:
    """Both methods go to the one solution, Runge-Kutta with the fourth order.

    Time stepping takes the direction of friction from the end of the step: first order.
    """
    seconds = 0.12
    wanted = motions.sliding_prism_answer(seconds)

    def error(step: float) -> float:
        run = motions.sliding_prism(method, step)
        run.advance(seconds)
        assert (run.contacts.status == "slide").all()
        return float(np.abs(motions.sliding_prism_place(run) - wanted).max())

    assert np.allclose(orders(error, steps), order, atol=0.3)
    assert error(steps[-1]) < (1e-9 if method == "acceleration" else 2e-3)


# --- a cube that falls from a corner onto the edge, and over ---

SIZE, TILT = 0.1, 0.2
OTHER = (1 / 6 + 1 / 4) / (1 / 6 + 3 / 4)
"""Spin after over spin before the impact of the edge's other corner: angular momentum about it.

With I = m s^2 / 6 and the levers (s/2, h), (-s/2, h) from the corners to the centre, s the size
and h = s / sqrt(2):  ``(I + m (h^2 - s^2/4)) w- = (I + m (h^2 + s^2/4)) w+``  (Housner, 1963).
"""


def tipping_cube(method: str, step: float, seconds: float) -> Simulation:
    """A cube on one corner of an edge that is raised by `TILT`, faces at 45 degrees about it."""
    turn = make_quaternion([0.0, TILT, 0.0])
    level = make_quaternion([np.pi / 4, 0.0, 0.0])
    cube = make_box(SIZE, SIZE, SIZE)
    placed = Polyhedron(rotate(turn, rotate(level, cube.vertices)))
    scene = Scene(3)
    height = -placed.vertices[:, 2].min()
    scene.add(placed, density=DENSITY, position=[0.0, 0.0, height], friction=1.0)
    scene.add(FLOOR)
    run = Simulation(scene, method, step=step)  # type: ignore[arg-type]
    run.advance(seconds)
    return run


def test_a_cube_falls_from_a_corner_with_its_energy() -> None:
    start = tipping_cube("acceleration", 0.01, 0.0).energy
    run = tipping_cube("acceleration", 5e-3, 0.06)
    assert (run.contacts.status == "stick").all()
    assert run.energy == pytest.approx(start, rel=1e-8)


@pytest.mark.parametrize("method", ["acceleration", "time-stepping"])
@pytest.mark.long
def test_a_cube_rocks_over_the_edge_as_housner_says(method: str) -> None:
    """The edge lands: the first corner lifts off, the spin about the other is `OTHER` of before.

    The energy kept is ``OTHER^2`` of the kinetic energy at the impact, ``m g`` times what the
    centre has come down.
    """
    run = tipping_cube(method, 5e-3 if method == "acceleration" else 5e-4, 0.0)
    mass, high = run.world.mass[0], run.positions[0, 2]
    impact = mass * G * (high - SIZE / 2**0.5)
    run.advance(0.12)
    kinetic = run.energy - mass * G * SIZE / 2**0.5
    # time stepping: the impact lies somewhere in a step, which is 1 % of the fall
    accuracy = 1e-6 if method == "acceleration" else 0.05
    assert kinetic == pytest.approx(OTHER**2 * impact, rel=accuracy)
    assert run.spins[0, 1] < 0  # on over the corner, about -y as before
    assert np.abs(run.spins[0, [0, 2]]).max() < 1e-6
    assert len(run.contacts) == 1
