"""Polyhedra: mass properties by other integrals, faces and edges."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull, Delaunay
from scipy.spatial.transform import Rotation

from rigid_lcp import Polyhedron, make_box
from rigid_lcp.shapes.polyhedron import Floats
from tests.rigid_solids import make_stone

seeds = st.integers(0, 10_000)


def stone(seed: int, corners: int = 16) -> Polyhedron:
    return make_stone(np.random.default_rng(seed), 0.05, corners)


def by_delaunay(points: Floats) -> tuple[float, Floats, Floats]:
    """Volume, centroid, inertia over density, summed over the tetrahedra of a triangulation.

    Inertia of a tetrahedron about its own centroid: sum of x x^T over its corners / 20 volumes.
    """
    tetrahedra = points[Delaunay(points, qhull_options="QJ").simplices]
    edges = tetrahedra[:, 1:] - tetrahedra[:, :1]
    volumes = np.abs(np.linalg.det(edges)) / 6
    middles = tetrahedra.mean(axis=1)
    volume = float(volumes.sum())
    centroid = volumes @ middles / volume
    own = tetrahedra - middles[:, None]
    second = np.einsum("t,tci,tcj->ij", volumes / 20, own, own)
    away = middles - centroid
    second += np.einsum("t,ti,tj->ij", volumes, away, away)
    return volume, centroid, np.trace(second) * np.eye(3) - second


@settings(max_examples=20)
@given(seeds)
def test_integrals_agree_with_a_triangulation(seed: int) -> None:
    shape = stone(seed)
    volume, centroid, inertia = by_delaunay(shape.vertices)
    # QJ joggles the points by about 1e-11 of the size
    assert shape.volume == pytest.approx(volume, rel=1e-9)
    assert np.abs(centroid).max() < 1e-9 * shape.reach
    assert np.allclose(shape.inertia, inertia, atol=1e-9 * np.trace(inertia))


def test_box_and_tetrahedron_in_closed_form() -> None:
    cuboid = make_box(1.0, 2.0, 3.0)
    assert cuboid.volume == pytest.approx(6.0, rel=1e-15)
    assert np.allclose(cuboid.inertia, 6.0 / 12 * np.diag([13.0, 10.0, 5.0]), rtol=1e-14)
    # Regular tetrahedron of edge a: V = a^3 / 6 sqrt(2), I = m a^2 / 20
    corners = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) / 8**0.5
    regular = Polyhedron(corners)
    assert regular.volume == pytest.approx(1 / (6 * 2**0.5), rel=1e-14)
    assert np.allclose(regular.inertia, regular.volume / 20 * np.eye(3), atol=1e-16)


@settings(max_examples=20)
@given(seeds, st.floats(1e-3, 1e3))
def test_mass_properties_move_and_scale_with_the_points(seed: int, unit: float) -> None:
    """I' = R I R^T; V scales with the cube and I with the fifth power of the unit of length."""
    shape = stone(seed)
    turn = Rotation.random(rng=np.random.default_rng(seed)).as_matrix()
    moved = Polyhedron(unit * (shape.vertices @ turn.T + [0.1, -0.2, 0.3]))
    assert moved.volume == pytest.approx(unit**3 * shape.volume, rel=1e-11)
    wanted = unit**5 * turn @ shape.inertia @ turn.T
    assert np.allclose(moved.inertia, wanted, atol=1e-11 * np.trace(wanted))
    assert np.allclose(moved.centroid, unit * np.array([0.1, -0.2, 0.3]), rtol=1e-11)


@settings(max_examples=30)
@given(seeds, st.integers(4, 40))
def test_faces_edges_and_corners_are_a_polyhedron(seed: int, corners: int) -> None:
    """Euler's formula, all corners under all faces, faces anticlockwise from outside."""
    shape = stone(seed, corners)
    assert len(shape.vertices) - len(shape.edges) + len(shape.faces) == 2
    assert (shape.vertices @ shape.normals.T <= shape.distances + 1e-12 * shape.reach).all()
    for loop, normal in zip(shape.faces, shape.normals, strict=True):
        p = shape.vertices[loop]
        assert np.cross(p[1] - p[0], p[2] - p[1]) @ normal > 0
    assert shape.volume == pytest.approx(float(ConvexHull(shape.vertices).volume), rel=1e-12)
