"""Restitution with friction: no impact makes energy, and wedged bodies stop."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from rigid_lcp import BodySpace, Disc, HalfSpace, Polygon, Scene, Simulation, Sphere, make_box
from rigid_lcp.collision.passing import Closing, Impulses
from rigid_lcp.collision.restitution_scale import Share, gains_energy
from rigid_lcp.errors import NotConverged
from rigid_lcp.motion.acceleration_forces import find_forces
from rigid_lcp.scene.simulation import Method

ROUND_OFF = 1e-13  # relative round-off of an energy after some hundred steps


def tilted_rod(friction: float) -> Scene:
    """A rod 20 times as long as wide that comes down at a slant, restitution 1, no gravity."""
    scene = Scene(2, (0, 0))
    scene.add(
        Polygon.rectangle(2.0, 0.1), density=1.0, position=(0, 1.3), angle=1.0, velocity=(0.3, -1),
        restitution=1.0, friction=friction,
    )  # fmt: skip
    scene.add(HalfSpace((0, 1)))
    return scene


@pytest.mark.parametrize("method", ["time-stepping", "acceleration"])
@pytest.mark.parametrize("friction", [0.3, 1.0])
def test_a_rod_that_comes_down_at_a_slant_gains_nothing(method: Method, friction: float) -> None:
    """Kane's paradox: by Newton's restitution alone it leaves with 5 % (mu = 0.3) or 14 % more.

    ``E' - E = p_T (u_T + u_T') / 2`` at restitution 1: friction makes energy where the normal
    impulse turns the slip round.  As much restitution is left as makes none, to 1/64: E', a
    parabola of it from a rest to 1.2 E, rises by no more than 3 E, so that .95 E stays.
    """
    run = Simulation(tilted_rod(friction), method, step=0.01)
    energy = run.energy
    run.advance(1.0)
    assert run.velocities[0, 1] > 0.0
    assert 0.95 * energy <= run.energy <= energy * (1.0 + ROUND_OFF)
    assert run.steps_scaled == 1


def wedged_rod(friction: float) -> Scene:
    """A rod of 45 degrees whose ends touch two walls and turn towards them, restitution 0.5."""
    scene = Scene(2, (0, 0))
    end = [[-1.0, 1.0], [-1.0, 0.98], [0.98, -1.0]]
    scene.add(
        Polygon([*end, *(-np.array(end)).tolist()]), density=1.0, spin=1.0, restitution=0.5,
        friction=friction,
    )  # fmt: skip
    for normal in ((1, 0), (-1, 0)):
        scene.add(HalfSpace(normal, -1.0))
    return scene


@pytest.mark.parametrize(
    "method", ["time-stepping", pytest.param("acceleration", marks=pytest.mark.long)]
)
@pytest.mark.parametrize(("friction", "spin"), [(0.5, -0.5), (2.0, 0.0)])
def test_a_wedged_rod_bounces_or_stops(method: Method, friction: float, spin: float) -> None:
    """Friction turns the rod by ``2 mu p`` against the ``2 p`` of the walls: for mu > 1 no impulses
    let it bounce, and it stops.  A step of 1 ms turns it by 1 mrad, and the normals with it."""
    run = Simulation(wedged_rod(friction), method, step=1e-3)
    energy = run.energy
    run.advance(0.01)
    assert run.spins[0] == pytest.approx(spin, abs=1e-3)
    assert run.energy <= energy * (1.0 + ROUND_OFF)
    assert run.worst_residual <= 1e-12


def test_forces_without_bound_are_not_accepted() -> None:
    """A wedged rod (mu = 2) whose ends approach faster than any of its motions: of 1e16 N any
    residual is small, but nothing is stopped."""
    rows = [[1.0, 0.0, -1.0], [0.0, 1.0, -1.0], [-1.0, 0.0, -1.0], [0.0, -1.0, -1.0]]
    bodies = BodySpace(sp.csr_array(np.array(rows)), sp.csr_array(sp.eye_array(3)), 3)
    offset, friction = np.array([-1.5, -1.0, -1.5, -1.0]), np.array([2.0, 2.0])
    with pytest.raises(NotConverged, match="residual"):
        find_forces(bodies, offset, friction, np.zeros((2, 1)), 1e-12, 9.81)


def gas(dim: int, seed: int) -> Scene:
    """Bodies of different masses, thrown about in a box, without gravity; restitution 1."""
    draw = np.random.default_rng(seed)
    scene = Scene(dim, np.zeros(dim))
    shapes = {
        2: [Polygon.rectangle(0.6, 0.2), Disc(0.25)],
        3: [make_box(0.6, 0.3, 0.2), Sphere(0.25)],
    }
    for k, place in enumerate(np.ndindex(*(2,) * dim)):
        scene.add(
            shapes[dim][k % 3 % 2], density=10.0 ** draw.uniform(-1, 1),
            position=np.array(place) + 0.5, velocity=2.0 * draw.normal(size=dim),
            spin=3.0 * draw.normal(size=2 * dim - 3),
            angle=draw.normal(size=4) if dim == 3 else draw.normal(),
            restitution=1.0, friction=0.5,
        )  # fmt: skip
    for wall in np.vstack([np.eye(dim), -np.eye(dim)]):
        scene.add(HalfSpace(wall, -0.1 if wall.sum() > 0 else -2.1))
    return scene


@pytest.mark.long
@pytest.mark.parametrize("dim", [2, 3])
def test_a_gas_with_friction_never_gains_energy(dim: int) -> None:
    """Step for step: ``E' <= E`` to round-off, and collisions happen."""
    run = Simulation(gas(dim, 0), step=2e-3)
    energies = [run.energy]
    for _ in range(150):
        run.advance(2e-3)
        energies.append(run.energy)
    assert np.diff(energies).max() <= 1e-14 * energies[0]
    assert energies[-1] < 0.95 * energies[0]


def test_a_slide_that_ends_elsewhere_leaves_a_bounce_as_it_is() -> None:
    """A block comes to rest while a ball bounces at 0.8: they do not feel each other."""
    speeds = []
    for friction in (0.0, 0.5):
        scene = Scene(2)
        scene.add(Disc(0.1), density=1.0, position=(5.0, 0.15), restitution=0.8, velocity=(0, -1))
        scene.add(
            Polygon.rectangle(0.4, 0.2), density=1.0, position=(0.0, 0.1), friction=friction,
            velocity=(0.3, 0.0),
        )  # fmt: skip
        scene.add(HalfSpace((0, 1)))
        run = Simulation(scene, step=1e-3)
        run.advance(0.06)
        speeds.append(run.velocities[0, 1])
    assert speeds[0] > 0.5
    assert speeds[1] == speeds[0]


@pytest.mark.parametrize(("bounce", "makes"), [(0.0, False), (0.1, True), (0.2, True)])
def test_an_impact_may_return_what_a_load_gives_within_a_step_and_no_more(bounce, makes):
    """A body of mass M, on which a load works that gives it g in a step, rises with g / 2.

    Stopped, without restitution, its impulse is ``M g / 2`` and works ``M g^2 / 8``: the most that
    a stop can.  Thrown back with ``bounce`` g the work is ``M g^2 (1/2 + bounce)^2 / 2``: more.
    """
    mass, gain = 3.0, 0.7
    bodies = BodySpace(
        sp.csr_array(np.eye(2, 3)), sp.csr_array(sp.diags_array([1 / mass, 1 / mass, 1.0])), 3
    )
    before, free = np.array([[0.5 * gain, 0.0]]), np.array([[-0.5 * gain, 0.0]])
    closing = Closing(
        np.array([1.0]), np.array([0.5]), np.zeros(1), before[:, 0], free, np.zeros(1), 0.0, 1.0,
        0.0,
    )  # fmt: skip
    gained = np.array([[-gain, 0.0, 0.0]])
    after = bounce * gain
    impulse = np.array([[mass * (after + 0.5 * gain), 0.0]])
    found = Impulses(impulse, np.array([[after, 0.0]]), 0.0, "")
    work = 0.5 * impulse[0, 0] * (0.5 * gain + after)
    assert work == pytest.approx(mass * gain**2 * (0.5 + bounce) ** 2 / 2, rel=1e-14)
    gains = gains_energy(bodies, closing, before, free, gained, found, np.array([True]))
    assert gains.tolist() == [makes]


def test_each_contact_keeps_the_greatest_share_that_makes_no_energy() -> None:
    """Energy is made above a share of each: 1 + log2(64) trials find it to 1/64, from below, and
    one more stands at all of them.  What is left out is tried once, without any."""
    most, share, trials = np.array([0.0, 0.3, 0.999, 1.0]), Share(4), 1
    while share.bisect(share.now > most):
        trials += 1
    assert trials <= 8
    assert (share.now <= most).all()
    assert (share.now >= np.where(most < 1, most - 1 / 64, 1)).all()
    share.leave_out()
    assert not share.now.any()
    assert not share.bisect(np.zeros(4, bool))
