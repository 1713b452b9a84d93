"""Shapes in space: what a polyhedron keeps of its points, and what it refuses."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from rigid_lcp import Polyhedron, Sphere, make_box
from rigid_lcp.errors import ShapeError


def test_faces_of_a_box_are_rectangles() -> None:
    cuboid = make_box(1.0, 2.0, 3.0)
    assert len(cuboid.vertices) == 8
    assert [len(face) for face in cuboid.faces] == [4] * 6
    assert len(cuboid.edges) == 12
    assert np.allclose(np.sort(cuboid.distances), [0.5, 0.5, 1.0, 1.0, 1.5, 1.5])
    assert cuboid.width == pytest.approx(1.0)
    assert cuboid.reach == pytest.approx(14**0.5 / 2)


def test_points_are_kept_about_the_centre_of_mass() -> None:
    moved = Polyhedron(make_box(1.0, 2.0, 3.0).vertices + np.array([5.0, 6.0, 7.0]))
    assert np.allclose(moved.centroid, [5.0, 6.0, 7.0])
    assert np.allclose(np.sort(moved.vertices, axis=0), np.sort(make_box(1, 2, 3).vertices, axis=0))


def test_points_inside_faces_edges_and_hull_are_dropped() -> None:
    extra = [[0.0, 0.0, 0.0], [0.5, 0.1, 0.2], [0.5, 0.5, 0.1]]
    cuboid = Polyhedron(np.vstack([make_box(1.0, 1.0, 1.0).vertices, extra]))
    assert [len(face) for face in cuboid.faces] == [4] * 6
    assert len(cuboid.edges) == 12


def test_faces_flat_to_round_off_are_one() -> None:
    """A prism of 100 sides, turned: its ends are one face each, not 98 triangles."""
    angle = 2 * np.pi * np.arange(100) / 100
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    points = np.vstack([np.column_stack([ring, np.full(100, z)]) for z in (0.0, 1.0)])
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    prism = Polyhedron(points @ turn)
    assert sorted(len(face) for face in prism.faces) == [4] * 100 + [100, 100]


@pytest.mark.parametrize("unit", [1e-6, 1e6])
def test_size_does_not_matter(unit: float) -> None:
    assert [len(face) for face in make_box(unit, 2 * unit, 3 * unit).faces] == [4] * 6


def test_mass_follows_density() -> None:
    mass, inertia = Sphere(0.5).mass_properties(3.0)
    assert mass == pytest.approx(3.0 * np.pi / 6)
    assert np.allclose(inertia, 0.4 * mass * 0.25 * np.eye(3))
    mass, inertia = make_box(1.0, 1.0, 1.0).mass_properties(6.0)
    assert mass == pytest.approx(6.0)
    assert np.allclose(inertia, np.eye(3))


@pytest.mark.parametrize(
    "points",
    [
        np.zeros((3, 3)),
        np.zeros((5, 3)),
        np.random.default_rng(0).random((6, 3)) * [1, 1, 0],
        np.full((4, 3), np.nan),
        np.eye(4),
    ],
)
def test_points_that_span_no_volume_are_refused(points: np.ndarray) -> None:
    with pytest.raises(ShapeError) as refused:
        Polyhedron(points)
    assert refused.value.remedy


@pytest.mark.parametrize(
    "make",
    [
        *(lambda r=r: Sphere(r) for r in ("a", -1.0, 0.0, np.nan, np.inf)),
        lambda: Polyhedron("abc"),
        lambda: Polyhedron([[0, 0, 0], [1, 0], [0, 1, 0], [0, 0, 1]]),
        lambda: make_box(-1.0, -1.0, 1.0), lambda: make_box(1e-120, 1e-120, 1e-120),
        lambda: Polyhedron(1e-120 * np.eye(4, 3)),
    ],
)  # fmt: skip
def test_what_is_no_size_is_refused(make: Callable[[], object]) -> None:
    with pytest.raises(ShapeError):
        make()


@pytest.mark.parametrize("high", [1e-13, 1e-10])
def test_flatter_than_faces_can_be_distinguished_is_flat(high: float) -> None:
    with pytest.raises(ShapeError, match="in a plane"):
        Polyhedron([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.3, 0.3, high]])
    with pytest.raises(ShapeError, match="in a plane"):  # and no warning before it
        make_box(1.0, 1.0, high)


def test_a_shape_of_corners_is_made_again_to_the_last_bit() -> None:
    stone = Polyhedron.from_corners(
        Polyhedron(np.random.default_rng(3).normal(size=(20, 3))).vertices
    )
    again = Polyhedron.from_corners(stone.vertices)
    assert np.array_equal(again.vertices, stone.vertices)
    assert np.array_equal(again.normals, stone.normals)
    assert np.array_equal(again.inertia, stone.inertia)
    assert np.linalg.norm(stone.centroid) < 1e-15
