"""Acceleration level on hostile scenes: rocking, clattering, reversal, many impacts."""

from __future__ import annotations

from itertools import pairwise
from math import cos, pi, sin
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from rigid_lcp.errors import NotConverged
from rigid_lcp.motion.acceleration_forces import find_forces, try_lasting_forces
from rigid_lcp.motion.world import Scene
from rigid_lcp.scene.simulation import Simulation
from rigid_lcp.shapes.disc import Disc
from rigid_lcp.shapes.half_space import HalfSpace
from rigid_lcp.shapes.polygon import Polygon
from tests.rigid_motions import rocking_block, rocking_block_answer
from tests.rigid_networks import tower, tower_bodies
from validation.bench.rigid.scenes import FLOOR, G, gravity_on

Floats = NDArray[np.float64]


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


@pytest.mark.parametrize("mu", [0.1, 0.5])
def test_sliding_reverses_or_ends(mu: float) -> None:
    """A block thrown uphill stops, and slides down again iff ``mu < tan(slope)``: parabolas."""
    slope, seconds = 0.3, 0.4
    scene = Scene(2, gravity_on(slope))
    scene.add(Polygon.rectangle(1, 1), density=1.0, position=(0, 0.5), velocity=(-1, 0))
    scene.add(FLOOR, friction=mu)
    run = Simulation(scene, "acceleration", step=0.01)
    run.advance(seconds)
    up, down = (G * (sin(slope) + sign * mu * cos(slope)) for sign in (1, -1))
    expected = -0.5 / up + max(down, 0.0) * (seconds - 1 / up) ** 2 / 2
    assert run.positions[0, 0] == pytest.approx(expected, abs=1e-12)
    assert run.pace.shortened == 1


def test_backspin() -> None:
    """A disc that slides forwards with backspin comes back: ``v + r w / 2`` is kept, to rolling."""
    scene = Scene(2)
    scene.add(Disc(0.5), density=1.0, position=(0, 0.5), velocity=(1, 0), spin=10.0)
    scene.add(FLOOR, friction=0.3)
    run = Simulation(scene, "acceleration", step=0.01)
    run.advance(0.8)
    assert run.velocities[0, 0] == pytest.approx((1 - 0.25 * 10) / 1.5, rel=1e-12)


@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
def test_two_corners_at_once(restitution: float) -> None:
    """A box falls into a right-angled groove, both flanks flush: it comes back without turning."""
    scene = Scene(2, (0, 0))
    scene.add(
        Polygon.rectangle(1, 1), density=1.0, position=(0, 1.0), angle=pi / 4, velocity=(0, -1),
        restitution=restitution,
    )  # fmt: skip
    for normal in ((1, 1), (-1, 1)):
        scene.add(HalfSpace(normal, 0.0), friction=0.3, restitution=restitution)
    run = Simulation(scene, "acceleration", step=0.01)
    run.advance(0.5)
    after = np.array([*run.velocities[0], run.spins[0]])
    np.testing.assert_allclose(after, [0, restitution, 0], atol=1e-9)


def test_a_common_velocity_changes_nothing() -> None:
    """Galilei: grains, and the fixed slab they fall on, all with the same velocity."""
    ends = []
    for velocity in ((0.0, 0.0), (0.7, 0.3)):
        scene = Scene(2)
        for k in range(2):
            scene.add(
                Polygon.regular(5, 0.1), density=1.0, position=(0.25 * k, 0.13 + 0.02 * k),
                angle=0.3 * k, velocity=velocity, restitution=0.3,
            )  # fmt: skip
        scene.add(
            Polygon.rectangle(2, 0.1), fixed=True, position=(0, -0.05), velocity=velocity,
            friction=0.4, restitution=0.3,
        )  # fmt: skip
        run = Simulation(scene, "acceleration", step=0.01)
        run.advance(0.12)
        assert run.pace.collisions > 1
        ends.append(run.positions - 0.12 * np.array(velocity))
    np.testing.assert_allclose(ends[1], ends[0], atol=1e-9)


@pytest.mark.parametrize("quick", [{"spin": 1e9}, {"velocity": (1e9, 0)}])
def test_too_fast_to_be_followed(quick: dict[str, Any]) -> None:
    """A step a thousandth of a turn: it says so instead of going on for ever."""
    scene = Scene(2, (0, 0))
    scene.add(Polygon.regular(5, 0.1), density=1.0, **quick)
    with pytest.raises(NotConverged, match="more than 1e"):
        Simulation(scene, "acceleration").advance(1.0)


def test_a_rod_that_hits_with_its_tip_gains_no_energy() -> None:
    """Kane's paradox: eps on normal velocities with friction can make energy; here it may not."""
    generator, gained = np.random.default_rng(0), []
    for _ in range(12):
        scene = Scene(2, (0, 0))
        angle = 0.6 + 0.2 * generator.uniform(-1, 1)
        height = 0.5 * sin(angle) + 0.005 * cos(angle)
        scene.add(
            Polygon.rectangle(1, 0.01), density=1.0, position=(0, height + 1e-3), angle=angle,
            velocity=(generator.normal(), -1), spin=generator.normal(),
        )  # fmt: skip
        scene.add(FLOOR, friction=1.0, restitution=0.9)
        run = Simulation(scene, "acceleration", step=0.01)
        energy = run.energy
        run.advance(5e-3)
        if run.pace.collisions:
            gained.append(run.energy / energy - 1)
    assert len(gained) > 6
    assert max(gained) < 1e-11


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


@pytest.mark.parametrize("slides", [False, True])
def test_lasting_contacts_are_solved_at_once(slides: bool) -> None:
    """A redundant tower that presses: the dense solve obeys eqs 26, 27 as the pivots' does."""
    boxes = 2 if slides else 6  # a higher one would tip as it is slowed down
    problem = tower(boxes, 0.5)
    friction, offset = problem.friction.copy(), problem.offset
    slip = np.zeros((problem.contacts, 1))
    if slides:
        slip[:2], friction[:2] = 1.0, 0.2
    found = try_lasting_forces(tower_bodies(boxes), offset, friction, slip)
    assert found is not None
    assert found.residual < 1e-13
    r, u = found.r.reshape(-1, 2), (problem.delassus @ found.r + offset).reshape(-1, 2)
    rate = np.abs(offset).max()
    assert (np.abs(u[:, 0]) < 1e-12 * rate).all()
    assert (r[:, 0] > 0).all()
    at_limit = slip[:, 0] > 0
    assert r[at_limit, 1] == pytest.approx(-0.2 * r[at_limit, 0])
    assert (np.abs(u[~at_limit, 1]) < 1e-12 * rate).all()
    assert (np.abs(r[~at_limit, 1]) <= 0.5 * r[~at_limit, 0]).all()


def test_contacts_that_part_are_no_lasting_ones() -> None:
    """One that would have to pull: nothing is returned, and the general solver is asked."""
    problem, bodies = tower(3, 0.5), tower_bodies(3)
    lifted = problem.offset.copy()
    lifted[::2] = np.where(np.arange(problem.contacts) < 4, lifted[::2], 1.0)
    slip = np.zeros((problem.contacts, 1))
    assert try_lasting_forces(bodies, lifted, problem.friction, slip) is None
    found, error = find_forces(bodies, lifted, problem.friction, slip, 1e-12, 9.81)
    assert error < 1e-11
    assert (found.r[::2] == 0).any()
