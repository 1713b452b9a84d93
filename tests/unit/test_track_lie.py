"""Measures of how ballast lies: towers are counted, heaps are not; how much is solid."""

from __future__ import annotations

import numpy as np
import pytest

from validation.track_lie import GRAIN, measures_of, solid_share, standing_alone

CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * 0.015


def cube(*centre: float) -> np.ndarray:
    """Its corners, (8, 3)."""
    return CORNERS + np.array(centre)


def layer(side: int, slope: float = 0.0) -> list[np.ndarray]:
    """Cubes, a grain apart in plan, side by side on a plane that rises along x."""
    places = [(GRAIN * i, GRAIN * j, slope * GRAIN * i) for i in range(side) for j in range(side)]
    return [CORNERS + place for place in places]


@pytest.mark.parametrize("slope", [0.0, 0.5])
@pytest.mark.parametrize("grains", [0, 1, 2, 4])
def test_a_column_stands_alone_by_all_but_its_lowest(grains: int, slope: float) -> None:
    """Grains a grain apart upwards: each is counted that is .6 of a grain above its neighbours; on
    a slope of one in two the lowest is below those uphill."""
    heap = layer(9, slope)
    column = [CORNERS + heap[40].mean(axis=0) + [0, 0, GRAIN * (k + 1)] for k in range(grains)]
    found = standing_alone(heap + column)
    hidden = int(np.ceil((0.6 + 2 * slope) - 1e-9)) - 1  # two grains uphill are still near
    assert found.tolist() == list(range(81 + hidden, 81 + grains))


def test_a_column_beside_one_of_its_height_hides_it_also_across_the_period() -> None:
    """Two columns .1 m apart are no towers each; the period makes neighbours of the far sides."""
    heap = layer(12)
    low = [cube(0.25, 0.0, GRAIN * k) for k in (1, 2)]
    other = [cube(0.25, 0.52, GRAIN * k) for k in (1, 2)]
    assert len(standing_alone(heap + low + other)) == 4
    assert len(standing_alone(heap + low + other, width=0.6)) == 0


def test_a_lone_grain_stands_on_nothing() -> None:
    """No ring, no tower."""
    assert len(standing_alone([CORNERS])) == 0


def test_solid_share_of_a_cubic_lattice() -> None:
    """Spheres that touch on a cubic lattice fill pi/6, also where the box crosses the period."""
    radius = 0.012
    places = (
        2 * radius * np.array([[i, j, k] for i in range(5) for j in range(5) for k in range(5)])
    )
    box = np.array([[0, -0.5, 0], [4, 2.5, 4]]) * 2 * radius
    share = solid_share([places], radius, box, width=5 * 2 * radius)
    assert share == pytest.approx(np.pi / 6, abs=4 * 0.5 / np.sqrt(200_000))


def test_measures_of_a_slab() -> None:
    """A flat layer: its height over the ground, its length with the spheres."""
    lift = np.array([0, 0, 0.027])
    slab = [nodes + lift for nodes in layer(9)]
    found = measures_of(slab, 0.012)
    assert found["height"] == pytest.approx(0.027 + 0.015 + 0.012)
    assert found["foot"] == pytest.approx(8 * GRAIN + 0.03 + 0.024)
    assert found["top"] == pytest.approx(8 * GRAIN + 0.03)
