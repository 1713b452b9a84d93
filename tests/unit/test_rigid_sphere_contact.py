"""Contacts of spheres in space: with boxes, planes and each other, in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from rigid_lcp.shapes.sphere import Sphere
from tests.rigid_solids import CUBE, FLOOR, contacts


@pytest.mark.parametrize(
    ("centre", "normal", "radius_b"),
    [
        ([0.1, 0.2, 0.8], [0, 0, 1], np.inf),  # over a face
        ([0.7, 0.1, 0.7], [2**-0.5, 0, 2**-0.5], 0.0),  # over an edge
        ([0.6, 0.6, 0.6], [3**-0.5] * 3, 0.0),  # over a corner
        ([0.1, 0.0, 0.4], [0, 0, 1], np.inf),  # centre inside
    ],
)
def test_sphere_on_box(centre: list[float], normal: list[float], radius_b: float) -> None:
    nearest = np.clip(centre, -0.5, 0.5)
    distance = np.linalg.norm(centre - nearest) if max(centre) > 0.5 else centre[2] - 0.5
    found = contacts([CUBE, Sphere(0.3)], [[0, 0, 0], centre], margin=0.5)
    assert (found.body_a[0], found.body_b[0]) == (1, 0)
    assert np.allclose(found.normal[0], normal, atol=1e-15)
    assert found.gap[0] == pytest.approx(distance - 0.3, abs=1e-15)
    assert np.allclose(found.point[0], np.array(centre) - 0.3 * found.normal[0])
    assert (found.radius_a[0], found.radius_b[0]) == (0.3, radius_b)


def test_spheres_and_floor() -> None:
    """Eq. 8, and a sphere over a plane."""
    shapes = [Sphere(0.5), Sphere(0.25), FLOOR]
    found = contacts(shapes, [[0, 0, 0.5], [0.45, 0.6, 0.5], [0, 0, 0]])
    assert list(zip(found.body_a.tolist(), found.body_b.tolist(), strict=True)) == [(0, 1), (0, 2)]
    assert np.allclose(found.gap, [0.0, 0.0], atol=1e-15)
    assert np.allclose(found.normal, [[-0.6, -0.8, 0.0], [0.0, 0.0, 1.0]])
    assert found.radius_b.tolist() == [0.25, np.inf]


def test_spheres_in_one_place_part_along_z() -> None:
    found = contacts([Sphere(0.5), Sphere(0.5)], np.zeros((2, 3)))
    assert np.array_equal(found.normal, [[0.0, 0.0, 1.0]])
    assert found.gap[0] == -1.0
