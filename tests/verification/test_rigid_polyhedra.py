"""Polyhedra: mass properties by other integrals, stones of their size, cuts that lose nothing."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull, Delaunay
from scipy.spatial.transform import Rotation

from rigid_lcp.errors import ShapeError
from rigid_lcp.motion.gyroscopic import Floats, angular_momentum
from rigid_lcp.shapes.polyhedron import Polyhedron, box
from rigid_lcp.shapes.rotations import rotate, unit_quaternion
from rigid_lcp.shapes.stones import ballast_stone, cut, fragments

seeds = st.integers(0, 10_000)


def stone(seed: int, corners: int = 16) -> Polyhedron:
    return ballast_stone(np.random.default_rng(seed), 0.05, corners)


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


@settings(max_examples=20, deadline=None)
@given(seeds)
def test_integrals_agree_with_a_triangulation(seed: int) -> None:
    shape = stone(seed)
    volume, centroid, inertia = by_delaunay(shape.vertices)
    # QJ joggles the points by about 1e-11 of the size
    assert shape.volume == pytest.approx(volume, rel=1e-9)
    assert np.abs(centroid).max() < 1e-9 * shape.reach
    assert np.allclose(shape.inertia, inertia, atol=1e-9 * np.trace(inertia))


def test_integrals_agree_with_monte_carlo() -> None:
    shape = stone(1)
    generator = np.random.default_rng(0)
    low, high = shape.vertices.min(axis=0), shape.vertices.max(axis=0)
    x = generator.uniform(low, high, (200_000, 3))
    inside = (x @ shape.normals.T <= shape.distances).all(axis=1)
    share = inside.mean()
    spread = np.sqrt(share * (1 - share) / len(x))
    assert abs(shape.volume / np.prod(high - low) - share) < 4 * spread
    second = np.prod(high - low) * (x[inside].T @ x[inside]) / len(x)
    inertia = np.trace(second) * np.eye(3) - second
    # 2e5 points: a share of 0.5 to 0.2 %, moments alike; four times that
    assert np.allclose(inertia, shape.inertia, atol=0.01 * np.trace(inertia))


def test_box_and_tetrahedron_in_closed_form() -> None:
    cuboid = box(1.0, 2.0, 3.0)
    assert cuboid.volume == pytest.approx(6.0, rel=1e-15)
    assert np.allclose(cuboid.inertia, 6.0 / 12 * np.diag([13.0, 10.0, 5.0]), rtol=1e-14)
    # Regular tetrahedron of edge a: V = a^3 / 6 sqrt(2), I = m a^2 / 20
    corners = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) / 8**0.5
    regular = Polyhedron(corners)
    assert regular.volume == pytest.approx(1 / (6 * 2**0.5), rel=1e-14)
    assert np.allclose(regular.inertia, regular.volume / 20 * np.eye(3), atol=1e-16)


@settings(max_examples=20, deadline=None)
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


@settings(max_examples=30, deadline=None)
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


def test_stone_has_its_size_and_is_repeatable() -> None:
    shape = stone(3)
    assert 0.03 < 2 * shape.reach < 0.05 * 1.3
    assert np.array_equal(shape.vertices, stone(3).vertices)


# --- cuts ---


@settings(max_examples=40, deadline=None)
@given(seeds, st.floats(-0.6, 0.6))
def test_a_cut_conserves_mass_momentum_and_energy(seed: int, place: float) -> None:
    shape, generator = stone(seed), np.random.default_rng(seed)
    position, velocity, spin, normal = generator.normal(size=(4, 3))
    quaternion = unit_quaternion(generator.normal(size=4))
    point = position + place * shape.width * normal / np.linalg.norm(normal) / 2
    parts = fragments(shape, position, quaternion, velocity, spin, normal, point)
    density = 2700.0
    mass, inertia = shape.mass_properties(density)

    def moments(m: float, tensor: Floats, x: Floats, v: Floats) -> Floats:
        turning = angular_momentum(tensor, quaternion, spin)
        energy = 0.5 * m * v @ v + 0.5 * spin @ turning
        return np.concatenate([[m], m * x, m * v, m * np.cross(x, v) + turning, [energy]])

    whole = moments(mass, inertia, position, velocity)
    sum_of_parts = sum(
        moments(*part.shape.mass_properties(density), part.position, part.velocity)
        for part in parts
    )
    assert np.allclose(sum_of_parts, whole, rtol=0, atol=1e-13 * np.abs(whole).max())
    for part in parts:  # parts stay where they were
        corners = part.position + rotate(quaternion, part.shape.vertices)
        back = rotate(quaternion * [1, -1, -1, -1], corners - position)
        assert (back @ shape.normals.T <= shape.distances + 1e-12).all()


def test_a_cut_through_corners_makes_no_slivers() -> None:
    cuboid = box(1.0, 1.0, 1.0)
    for offset in (0.0, 1e-9, -1e-8, 1e-7):
        parts = cut(cuboid, [1.0, 1.0, 0.0], offset)  # through two edges: two prisms
        assert [len(part.faces) for part in parts] == [5, 5]
        assert parts[0].volume + parts[1].volume == pytest.approx(1.0, rel=1e-14)


def test_a_stone_can_be_cut_again_and_again() -> None:
    generator = np.random.default_rng(4)
    pieces = [stone(4)]
    whole = pieces[0].volume
    for _ in range(6):
        pieces = [part for piece in pieces for part in cut(piece, generator.normal(size=3), 0.0)]
    assert len(pieces) == 64
    assert sum(piece.volume for piece in pieces) == pytest.approx(whole, rel=1e-12)
    assert all(len(p.vertices) - len(p.edges) + len(p.faces) == 2 for p in pieces)


@pytest.mark.parametrize("offset", [0.6, 0.5, -0.5, 0.4999999])
def test_a_plane_that_misses_is_refused(offset: float) -> None:
    with pytest.raises(ShapeError, match="does not cut"):
        cut(box(1.0, 1.0, 1.0), [1.0, 0.0, 0.0], offset)


def test_a_plane_without_normal_is_refused() -> None:
    with pytest.raises(ShapeError, match="normal"):
        cut(box(1.0, 1.0, 1.0), [0.0, 0.0, 0.0], 0.0)


def test_a_stone_of_no_size_is_refused() -> None:
    with pytest.raises(ShapeError, match="stone"):
        ballast_stone(np.random.default_rng(0), -1.0)
