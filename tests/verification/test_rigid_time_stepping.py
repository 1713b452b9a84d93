"""Velocity-level time stepping: ballistics, rolling, sliding, impacts, energy, order, units."""

from __future__ import annotations

from dataclasses import replace
from math import radians, sqrt, tan

import numpy as np
import pytest

from rigid_lcp import Disc, HalfSpace, Polygon, Scene, Simulation
from rigid_lcp.contact.arrays import build_frames
from rigid_lcp.errors import NotConverged
from rigid_lcp.scene import simulation
from rigid_lcp.scene.simulation import Method
from tests.rigid_motions import bouncing_time, disc_on_incline_acceleration
from validation.bench.rigid.scenes import G, drop_disc, fill_trough, stack, tilt_block, tilt_disc


def test_free_flight_is_exact() -> None:
    """The midpoint rule is exact for constant gravity: a parabola, at a constant spin."""
    scene = Scene(2)
    scene.add(Polygon.rectangle(1, 2), density=3.0, velocity=(3, 4), spin=2.0)
    run = Simulation(scene, step=0.05)
    energy = run.energy
    run.advance(1.0)
    np.testing.assert_allclose(run.positions[0], [3, 4 - G / 2], rtol=1e-13)
    np.testing.assert_allclose(run.angles, 2.0, rtol=1e-13)
    assert run.energy == pytest.approx(energy, rel=1e-14)
    assert run.time == pytest.approx(1.0)


@pytest.mark.long
@pytest.mark.parametrize("method", ["time-stepping", "acceleration"])
@pytest.mark.parametrize("mu", [0.02, 0.5])
def test_disc_rolls_or_slides(mu: float, method: Method) -> None:
    """``2/3 g sin`` or ``g (sin - mu cos)``: constant accelerations, so exact at any step."""
    slope = radians(20)
    run = tilt_disc(slope, mu, method=method, step=2e-3)
    run.advance(0.1)
    expected = disc_on_incline_acceleration(slope, mu)
    assert run.velocities[0, 0] == pytest.approx(expected * 0.1, rel=1e-11)
    assert run.positions[0, 0] == pytest.approx(expected * 0.005, rel=1e-11)
    assert run.contacts.status[0] == ("stick" if mu > tan(slope) / 3 else "slide")
    assert run.contacts.normal_force.sum() == pytest.approx(
        run.world.mass[0] * G * np.cos(slope), rel=1e-11
    )


@pytest.mark.long
def test_block_slides_to_rest() -> None:
    """It stops after ``v^2 / (2 mu g)``, to first order: within half a step's way at the end."""
    run = tilt_block(0.0, 0.5, step=1e-3)
    run.motion.velocity[0, 0] = 1.0
    run.advance(0.3)
    assert run.positions[0, 0] == pytest.approx(1 / G, abs=0.5 * (0.5 * G * 1e-3) * 1e-3)
    assert np.abs(run.velocities).max() < 1e-12
    assert (run.contacts.status == "stick").all()


def test_zeno_bounce() -> None:
    """It has stopped by ``sqrt(2h/g) (1+e)/(1-e)``, up to the steps that hold several bounces."""
    errors = []
    for step in (4e-3, 5e-4):
        run = drop_disc(0.1, 0.5, step=step)
        seconds = bouncing_time(0.1, 0.5)
        while np.abs(run.velocities[0, 1]) > 1e-9 or run.positions[0, 1] > 0.1 + 1e-9:
            run.advance(step)
            assert run.time < 2 * seconds
        errors.append(abs(run.time - seconds))
    assert errors[0] < 0.1 * seconds
    assert errors[1] < 0.5 * errors[0]


@pytest.mark.long
def test_energy_of_many_bounces() -> None:
    """Restitution 1: a bounce keeps the energy to round-off, whatever the step."""
    run = drop_disc(0.02, 1.0, step=3e-3)
    energy, bounces, falling = run.energy, 0, True
    for _ in range(4500):
        run.advance(3e-3)
        bounces += falling and run.velocities[0, 1] > 0
        falling = run.velocities[0, 1] <= 0
    assert bounces > 100
    assert abs(run.energy / energy - 1) < 1e-13 * bounces


def test_balls_that_bounce_upon_each_other_keep_their_energy() -> None:
    """Three in a column, e = 1, under gravity: where a step holds more than one collision, the
    later ones do not reverse what gravity gives in all of the step (once 0.25 % of the energy)."""
    scene = Scene(2)
    scene.add(HalfSpace((0, 1)), restitution=1)
    for height in (0.15, 0.38, 0.61):
        scene.add(Disc(0.1), density=1e3, position=(0, height), restitution=1)
    run = Simulation(scene, step=2e-3)
    begin = run.energy
    run.advance(1.7)
    assert run.energy == pytest.approx(begin, rel=1e-12)


@pytest.mark.long
def test_energy_never_grows_without_friction() -> None:
    """Boxes and discs that fall into a heap: no step adds energy but by overlaps removed."""
    scene = Scene(2)
    for k in range(8):
        shape = Disc(0.3) if k % 2 else Polygon.regular(5, 0.35)
        scene.add(
            shape, density=10.0 ** (k % 3), position=(0.2 * (k % 3), 0.5 + 0.8 * k), angle=0.3 * k,
            restitution=0.4,
        )  # fmt: skip
    for normal, offset in (((0, 1), 0), ((1, 0), -1.5), ((-1, 0), -1.5)):
        scene.add(HalfSpace(normal, offset))
    run = Simulation(scene, step=2e-3)
    energy = [run.energy]
    for _ in range(700):
        run.advance(2e-3)
        energy.append(run.energy)
    weight = run.world.mass[:8].sum() * G
    # An overlap of a turning corner is (h w)^2 R / 8 ~ 1e-5 m: its removal lifts bodies by that.
    assert np.diff(energy).max() < weight * 1e-5
    assert energy[-1] < 0.6 * energy[0]
    assert run.overlap < 1e-5


def test_forces_are_in_balance() -> None:
    """At rest the forces on every body sum to its weight (eq. 22), whatever their distribution."""
    run = stack(5, 10.0)
    run.advance(5e-3)
    contacts, total = run.contacts, np.zeros((6, 2))
    np.add.at(total, contacts.body_a, contacts.force)
    np.add.at(total, contacts.body_b, -contacts.force)
    weight = run.world.mass[:5] * G
    np.testing.assert_allclose(total[:5, 1], weight, rtol=1e-9)
    np.testing.assert_allclose(total[:5, 0], 0, atol=1e-9 * weight.max())
    assert build_frames(contacts.normal).shape == (10, 2, 2)


@pytest.mark.long
def test_poured_grains_come_to_rest() -> None:
    """A small heap loses its energy, and its overlaps stay below 1e-4 of a grain."""
    run = fill_trough(12, step=2e-3)
    run.advance(0.5)
    assert np.abs(run.velocities).max() < 0.05 * sqrt(G * 0.02)
    assert run.overlap < 1e-4 * run.world.length
    assert run.worst_residual < 1e-9


def test_no_overlap_is_left_after_a_step() -> None:
    """Grains that are poured turn, and are hit, faster than a step foresees: with steps of 4 ms the
    geometry at its end is what counts.  A projection is exact to 1e-9 of the forces it takes."""
    run = fill_trough(12, seed=5)
    for _ in range(40):
        run.advance(4e-3)
        assert run.overlap < 1e-8 * run.world.length


@pytest.mark.long
def test_steps_above_the_tolerance_are_counted_and_bad_ones_stop_the_run(monkeypatch):
    """No method reaches 1e-30; a residual above zero is counted, and above the greatest it ends."""
    run = stack(5, 10.0)
    counted = Simulation(run.world.scene, tolerance=1e-30)
    counted.advance(3e-3)
    assert 0 < counted.steps_above <= 3
    assert 0.0 < counted.worst_residual < 1e-12
    strict = replace(simulation.SIMULATION, most_residual=1e-29)
    monkeypatch.setattr(simulation, "SIMULATION", strict)
    with pytest.raises(NotConverged):
        Simulation(run.world.scene, tolerance=1e-30).advance(3e-3)


def test_loads_are_those_of_the_midpoint() -> None:
    """A disc on a spring to the origin goes round: ``(cos w t, sin w t)``, to second order.

    Taken where the step starts, the pull lags by half a step and turns into a push along the way:
    the disc would gain ``w h / 2`` of its speed a radian.
    """

    def end(step: float) -> float:
        scene = Scene(2, gravity=(0.0, 0.0))
        scene.add(Disc(0.1), density=1.0, position=(1, 0), velocity=(0, 2))
        mass = scene.bodies[0].mass
        run = Simulation(
            scene, step=step,
            loads=lambda _, motion: np.append(-4.0 * mass * motion.position[0], 0.0)[None, :],
        )  # fmt: skip
        run.advance(3.0)
        return float(np.linalg.norm(run.positions[0] - [np.cos(6.0), np.sin(6.0)]))

    # the midpoint rule turns by w h - (w h)^3 / 24 a step, or with the kick in its middle + / 24
    assert end(0.01) < 6.0 * 0.02**2 / 20
    assert end(0.02) / end(0.01) == pytest.approx(4.0, rel=0.02)
