"""Overlaps of grains and walls against plain NumPy, closed forms, and every pair tried."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from adapters.bed.container import Container, Walls
from adapters.bed.overlaps import (
    find_behind_discs,
    find_pairs,
    find_pairs_within,
    list_wall_names,
    measure_bed,
    measure_rows,
)
from adapters.bed.state import FloatArray
from adapters.errors import UsageError

QUARTER = Container("cylinder", ("x", "y"), radius=0.05)


def pairs_tried(position: FloatArray, radius: FloatArray, gap: float) -> set[tuple[int, int]]:
    """The twin of `find_pairs_within`: all pairs, one by one."""
    return {
        (i, j)
        for i in range(len(radius))
        for j in range(i + 1, len(radius))
        if np.linalg.norm(position[i] - position[j]) < radius[i] + radius[j] + gap
    }


def wall_overlap_twin(walls: Walls, x: FloatArray, radius: float) -> list[float]:
    """Overlap of one grain before every wall: radius less distance to the wall's nearest point."""
    overlaps = []
    rho = np.hypot(x[0], x[1])
    for point, normal, reach in zip(
        walls.plane_point, walls.plane_normal, walls.plane_reach, strict=True
    ):
        height = (x - point) @ normal
        beyond = max(rho - reach, 0.0) if np.isfinite(reach) else 0.0
        overlaps.append(radius - (np.hypot(beyond, height) if beyond else height))
    if np.isfinite(walls.cylinder_radius):
        overlaps.append(radius - (walls.cylinder_radius - rho))
    return overlaps


@settings(max_examples=40)
@given(seed=st.integers(0, 2**32 - 1), ratio=st.sampled_from([1.0, 1.5, 20.0]))
def test_pairs_are_exactly_the_near_ones(seed: int, ratio: float) -> None:
    """No pair is missed and none is made up, for equal radii and for radii of 1:20."""
    generator = np.random.default_rng(seed)
    n = int(generator.integers(1, 60))
    radius = 1e-3 * ratio ** generator.random(n)
    position = generator.random((n, 3)) * 0.02
    gap = float(generator.choice([0.0, 1e-3]))
    found = find_pairs_within(position, radius, gap)
    assert set(map(tuple, found.tolist())) == pairs_tried(position, radius, gap)
    assert len(found) == len(np.unique(found, axis=0))
    assert (found[:, 0] < found[:, 1]).all()


@settings(max_examples=40)
@given(seed=st.integers(0, 2**32 - 1))
def test_wall_overlaps_against_numpy(seed: int) -> None:
    """Floor, mirror planes, disc with its rim and cylinder, against distances written out."""
    generator = np.random.default_rng(seed)
    n = 30
    radius = generator.uniform(2e-3, 6e-3, n)
    position = generator.uniform(0.0, 0.05, (n, 3)) * [0.8, 0.8, 1.0]
    walls = QUARTER.walls(piston_height=0.052, piston_reach=0.03)
    rows = find_pairs(position, radius, walls, gap=0.2, behind=np.zeros((n, 4), bool))
    twin = np.array([wall_overlap_twin(walls, x, r) for x, r in zip(position, radius, strict=True)])
    wall = rows.second < 0
    assert wall.sum() == twin.size
    np.testing.assert_allclose(
        rows.overlap[wall], twin[rows.first[wall], -1 - rows.second[wall]], atol=1e-15
    )


def test_normals_are_gradients_of_the_overlap() -> None:
    """d delta/dx = -normal on the first grain and +normal on the second, by central differences."""
    generator = np.random.default_rng(3)
    radius = generator.uniform(2e-3, 6e-3, 12)
    position = generator.uniform(2e-3, 0.03, (12, 3))
    walls = QUARTER.walls(piston_height=0.033, piston_reach=0.02)
    behind = find_behind_discs(position, walls)
    rows = find_pairs(position, radius, walls, gap=0.05, behind=behind)
    step = 1e-7
    for c, (i, j) in enumerate(zip(rows.first, rows.second, strict=True)):
        for grain, sign in ((i, -1.0), (j, 1.0)):
            if grain < 0:
                continue
            slope = np.empty(3)
            for a in range(3):
                moved = [position.copy(), position.copy()]
                moved[0][grain, a] -= step
                moved[1][grain, a] += step
                low, high = (
                    measure_rows(
                        x, radius, rows.first[[c]], rows.second[[c]], walls, behind
                    ).overlap[0]
                    for x in moved
                )
                slope[a] = (high - low) / (2 * step)
            # second order of the difference: step^2/distance^3 * reach, below 1e-6 here
            np.testing.assert_allclose(slope, sign * rows.normal[c], atol=1e-6)


def test_two_touching_grains_on_the_floor() -> None:
    """Coordination number, penetration and height of two grains that overlap by known amounts."""
    radius = np.array([1e-3, 2e-3])
    x = np.array([[0.01, 0.01, 1e-3 - 1e-7], [0.01, 0.01, 4e-3 - 3e-7]])
    walls = QUARTER.walls()
    bed = measure_bed(x, find_pairs(x, radius, walls))
    assert bed.contacts == 2
    assert bed.coordination_number == 1.0
    assert bed.coordination_with_walls == 1.5
    assert bed.max_penetration == pytest.approx(2e-7, rel=1e-9)
    assert bed.mean_penetration == pytest.approx(1.5e-7, rel=1e-9)
    assert bed.mean_height == pytest.approx(x[:, 2].mean())


def test_coincident_centres_have_a_direction() -> None:
    """Two grains in one place overlap by the sum of radii and have a unit normal."""
    x = np.full((2, 3), 0.02)
    rows = find_pairs(x, np.array([1e-3, 2e-3]), QUARTER.walls())
    assert rows.overlap[rows.second >= 0] == pytest.approx([3e-3])
    np.testing.assert_allclose(np.linalg.norm(rows.normal, axis=1), 1.0)


def test_a_grain_stays_on_its_side_of_a_disc() -> None:
    """Behind a piston of finite reach a grain is pushed up, in front of it down; a half-space
    pushes it down from anywhere."""
    x, radius = np.array([[0.01, 0.01, 0.0305]]), np.array([1e-3])
    disc = QUARTER.walls(piston_height=0.03, piston_reach=0.02)
    above = find_pairs(x, radius, disc)
    assert above.normal[0].tolist() == [0, 0, 1]
    assert above.overlap[0] == pytest.approx(0.5e-3)
    pushed = find_pairs(x, radius, disc, behind=np.zeros((1, 4), bool))
    assert pushed.normal[0].tolist() == [0, 0, -1]
    assert pushed.overlap[0] == pytest.approx(1.5e-3)
    whole = find_pairs(x, radius, QUARTER.walls(piston_height=0.03))
    assert whole.overlap[0] == pytest.approx(1.5e-3)
    assert list_wall_names(disc) == ("floor", "symmetry_x", "symmetry_y", "piston", "cylinder")


@pytest.mark.parametrize(
    ("position", "radius"),
    [
        ([[0.0, 0.0, np.nan]], [1e-3]),
        ([[0.0, 0.0, np.inf]], [1e-3]),
        ([[0.0, 0.0, 0.0]], [0.0]),
        ([[0.0, 0.0, 0.0]], [np.nan]),
        ([[0.0, 0.0]], [1e-3]),
        ([[0.0, 0.0, 0.0]], [1e-3, 1e-3]),
    ],
)
def test_input_that_is_no_bed(position: list[list[float]], radius: list[float]) -> None:
    """NaN, infinity, radii that are not positive and shapes that differ raise `UsageError`."""
    with pytest.raises(UsageError):
        find_pairs(np.array(position), np.array(radius), QUARTER.walls())


def test_no_grain_at_all() -> None:
    """An empty bed has no rows and zero measures."""
    x = np.empty((0, 3))
    rows = find_pairs(x, np.empty(0), QUARTER.walls())
    assert len(rows) == 0
    assert measure_bed(x, rows).coordination_number == 0.0
