"""Contacts in space: closed forms, finite differences of the gap, coal's distances, hard cases."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigid_lcp.contacts import Contacts
from rigid_lcp.detection_3d import bounding_boxes, detect_3d, near_pairs, place_solids, shapes_3d
from rigid_lcp.equations import inertial_acceleration, relative_velocity
from rigid_lcp.errors import SceneError
from rigid_lcp.motion import Motion, motion_displaced
from rigid_lcp.placed_solids import MOST_EDGES
from rigid_lcp.polyhedra import ballast_stone
from rigid_lcp.rotations import (
    Floats,
    quaternion_of_rotation,
    quaternion_product,
    rotate,
    rotation_matrix,
    unit_quaternion,
)
from rigid_lcp.shapes_2d import Disc, HalfSpace
from rigid_lcp.shapes_3d import Polyhedron, Sphere, box

UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])
FLOOR = HalfSpace([0.0, 0.0, 1.0], 0.0)
CUBE = box(1.0, 1.0, 1.0)
Placed = tuple[Sequence[object], Floats, Floats]


def contacts(
    shapes: Sequence[object], position: object, quaternion: object = None, margin: float = 1e-3
) -> Contacts:
    """Contacts with a gap up to ``2 margin``."""
    movable = np.array([not isinstance(shape, HalfSpace) for shape in shapes])
    turns = np.array([UPRIGHT] * len(shapes)) if quaternion is None else np.array(quaternion)
    return detect_3d(shapes_3d(shapes, movable), np.array(position, dtype=float), turns, margin)


def sorted_points(found: Contacts) -> Floats:
    across = np.round(found.point[:, :2], 9) + 0.0
    return found.point[np.lexsort(across.T)]


def near_pair(seed: int, gap: float = 1e-4) -> Placed:
    """Two stones at random angles, moved together until the least gap is about ``gap`` [m]."""
    generator = np.random.default_rng(seed)
    shapes = [ballast_stone(generator, 1.0), ballast_stone(generator, 0.7, 12)]
    quaternion = unit_quaternion(generator.normal(size=(2, 4)))
    direction = generator.normal(size=3)
    direction /= np.linalg.norm(direction)
    arrays = shapes_3d(shapes, np.array([True, True]))

    def least(distance: float, margin: float) -> float:
        position = np.array([np.zeros(3), distance * direction])
        return float(detect_3d(arrays, position, quaternion, margin).gap.min(initial=np.inf))

    close, far = 0.0, 2.0  # bisection: nearer than the gap, or not
    for _ in range(45):
        middle = 0.5 * (close + far)
        close, far = (close, middle) if least(middle, 2e-3) > gap else (middle, far)
    return shapes, np.array([np.zeros(3), close * direction]), quaternion


# --- closed forms ---


def test_box_on_floor_has_its_four_corners() -> None:
    found = contacts([CUBE, FLOOR], [[0, 0, 0.5 + 1e-4], [0, 0, 0]])
    assert found.body_a.tolist() == [0] * 4
    assert found.body_b.tolist() == [1] * 4
    assert np.allclose(found.gap, 1e-4, atol=1e-16)
    assert np.array_equal(found.normal, np.tile([0.0, 0.0, 1.0], (4, 1)))
    corners = [[-0.5, -0.5], [0.5, -0.5], [-0.5, 0.5], [0.5, 0.5]]
    assert np.allclose(sorted_points(found)[:, :2], corners)
    assert (found.radius_a == 0).all()
    assert np.isinf(found.radius_b).all()


@pytest.mark.parametrize("gap", [1e-4, 0.0, -1e-4, 1e-12])
def test_box_on_box_has_the_corners_of_the_overlap(gap: float) -> None:
    found = contacts([CUBE, CUBE], [[0, 0, 0], [0.3, 0.2, 1.0 + gap]])
    wanted = [[-0.2, -0.3], [0.5, -0.3], [-0.2, 0.5], [0.5, 0.5]]
    assert np.allclose(sorted_points(found)[:, :2], wanted, atol=1e-15)
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
    bar = box(3.0, 1.0, 1.0)
    across = quaternion_of_rotation([0.0, 0.0, np.pi / 2])
    found = contacts([bar, bar], [[0, 0, 0], [0, 0, 1.0]], [UPRIGHT, across])
    wanted = [[-0.5, -0.5], [0.5, -0.5], [-0.5, 0.5], [0.5, 0.5]]
    assert np.allclose(sorted_points(found)[:, :2], wanted, atol=1e-15)


def test_a_shared_octagon_keeps_its_extent() -> None:
    """Cubes turned by 45 degrees share a regular octagon; four corners keep its diameter."""
    turned = quaternion_of_rotation([0.0, 0.0, np.pi / 4])
    found = contacts([CUBE, CUBE], [[0, 0, 0], [0, 0, 1.0]], [UPRIGHT, turned])
    radius = 0.5 / np.cos(np.pi / 8)
    assert len(found) == 4
    assert np.allclose(np.linalg.norm(found.point[:, :2], axis=1), radius)
    x, y = sorted_points(found)[[0, 1, 3, 2], :2].T
    angle = np.unwrap(np.sort(np.arctan2(y, x)))
    assert np.diff(angle, append=angle[0] + 2 * np.pi).max() < np.pi / 2 + 1e-9  # a square


@settings(max_examples=30, deadline=None)
@given(st.floats(-4.0, -1.0), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
def test_tilted_faces_have_the_gap_of_each_corner(digits: float, x: float, y: float) -> None:
    """A small box over a wide one: each corner of it has its own height as gap."""
    tilt = 10**digits * 0.09 * np.array([x, y, 0.0])
    small, wide = box(0.4, 0.4, 0.4), box(2.0, 2.0, 1.0)
    quaternion = quaternion_of_rotation(tilt)
    found = contacts([wide, small], [[0, 0, 0], [0, 0, 0.71]], [UPRIGHT, quaternion], margin=0.1)
    corners = np.array([0, 0, 0.71]) + rotate(quaternion, small.vertices)
    low = np.sort(corners[:, 2])[:4] - 0.5
    assert np.allclose(np.sort(found.gap), low, atol=1e-15)
    assert (found.body_a == 1).all()


def test_crossing_edges_have_the_cross_product_as_normal() -> None:
    first, second = ([np.pi / 4, 0, 0], [0, np.pi / 4, 0.3])
    turns = [quaternion_of_rotation(first), quaternion_of_rotation(second)]
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


# --- against finite differences, coal, symmetry ---


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10_000))
def test_gap_rate_is_the_derivative_of_the_gap(seed: int) -> None:
    """Eq. 13: ``dg/dt = n . (v_a - v_b)`` at the contact point, for every kind of contact."""
    shapes, position, quaternion = near_pair(seed)
    shapes = [*shapes, Sphere(0.5), HalfSpace([0.1, 0.2, 1.0], -0.8)]
    generator = np.random.default_rng(seed)
    place = np.vstack([position, [0.0, 0.0, 1.0], np.zeros(3)])
    turns = np.vstack([quaternion, UPRIGHT, UPRIGHT])
    rates = np.vstack([generator.normal(size=(3, 6)), np.zeros(6)])
    motion = Motion(place, turns, rates[:, :3], rates[:, 3:])
    arrays = shapes_3d(shapes, np.array([True, True, True, False]))
    h = 1e-7

    def gaps(t: float) -> dict[int, float]:
        there = motion_displaced(motion, t * rates)
        found = detect_3d(arrays, there.position, there.angle, 0.05)
        return dict(zip(found.key.tolist(), found.gap.tolist(), strict=True))

    found = detect_3d(arrays, place, turns, 0.05)
    assert len(found) > 0
    speed = relative_velocity(found, motion)[:, 0]
    ahead, behind = gaps(h), gaps(-h)
    checked = 0
    for key, rate in zip(found.key.tolist(), speed, strict=True):
        if key in ahead and key in behind:
            # round-off 1e-16 / h = 1e-9; truncation h^2 |w|^3 is far below
            assert (ahead[key] - behind[key]) / (2 * h) == pytest.approx(rate, abs=2e-8)
            checked += 1
    assert checked > 0


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10_000))
def test_inertial_terms_are_the_second_derivative_of_the_gap(seed: int) -> None:
    """Eqs 14 and 24 in space: ``d2g/dt2`` of bodies with constant velocity and spin.

    Corners on faces, crossing edges, spheres on faces, edges, corners, spheres and planes.
    """
    shapes, position, quaternion = near_pair(seed)
    generator = np.random.default_rng(seed)
    shapes = [*shapes, Sphere(0.3), Sphere(0.5), HalfSpace([0.1, 0.2, 1.0], -0.8)]
    top = rotate(quaternion[0], shapes[0].vertices)  # type: ignore[attr-defined]
    corner = top[generator.integers(len(top))]
    above = corner * (1 + 0.3 / np.linalg.norm(corner))
    place = np.vstack([position, above, above + np.array([0.0, 0.8, 0.0]), np.zeros(3)])
    turns = np.vstack([quaternion, np.tile(UPRIGHT, (3, 1))])
    rates = np.vstack([generator.normal(size=(4, 6)), np.zeros(6)])
    motion = Motion(place, turns, rates[:, :3], rates[:, 3:])
    arrays = shapes_3d(shapes, np.array([True, True, True, True, False]))
    h = 1e-4

    def gaps(t: float) -> dict[int, float]:
        there = motion_displaced(motion, t * rates)
        found = detect_3d(arrays, there.position, there.angle, 0.05)
        return dict(zip(found.key.tolist(), found.gap.tolist(), strict=True))

    found = detect_3d(arrays, place, turns, 0.05)
    exact = inertial_acceleration(found, motion)[:, 0]
    ahead, behind = gaps(h), gaps(-h)
    checked = 0
    for k, key in enumerate(found.key.tolist()):
        if key not in ahead or key not in behind:
            continue
        second = (ahead[key] - 2 * found.gap[k] + behind[key]) / h**2
        # round-off 4e-16 / h^2 = 4e-8; truncation h^2 / 12 times the fourth derivative, up to
        # |w|^4 = 1e3 and v^4 / R^3 = 1e3 here
        assert second == pytest.approx(exact[k], abs=1e-5, rel=1e-5)
        checked += 1
    assert checked > 0


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from(["crossing", "sphere"]))
def test_inertial_terms_at_edges(seed: int, form: str) -> None:
    """Normals across edges turn with both bodies: a cube's edge over another's, or under a sphere.

    Without `rigid_lcp.edge_normals` a sphere that rolls along an edge would seem to lift off it
    with v^2 / R.
    """
    generator = np.random.default_rng(seed)
    lower = quaternion_of_rotation([np.pi / 4, 0.0, 0.0])
    if form == "crossing":
        shapes: list[object] = [CUBE, CUBE]
        upper = quaternion_product(
            quaternion_of_rotation([0.0, 0.0, generator.uniform(0.5, 2.5)])[None], lower[None]
        )[0]
        place = np.array([[0.0, 0, 0], [*generator.uniform(-0.2, 0.2, 2), 2**0.5 + 1e-3]])
    else:
        shapes, upper = [CUBE, Sphere(0.4)], UPRIGHT
        place = np.array([[0.0, 0, 0], [*generator.uniform(-0.1, 0.1, 2), 0.5**0.5 + 0.401]])
    turns = np.array([lower, upper])
    rates = generator.normal(size=(2, 6))
    motion = Motion(place, turns, rates[:, :3], rates[:, 3:])
    h = 1e-4
    found = contacts(shapes, place, turns, margin=0.1)
    assert len(found) == 1
    assert found.edge_b.any()
    gaps = []
    for t in (-h, 0.0, h):
        there = motion_displaced(motion, t * rates)
        gaps.append(contacts(shapes, there.position, there.angle, margin=0.1).gap[0])
    second = (gaps[0] - 2 * gaps[1] + gaps[2]) / h**2
    exact = inertial_acceleration(found, motion)[0, 0]
    assert second == pytest.approx(exact, abs=1e-5, rel=1e-5)
    rate = relative_velocity(found, motion)[0, 0]
    assert (gaps[2] - gaps[0]) / (2 * h) == pytest.approx(rate, abs=1e-5)


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


@settings(max_examples=25, deadline=None)
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


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10_000))
def test_contacts_turn_with_the_scene(seed: int) -> None:
    shapes, position, quaternion = near_pair(seed)
    turn = unit_quaternion(np.random.default_rng(seed + 1).normal(size=4))
    shift = np.array([0.3, -0.7, 0.2])
    found = contacts(shapes, position, quaternion)
    moved = contacts(
        shapes, rotate(turn, position) + shift, quaternion_product(turn[None], quaternion)
    )
    assert np.array_equal(found.key, moved.key)
    assert np.allclose(rotate(turn, found.point) + shift, moved.point, atol=1e-14)
    assert np.allclose(rotate(turn, found.normal), moved.normal, atol=1e-13)
    assert np.allclose(found.gap, moved.gap, atol=1e-15)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from([1e-3, 1e3]))
def test_unit_of_length_does_not_matter(seed: int, unit: float) -> None:
    shapes, position, quaternion = near_pair(seed)
    scaled = [Polyhedron(unit * shape.vertices) for shape in shapes]  # type: ignore[attr-defined]
    found = contacts(shapes, position, quaternion)
    other = contacts(scaled, unit * position, quaternion, margin=1e-3 * unit)
    assert np.array_equal(found.key, other.key)
    assert np.allclose(unit * found.gap, other.gap, atol=1e-14 * unit)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10_000))
def test_names_last(seed: int) -> None:
    """A step later, a tenth of a percent of the size away, contacts have the same names."""
    generator = np.random.default_rng(seed)
    cubes, position = [CUBE, CUBE], np.array([[0.0, 0, 0], [*generator.uniform(-0.4, 0.4, 2), 1]])
    first = contacts(cubes, position)
    turns = quaternion_of_rotation(1e-6 * generator.normal(size=(2, 3)))
    later = contacts(cubes, position + 1e-4 * generator.normal(size=(2, 3)), turns)
    assert set(first.key) == set(later.key)
    assert len(set(first.key)) == 4


# --- hard cases ---


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


def test_pairs_are_those_of_all_boxes() -> None:
    generator = np.random.default_rng(0)
    shapes = [ballast_stone(generator, 0.2) for _ in range(40)] + [Sphere(0.1)] * 20 + [FLOOR]
    position = generator.random((61, 3))
    movable = generator.random(61) < 0.8
    movable[60] = False
    arrays = shapes_3d(shapes, movable)
    solids = place_solids(arrays, position, np.tile(UPRIGHT, (61, 1)))
    boxes = bounding_boxes(arrays.kind, solids, arrays.reach, position, np.full(61, 0.01))
    wanted = [
        (i, j)
        for i in range(60)
        for j in range(i + 1, 61)
        if (movable[i] or movable[j])
        and (j == 60 or ((boxes[i, :3] <= boxes[j, 3:]) & (boxes[j, :3] <= boxes[i, 3:])).all())
    ]
    found = near_pairs(arrays.kind, boxes, movable)
    assert [tuple(pair) for pair in found.tolist()] == wanted


def test_no_bodies_near_no_contacts() -> None:
    assert len(contacts([CUBE, CUBE], [[0, 0, 0], [5, 0, 0]])) == 0
    assert len(contacts([CUBE], [[0, 0, 0]])) == 0
    assert contacts([CUBE], [[0, 0, 0]]).normal.shape == (0, 3)


def test_shapes_of_the_plane_are_refused() -> None:
    for shape in (Disc(1.0), HalfSpace([0.0, 1.0])):
        with pytest.raises(SceneError, match="shape in space"):
            shapes_3d([shape], np.array([True]))


def test_a_grain_with_too_many_edges_is_refused() -> None:
    points = np.random.default_rng(0).normal(size=(MOST_EDGES // 3 + 10, 3))
    ball = Polyhedron(points / np.linalg.norm(points, axis=1)[:, None])
    with pytest.raises(SceneError, match="edges"):
        shapes_3d([ball], np.array([True]))
