"""Contacts in space: closed forms of faces and edges, symmetries, names, the broad phase."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigid_lcp import Disc, HalfSpace, Polyhedron, Sphere, make_box
from rigid_lcp.contact.manifold import MOST_KEPT
from rigid_lcp.contact.near_pairs import bound_shapes, find_near_pairs
from rigid_lcp.contact.placed_solids import pack_shapes_3d, place_solids
from rigid_lcp.errors import SceneError
from rigid_lcp.shapes.rotations import make_quaternion, multiply_quaternions, normalise, rotate
from tests.rigid_solids import CUBE, FLOOR, UPRIGHT, contacts, make_stone, near_pair, sort_points

# --- closed forms ---


def test_box_on_floor_has_its_four_corners() -> None:
    found = contacts([CUBE, FLOOR], [[0, 0, 0.5 + 1e-4], [0, 0, 0]])
    assert found.body_a.tolist() == [0] * 4
    assert found.body_b.tolist() == [1] * 4
    assert np.allclose(found.gap, 1e-4, atol=1e-16)
    assert np.array_equal(found.normal, np.tile([0.0, 0.0, 1.0], (4, 1)))
    corners = [[-0.5, -0.5], [0.5, -0.5], [-0.5, 0.5], [0.5, 0.5]]
    assert np.allclose(sort_points(found)[:, :2], corners)
    assert (found.radius_a == 0).all()
    assert np.isinf(found.radius_b).all()


@pytest.mark.parametrize("gap", [1e-4, 0.0, -1e-4, 1e-12])
def test_box_on_box_has_the_corners_of_the_overlap(gap: float) -> None:
    found = contacts([CUBE, CUBE], [[0, 0, 0], [0.3, 0.2, 1.0 + gap]])
    wanted = [[-0.2, -0.3], [0.5, -0.3], [-0.2, 0.5], [0.5, 0.5]]
    assert np.allclose(sort_points(found)[:, :2], wanted, atol=1e-15)
    assert np.allclose(found.gap, gap, atol=1e-15)
    up = np.where(found.body_a == 1, 1.0, -1.0)
    assert np.allclose(found.normal, up[:, None] * [0.0, 0.0, 1.0], atol=1e-15)


@pytest.mark.parametrize("shift", [0.0, 1e-14, 1e-10, 1e-7, 1e-5])
def test_aligned_boxes_have_four_contacts_whatever_the_round_off(shift: float) -> None:
    found = contacts([CUBE, CUBE], [[0, 0, 0], [shift, -shift, 1.0]])
    assert len(found) == 4
    assert np.allclose(np.abs(found.point[:, :2]), 0.5, atol=2 * shift + 1e-15)


def test_crossed_bars_share_a_square() -> None:
    """A bar across another: all four contacts are crossings of edges."""
    bar = make_box(3.0, 1.0, 1.0)
    across = make_quaternion([0.0, 0.0, np.pi / 2])
    found = contacts([bar, bar], [[0, 0, 0], [0, 0, 1.0]], [UPRIGHT, across])
    wanted = [[-0.5, -0.5], [0.5, -0.5], [-0.5, 0.5], [0.5, 0.5]]
    assert np.allclose(sort_points(found)[:, :2], wanted, atol=1e-15)


def test_a_shared_octagon_keeps_its_corners() -> None:
    """Cubes turned by 45 degrees share a regular octagon, over all of which they may bear."""
    turned = make_quaternion([0.0, 0.0, np.pi / 4])
    found = contacts([CUBE, CUBE], [[0, 0, 0], [0, 0, 1.0]], [UPRIGHT, turned])
    radius = 0.5 / np.cos(np.pi / 8)
    assert len(found) == 8
    assert np.allclose(np.linalg.norm(found.point[:, :2], axis=1), radius)
    angle = np.sort(np.arctan2(found.point[:, 1], found.point[:, 0]))
    assert np.allclose(np.diff(angle), np.pi / 4)


def test_many_corners_are_thinned_out_evenly() -> None:
    """A face of 40 corners on a floor keeps `MOST_KEPT`: none is 0.1 of the radius outside."""
    ring = np.exp(2j * np.pi * np.arange(40) / 40)
    drum = Polyhedron([[one.real, one.imag, z] for one in ring for z in (0, 1)])
    x, y, _ = contacts([drum, FLOOR], [[0, 0, 0.5], [0, 0, 0]]).point.T
    angle = np.sort(np.arctan2(y, x))
    assert len(angle) == MOST_KEPT
    assert 1 - np.cos(np.diff(angle, append=angle[0] + 2 * np.pi).max() / 2) < 0.1


@settings(max_examples=30)
@given(st.floats(-4.0, -1.0), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
def test_tilted_faces_have_the_gap_of_each_corner(digits: float, x: float, y: float) -> None:
    """A small box over a wide one: each corner of it has its own height as gap."""
    tilt = 10**digits * 0.09 * np.array([x, y, 0.0])
    small, wide = make_box(0.4, 0.4, 0.4), make_box(2.0, 2.0, 1.0)
    quaternion = make_quaternion(tilt)
    found = contacts([wide, small], [[0, 0, 0], [0, 0, 0.71]], [UPRIGHT, quaternion], margin=0.1)
    corners = np.array([0, 0, 0.71]) + rotate(quaternion, small.vertices)
    low = np.sort(corners[:, 2])[:4] - 0.5
    assert np.allclose(np.sort(found.gap), low, atol=1e-15)
    assert (found.body_a == 1).all()


def test_crossing_edges_have_the_cross_product_as_normal() -> None:
    first, second = ([np.pi / 4, 0, 0], [0, np.pi / 4, 0.3])
    turns = [make_quaternion(first), make_quaternion(second)]
    u, w = rotate(turns[0], [1.0, 0, 0]), rotate(turns[1], [0, 1.0, 0])
    normal = np.cross(u, w) / np.linalg.norm(np.cross(u, w))
    normal *= np.sign(normal[2])
    top = rotate(turns[0], [0.0, 0.5, 0.5])
    bottom = rotate(turns[1], [0.5, 0.0, -0.5])
    if bottom[2] > 0 or rotate(turns[1], [-0.5, 0.0, -0.5])[2] < bottom[2]:
        bottom = rotate(turns[1], [-0.5, 0.0, -0.5])
    gap = 1e-4
    position = np.array([np.zeros(3), top - bottom + gap * normal + 0.1 * u - 0.2 * w])
    found = contacts([CUBE, CUBE], position, turns)
    assert len(found) == 1
    assert (found.body_a[0], found.body_b[0]) == (0, 1)
    assert np.allclose(found.normal[0], -normal, atol=1e-15)
    assert found.gap[0] == pytest.approx(gap, abs=1e-15)
    assert np.allclose(found.point[0], top + 0.1 * u, atol=1e-14)


# --- spheres ---


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


# --- symmetries and names ---


@pytest.mark.long
@settings(max_examples=25)
@given(st.integers(0, 10_000))
def test_numbering_does_not_matter(seed: int) -> None:
    shapes, position, quaternion = near_pair(seed, gap=-1e-4)
    found = contacts(shapes, position, quaternion)
    other = contacts(shapes[::-1], position[::-1], quaternion[::-1])
    assert len(found) == len(other) > 0
    assert np.allclose(np.sort(found.gap), np.sort(other.gap), atol=1e-15)
    sign = np.where(found.body_a < found.body_b, 1.0, -1.0)[:, None]
    opposite = np.where(other.body_a < other.body_b, -1.0, 1.0)[:, None]
    assert np.allclose(
        (sign * found.normal).sum(axis=0), (opposite * other.normal).sum(axis=0), atol=1e-14
    )


@pytest.mark.long
@settings(max_examples=25)
@given(st.integers(0, 10_000))
def test_contacts_turn_with_the_scene(seed: int) -> None:
    shapes, position, quaternion = near_pair(seed)
    turn = normalise(np.random.default_rng(seed + 1).normal(size=4))
    shift = np.array([0.3, -0.7, 0.2])
    found = contacts(shapes, position, quaternion)
    moved = contacts(
        shapes, rotate(turn, position) + shift, multiply_quaternions(turn[None], quaternion)
    )
    assert np.array_equal(found.key, moved.key)
    assert np.allclose(rotate(turn, found.point) + shift, moved.point, atol=1e-14)
    assert np.allclose(rotate(turn, found.normal), moved.normal, atol=1e-13)
    assert np.allclose(found.gap, moved.gap, atol=1e-15)


@pytest.mark.long
@settings(max_examples=20)
@given(st.integers(0, 10_000), st.sampled_from([1e-3, 1e3]))
def test_unit_of_length_does_not_matter(seed: int, unit: float) -> None:
    shapes, position, quaternion = near_pair(seed)
    scaled = [Polyhedron(unit * shape.vertices) for shape in shapes]  # type: ignore[attr-defined]
    found = contacts(shapes, position, quaternion)
    other = contacts(scaled, unit * position, quaternion, margin=1e-3 * unit)
    assert np.array_equal(found.key, other.key)
    assert np.allclose(unit * found.gap, other.gap, atol=1e-14 * unit)


@settings(max_examples=20)
@given(st.integers(0, 10_000))
def test_names_last(seed: int) -> None:
    """A step later, a tenth of a percent of the size away, contacts have the same names."""
    generator = np.random.default_rng(seed)
    cubes, position = [CUBE, CUBE], np.array([[0.0, 0, 0], [*generator.uniform(-0.4, 0.4, 2), 1]])
    first = contacts(cubes, position)
    turns = make_quaternion(1e-6 * generator.normal(size=(2, 3)))
    later = contacts(cubes, position + 1e-4 * generator.normal(size=(2, 3)), turns)
    assert set(first.key) == set(later.key)
    assert len(set(first.key)) == 4


# --- pairs and shapes ---


@pytest.mark.parametrize("dim", [2, 3])
def test_boxes_are_those_of_the_corners(dim: int) -> None:
    """A body's least and greatest coordinates, and those of a disc or sphere, x -+ radius."""
    generator = np.random.default_rng(5)
    first = np.array([0, 4, 4, 11])  # the second has no corners
    corners = generator.normal(size=(11, dim))
    place, radius, margin = generator.normal(size=(3, dim)), np.full(3, 0.3), generator.random(3)
    boxes = bound_shapes(first, corners, radius, place, margin)
    ball = place[1] + 0.3 * np.array([[-1.0], [1.0]])
    for body, points in enumerate((corners[:4], ball, corners[4:])):
        wanted = [points.min(axis=0) - margin[body], points.max(axis=0) + margin[body]]
        np.testing.assert_array_equal(boxes[body], np.concatenate(wanted))


def test_pairs_are_those_of_all_boxes() -> None:
    generator = np.random.default_rng(0)
    shapes = [make_stone(generator, 0.2) for _ in range(40)] + [Sphere(0.1)] * 20 + [FLOOR]
    position = generator.random((61, 3))
    movable = generator.random(61) < 0.8
    movable[60] = False
    arrays = pack_shapes_3d(shapes, movable)
    solids = place_solids(arrays, position, np.tile(UPRIGHT, (61, 1)))
    boxes = bound_shapes(
        solids.first_vertex, solids.vertex, arrays.reach, position, np.full(61, 0.01)
    )
    wanted = [
        (i, j)
        for i in range(60)
        for j in range(i + 1, 61)
        if (movable[i] or movable[j])
        and (j == 60 or ((boxes[i, :3] <= boxes[j, 3:]) & (boxes[j, :3] <= boxes[i, 3:])).all())
    ]
    found = find_near_pairs(arrays.kind, boxes, movable)
    assert [tuple(pair) for pair in found.tolist()] == wanted


def test_no_bodies_near_no_contacts() -> None:
    assert len(contacts([CUBE, CUBE], [[0, 0, 0], [5, 0, 0]])) == 0
    assert len(contacts([CUBE], [[0, 0, 0]])) == 0
    assert contacts([CUBE], [[0, 0, 0]]).normal.shape == (0, 3)


def test_shapes_of_the_plane_are_refused() -> None:
    for shape in (Disc(1.0), HalfSpace([0.0, 1.0])):
        with pytest.raises(SceneError, match="shape in space"):
            pack_shapes_3d([shape], np.array([True]))
