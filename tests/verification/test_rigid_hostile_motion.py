"""Acceleration level on hostile scenes: rocking, clattering, reversal, many impacts."""

from __future__ import annotations

from itertools import pairwise
from math import cos, pi, sin
from typing import Any

import numpy as np
import pytest

from rigid_lcp import HalfSpace, Polygon, Scene, Simulation
from rigid_lcp.errors import NotConverged
from rigid_lcp.motion.acceleration_forces import find_forces, try_lasting_forces
from tests.rigid_motions import rocking_block, rocking_block_answer
from validation.bench.rigid.packings import build_tower
from validation.bench.rigid.scenes import FLOOR, G, turn_gravity


@pytest.mark.long
@pytest.mark.parametrize("share", [0.5, 0.9])
def test_rocking_block(share: float) -> None:
    """Housner's block: each impact leaves ``(1 - 3/2 sin^2 alpha)^2`` of the energy, at its time.

    An impact is met to a gap of 5e-10 of the block's size: 1e-8 of its energy.
    """
    alpha = np.arctan2(0.2, 1.0)
    run = rocking_block(0.2, 1.0, share * alpha)
    times, left = rocking_block_answer(0.2, 1.0, share * alpha, 3)
    flat = run.world.mass[0] * G * 1.0
    first = run.energy - flat
    for count, (before, after) in enumerate(pairwise(times), 1):
        run.advance(before + 1e-6 - run.time)
        assert run.pace.collisions == count
        assert abs(run.angles[0]) < 1e-5
        run.advance((before + after) / 2 - run.time)  # the top of its swing
        assert run.energy - flat == pytest.approx(left**count * first, rel=1e-6)
        assert abs(run.spins[0]) < 1e-5


@pytest.mark.long
@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_a_box_clatters_to_rest(restitution: float) -> None:
    """It lands on one corner, then the other, ever faster; the cut-off lets it lie flat."""
    scene = Scene(2)
    scene.add(
        Polygon.rectangle(1, 0.3), density=1.0, position=(0, 0.2), angle=0.02,
        restitution=restitution,
    )  # fmt: skip
    scene.add(FLOOR, friction=0.3, restitution=restitution)
    run = Simulation(scene, "acceleration", step=0.01)
    run.advance(0.6)
    assert run.positions[0, 1] == pytest.approx(0.15, abs=1e-9)
    assert run.angles[0] == pytest.approx(0.0, abs=1e-9)
    assert np.abs(run.velocities).max() < 1e-9
    assert run.overlap < 1e-11


@pytest.mark.long
@pytest.mark.parametrize("mu", [0.1, 0.5])
def test_sliding_reverses_or_ends(mu: float) -> None:
    """A block thrown uphill stops, and slides down again iff ``mu < tan(slope)``: parabolas."""
    slope, seconds = 0.3, 0.4
    scene = Scene(2, turn_gravity(slope))
    scene.add(Polygon.rectangle(1, 1), density=1.0, position=(0, 0.5), velocity=(-1, 0))
    scene.add(FLOOR, friction=mu)
    run = Simulation(scene, "acceleration", step=0.01)
    run.advance(seconds)
    up, down = (G * (sin(slope) + sign * mu * cos(slope)) for sign in (1, -1))
    expected = -0.5 / up + max(down, 0.0) * (seconds - 1 / up) ** 2 / 2
    assert run.positions[0, 0] == pytest.approx(expected, abs=1e-12)
    assert run.pace.shortened == 1


@pytest.mark.parametrize("quick", [{"spin": 1e9}, {"velocity": (1e9, 0)}])
def test_too_fast_to_be_followed(quick: dict[str, Any]) -> None:
    """A step a thousandth of a turn: it says so instead of going on for ever."""
    scene = Scene(2, (0, 0))
    scene.add(Polygon.regular(5, 0.1), density=1.0, **quick)
    with pytest.raises(NotConverged, match="more than 1e"):
        Simulation(scene, "acceleration").advance(1.0)


def test_many_elastic_impacts_keep_the_energy() -> None:
    """Five-cornered grains without friction in a box, e = 1: 1e-14 of the energy an impact."""
    generator = np.random.default_rng(0)
    scene = Scene(2)
    for k in range(6):
        scene.add(
            Polygon.regular(5, 0.1), density=1.0, position=(0.25 * (k % 3), 0.15 + 0.25 * (k // 3)),
            angle=generator.uniform(0, 6), velocity=generator.uniform(-1, 1, 2), restitution=1.0,
        )  # fmt: skip
    for normal, offset in (((0, 1), 0.0), ((1, 0), -0.125), ((-1, 0), -0.625)):
        scene.add(HalfSpace(normal, offset), friction=0.0, restitution=1.0)
    run = Simulation(scene, "acceleration", step=0.01)
    energy = run.energy
    run.advance(0.2)
    assert run.pace.collisions > 10
    assert abs(run.energy / energy - 1) < 1e-14 * run.pace.collisions


@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
def test_two_corners_at_once(restitution: float) -> None:
    """A box falls into a right-angled groove, both flanks flush: it comes back without turning."""
    scene = Scene(2, (0, 0))
    scene.add(
        Polygon.rectangle(1, 1), density=1.0, position=(0, 1), angle=pi / 4, velocity=(0, -1),
        restitution=restitution,
    )  # fmt: skip
    for normal in ((1, 1), (-1, 1)):
        scene.add(HalfSpace(normal, 0.0), friction=0.3, restitution=restitution)
    run = Simulation(scene, "acceleration", step=0.01)
    run.advance(0.5)
    np.testing.assert_allclose([*run.velocities[0], run.spins[0]], [0, restitution, 0], atol=1e-9)


@pytest.mark.parametrize(("boxes", "speed", "mu"), [(6, 0.0, 0.5), (2, 1.0, 0.2)])
def test_lasting_contacts_are_solved_at_once(boxes: int, speed: float, mu: float) -> None:
    """A redundant tower, at rest or its lowest box sliding: every contact presses, none moves but
    along its slip, where friction is -mu r_N (eqs 26, 27).  None where one would have to pull, or
    to grip by more than its friction."""
    problem = build_tower(boxes, 2)
    slip, friction, lifted = np.zeros((2 * boxes, 1)), problem.friction.copy(), problem.offset + 0
    slip[:2], friction[:2] = speed, mu
    found = try_lasting_forces(problem.bodies, problem.offset, friction, slip)
    assert found is not None
    assert found.residual < 1e-13
    r, u = found.r.reshape(-1, 2), (problem.delassus @ found.r + problem.offset).reshape(-1, 2)
    u[slip[:, 0] > 0, 1] = 0.0
    assert np.abs(u).max() < 1e-12 * np.abs(problem.offset).max()
    assert (r[:, 0] > 0).all()
    assert (np.abs(r[:, 1]) <= friction * r[:, 0] * (1 + 1e-12)).all()
    assert r[:2, 1] == pytest.approx(-mu * speed * r[:2, 0], abs=1e-12)
    lifted[4 - 2 * boxes :: 2] = 1.0
    for limit in (friction, 0.0 * friction):
        assert try_lasting_forces(problem.bodies, lifted, limit, slip) is None
    asked, error = find_forces(problem.bodies, lifted, friction, slip, 1e-12, G)
    assert error < 1e-11
    assert (asked.r[::2] == 0).any()
    friction[2:] = 0.1  # slowed down by 0.2 g, a box above would have to grip by more
    found = try_lasting_forces(problem.bodies, problem.offset, friction, slip)
    assert (found is None) == (speed > 0)
