"""Strength of a grain: closed forms of the stresses, where it splits, what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from rigid_lcp.wear.breakage import (
    find_mean_stress,
    find_opposite_pair,
    find_splitting_line,
    find_tension,
)

RADIUS, THICKNESS = 0.02, 0.03
VOLUME = np.pi * RADIUS**2 * THICKNESS


def radial(angles, pushes):
    """Forces towards the centre of a disc, their points and vectors."""
    outward = np.column_stack([np.cos(angles), np.sin(angles)])
    return RADIUS * outward, -np.asarray(pushes)[:, None] * outward


@pytest.mark.parametrize("turn", [0.0, 0.4, 2.0])
def test_brazilian_disc(turn):
    """2 P / (pi D t) across the diameter, whatever its direction, at any place."""
    points, forces = radial(turn + np.array([0, np.pi]), [500.0, 500.0])
    centre = np.array([3.0, -2.0])
    tension = find_tension(find_mean_stress(points + centre, forces, centre, VOLUME))
    assert tension == pytest.approx(2 * 500 / (np.pi * 2 * RADIUS * THICKNESS), rel=1e-12)


def test_mean_stress_of_even_pressure():
    """Pressure p all around: -p I, and no tension; n forces p 2 pi R t / n."""
    pressure, n = 2e5, 12
    push = pressure * 2 * np.pi * RADIUS * THICKNESS / n
    stress = find_mean_stress(*radial(2 * np.pi * np.arange(n) / n, n * [push]), (0, 0), VOLUME)
    assert stress == pytest.approx(-pressure * np.eye(2), rel=1e-12, abs=1e-9 * pressure)
    assert find_tension(stress) == pytest.approx(-pressure, rel=1e-12)


def test_stress_at_the_centre_of_a_disc_by_flamant():
    """S = sum P [I / (2 pi R t) - 2 n n / (pi R t)], written out, for three unequal forces."""
    angles = np.array([0.1, 2.3, 4.0])
    outward = np.column_stack([np.cos(angles), np.sin(angles)])
    # pushes of three directions in balance: the null vector of their directions
    pushes = np.linalg.svd(outward.T)[2][-1]
    pushes *= 300 / np.abs(pushes).max() * np.sign(pushes[0])
    assert (pushes > 0).all()
    points, forces = radial(angles, pushes)
    at_centre = sum(
        p * (np.eye(2) / 2 - 2 * np.outer(n, n)) / (np.pi * RADIUS * THICKNESS)
        for p, n in zip(pushes, outward, strict=True)
    )
    greatest = np.linalg.eigvalsh(at_centre)[-1]
    tension = find_tension(find_mean_stress(points, forces, (0, 0), VOLUME))
    assert tension == pytest.approx(greatest, rel=1e-12)


def test_mean_stress_of_a_bar():
    """F / A in a bar under tension in 3D, and nothing across."""
    points = np.array([[0.5, 0, 0], [-0.5, 0, 0]])
    stress = find_mean_stress(points, 20 * points, np.zeros(3), 1.0 * 0.02)
    assert stress[0, 0] == pytest.approx(10 / 0.02)
    assert np.abs(stress).sum() == pytest.approx(10 / 0.02)


def test_greatest_pair_and_line():
    """Two weak and two strong opposite pushes: the crack runs through the strong ones."""
    points, forces = radial(np.array([0, np.pi, 1.2, 1.2 + np.pi]), [50, 50, 700, 690.0])
    i, j, squeeze = find_opposite_pair(points, forces)
    assert (i, j) == (2, 3)
    assert squeeze == pytest.approx(690)
    split = find_splitting_line(points, forces, (0, 0), VOLUME, strength=1e4)
    assert split.point == pytest.approx([0, 0], abs=1e-15)
    assert abs(split.direction @ [np.cos(1.2), np.sin(1.2)]) == pytest.approx(1)
    # just below and just above its tension: it breaks or holds
    for share, breaks in ((1 - 1e-12, True), (1 + 1e-12, False)):
        found = find_splitting_line(points, forces, (0, 0), VOLUME, split.tension * share)
        assert (found is not None) is breaks


def test_point_load_in_3d():
    """F / d^2, Jaeger."""
    points = np.array([[0, 0, 0.025], [0, 0, -0.025]])
    forces = np.array([[0, 0, -900.0], [0, 0, 900.0]])
    split = find_splitting_line(points, forces, (0, 0, 0), 6e-5, 1e5)
    assert split.tension == pytest.approx(900 / 0.05**2)


def test_no_pair_no_break():
    """A grain pulled apart, a grain with one contact, and one with none."""
    points, forces = radial(np.array([0, np.pi]), [-5.0, -5.0])
    assert find_opposite_pair(points, forces) is None
    assert find_splitting_line(points[:1], -forces[:1], (0, 0), VOLUME, 1.0) is None
    assert find_splitting_line(np.zeros((0, 2)), np.zeros((0, 2)), (0, 0), VOLUME, 1.0) is None
    assert find_opposite_pair(np.zeros((2, 2)), np.array([[1, 0], [-1, 0]])) is None


def test_forces_that_only_turn_a_grain_put_no_stress_in_it():
    """Equal forces along the rim, all one way round: a couple, which spins the grain up.  Stress is
    symmetric, so a couple adds nothing to it, and a pressed grain breaks as without one."""
    angles = np.arange(4) * np.pi / 2
    points, pressed = radial(angles, [500.0, 0.0, 500.0, 0.0])
    along = 80.0 * np.column_stack([-np.sin(angles), np.cos(angles)])
    still = find_mean_stress(points, pressed, np.zeros(2), VOLUME)
    spun = find_mean_stress(points, pressed + along, np.zeros(2), VOLUME)
    scale = np.abs(still).max()
    np.testing.assert_allclose(spun, still, atol=1e-15 * scale)
    np.testing.assert_allclose(
        find_mean_stress(points, along, np.zeros(2), VOLUME), 0.0, atol=1e-15 * scale
    )
    assert find_tension(spun) == pytest.approx(find_tension(still), rel=1e-14)
