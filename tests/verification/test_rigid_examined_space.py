"""Two laws in space that once held in the plane only: Coulomb's threshold, and energy at e = 1."""

from __future__ import annotations

from math import cos, hypot, radians, sin, tan

import numpy as np
import pytest

import rigid_lcp as r

GRAVITY, STEP = 9.81, 1e-3


@pytest.mark.parametrize("excess", [-1e-9, 0.0, 1e-9])
def test_threshold_of_a_block_that_is_pulled_across_its_tangents(excess: float) -> None:
    """``s = g (sin a - mu cos a) t^2 / 2`` at mu = (1 + excess) tan a, else rest.

    Friction directions that are off by delta at the four contacts leave ``|u_T| delta`` in the
    natural map and take ``delta^2 / 2`` from the net force: 1e-9 of it wants all of round-off.
    Bars: 1 % of the slide, 1e-12 m at rest.
    """
    slope, heading, steps = radians(20.0), 0.9273, 50
    friction = tan(slope) * (1.0 + excess)
    pull = GRAVITY * sin(slope)
    scene = r.Scene(
        dim=3, gravity=(pull * cos(heading), pull * sin(heading), -GRAVITY * cos(slope))
    )
    scene.add(r.HalfSpace((0.0, 0.0, 1.0)), friction=friction)
    block = scene.add(r.box(0.3, 0.2, 0.1), density=2000, position=(0, 0, 0.05), friction=friction)
    run = r.Simulation(scene, step=STEP)
    run.advance(steps * STEP)
    slide = hypot(*run.positions[block, :2])
    fall = max(0.0, GRAVITY * (sin(slope) - friction * cos(slope)))
    wanted = fall * (steps * STEP) ** 2 / 2
    assert abs(slide - wanted) <= (0.01 * wanted if wanted else 1e-12)


def test_boxes_that_tumble_in_a_closed_box_keep_their_energy() -> None:
    """Without friction and gravity, with restitution 1, the kinetic energy stays.

    200 steps of 8 boxes, a round-off of 1e-15 each in every box: 1.6e-12.
    """
    generator = np.random.default_rng(0)
    scene = r.Scene(dim=3, gravity=(0.0, 0.0, 0.0))
    for normal in np.vstack([np.eye(3), -np.eye(3)]):
        scene.add(r.HalfSpace(normal, -0.3), restitution=1.0)
    for corner in np.indices((2, 2, 2)).reshape(3, -1).T - 0.5:
        scene.add(
            r.box(0.1, 0.06, 0.05), density=1000, position=0.25 * corner, restitution=1.0,
            velocity=generator.normal(size=3), spin=3.0 * generator.normal(size=3),
            angle=generator.normal(size=4),
        )  # fmt: skip
    run = r.Simulation(scene, step=STEP)
    start = run.energy
    met = 0
    for _ in range(200):
        run.advance(STEP)
        met += int((run.contacts.normal_force > 0).any())
        assert abs(run.energy / start - 1.0) <= 1.6e-12
    assert met > 10  # they did collide
