"""Hard geometry in space: needles, plates, slivers, coincident features; distances as coal's."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigid_lcp.rotations import quaternion_of_rotation, rotate, rotation_matrix
from rigid_lcp.shapes_3d import Polyhedron, box
from tests.rigid_solids import CUBE, FLOOR, UPRIGHT, contacts, near_pair


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10_000))
def test_least_gap_is_the_distance_that_coal_finds(seed: int) -> None:
    coal = pytest.importorskip("coal")
    shapes, position, quaternion = near_pair(seed, gap=1e-3)
    hulls, places = [], []
    for shape, x, turn in zip(shapes, position, rotation_matrix(quaternion), strict=True):
        assert isinstance(shape, Polyhedron)
        points = coal.StdVec_Vec3s()
        for corner in shape.vertices:
            points.append(corner)
        hulls.append(coal.Convex.convexHull(points, False, "Qt"))
        places.append(coal.Transform3s(turn, x))
    result = coal.DistanceResult()
    coal.distance(hulls[0], places[0], hulls[1], places[1], coal.DistanceRequest(), result)
    found = contacts(shapes, position, quaternion)
    # GJK's tolerance is 1e-6; corners that meet corners have a longer distance than gap
    assert result.min_distance > found.gap.min() - 2e-6
    if len(found) and np.linalg.norm(result.normal - found.normal[0]) < 1e-3:
        assert result.min_distance == pytest.approx(found.gap.min(), abs=2e-6)


def test_needles_touch_where_they_cross() -> None:
    """Bars a thousand times longer than thick, at any angle to each other."""
    needle = box(1.0, 1e-3, 1e-3)
    for angle in (1e-3, 0.1, 1.0, np.pi / 2):
        turned = quaternion_of_rotation([0.0, 0.0, angle])
        found = contacts([needle, needle], [[0, 0, 0], [0, 0, 1e-3]], [UPRIGHT, turned], 1e-6)
        assert 2 <= len(found) <= 4
        assert np.allclose(found.gap, 0.0, atol=1e-16)
        assert np.allclose(np.abs(found.normal), [0, 0, 1], atol=1e-12)
        if angle > 2e-3:  # the rhombus of the overlap: its far corners, sin and cos of half angle
            reach = 0.5e-3 * np.array([1 / np.sin(angle / 2), 1 / np.cos(angle / 2)])
            extent = np.linalg.norm(found.point[:, :2], axis=1)
            assert np.allclose(np.unique(np.round(extent, 9)), np.unique(np.round(reach, 9)))


@pytest.mark.parametrize("overlap", [0.0, 1e-6])
def test_coincident_edges(overlap: float) -> None:
    """Cubes edge upon edge: contacts at the ends of the edge, with finite normals; once they
    overlap, at the corners of the sliver that their faces share."""
    tilted = quaternion_of_rotation([np.pi / 4, 0, 0])
    found = contacts([CUBE, CUBE], [[0, 0, 0], [0, 0, 2**0.5 - overlap]], [tilted, tilted])
    assert len(found) == (4 if overlap else 2)
    assert np.allclose(np.abs(found.point[:, 0]), 0.5)
    assert np.allclose(np.linalg.norm(found.normal, axis=1), 1.0)
    assert np.allclose(found.gap, -overlap / 2**0.5, atol=1e-15)


def test_cubes_beside_each_other_touch_face_to_face() -> None:
    found = contacts([CUBE, CUBE], [[0, 0, 0], [1.0, 0, 0]])
    assert len(found) == 4
    assert np.allclose(np.abs(found.normal), [1, 0, 0])


def test_a_box_passes_a_box_that_it_just_misses() -> None:
    """A box that falls along another's side, a hair away, finds nothing to stand on."""
    found = contacts([CUBE, CUBE], [[0, 0, 0], [1.0 + 1e-4, 0, 0.9995]])
    assert np.allclose(np.abs(found.normal), [1, 0, 0])


def test_deep_overlap_leaves_by_the_nearest_face() -> None:
    found = contacts([CUBE, CUBE], [[0, 0, 0], [0.05, 0.02, 0.9]])
    assert np.allclose(found.gap, -0.1, atol=1e-15)
    assert np.allclose(np.abs(found.normal), [0, 0, 1])


def test_many_sided_grains_keep_four_contacts_and_the_deepest() -> None:
    angle = 2 * np.pi * np.arange(30) / 30
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    drum = Polyhedron(np.vstack([np.column_stack([ring, np.full(30, z)]) for z in (-0.5, 0.5)]))
    tilt = quaternion_of_rotation([1e-3, 0.0, 0.0])
    for shapes, places in (
        ([drum, FLOOR], [[0, 0, 0.5], [0, 0, 0]]),
        ([drum, box(4.0, 4.0, 1.0)], [[0, 0, 0.5], [0, 0, -0.5]]),
    ):
        found = contacts(shapes, places, [tilt, UPRIGHT], margin=0.1)
        assert len(found) == 4
        lowest = rotate(tilt, drum.vertices)[:, 2].min() + 0.5
        assert found.gap.min() == pytest.approx(lowest, abs=1e-15)
        assert np.ptp(found.point[:, 0]) > 1.9
        assert np.ptp(found.point[:, 1]) > 1.9
