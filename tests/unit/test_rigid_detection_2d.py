"""Contacts in the plane: known pairs, the broad phase against all pairs, names that last."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigid_lcp import Disc, HalfSpace, Polygon
from rigid_lcp.contact.arrays import Contacts, match_keys
from rigid_lcp.contact.detection_plane import detect_2d, find_widest_face, pack_shapes_2d
from rigid_lcp.contact.near_pairs import bound_shapes, find_near_pairs, place_shapes
from rigid_lcp.errors import SceneError

BOX = Polygon.rectangle(1.0, 1.0)


def found(shapes: list[object], places: list[tuple[float, float]], angles: list[float],
          margin: float = 1e-3) -> Contacts:  # fmt: skip
    arrays = pack_shapes_2d(shapes, np.array([not isinstance(s, HalfSpace) for s in shapes]))
    return detect_2d(arrays, np.array(places, float), np.array(angles, float), margin)


def test_box_on_floor() -> None:
    contacts = found([BOX, HalfSpace((0, 1))], [(3, 0.5), (0, 0)], [0, 0])
    np.testing.assert_allclose(np.sort(contacts.point[:, 0]), [2.5, 3.5])
    np.testing.assert_allclose(contacts.normal, [[0, 1], [0, 1]])
    np.testing.assert_allclose(contacts.gap, 0, atol=1e-15)
    assert (contacts.body_a == 0).all()
    assert (contacts.body_b == 1).all()


@pytest.mark.parametrize("shift", [0.0, 0.3, -0.7])
def test_two_faces_make_two_contacts(shift: float) -> None:
    """At the ends of the piece they share (Fig. 2): one vertex of each, or coincident corners."""
    contacts = found([BOX, BOX], [(0, 0), (shift, 1.0)], [0, 0])
    assert len(contacts) == 2
    ends = np.sort(contacts.point[:, 0])
    np.testing.assert_allclose(ends, [max(-0.5, shift - 0.5), min(0.5, shift + 0.5)])
    upward = np.where(contacts.body_a == 1, 1.0, -1.0)
    np.testing.assert_allclose(contacts.normal[:, 1], upward, atol=1e-15)
    if shift:
        assert sorted(contacts.body_a) == [0, 1]
    wide = Polygon.rectangle(3.0, 1.0)
    for shapes, middle in (([BOX, wide], 0.0), ([wide, BOX], shift)):  # the whole narrower face
        ends = found(shapes, [(0, 0), (shift, 1.0)], [0, 0]).point[:, 0]
        np.testing.assert_allclose(np.sort(ends), [middle - 0.5, middle + 0.5])


def test_corner_on_face() -> None:
    contacts = found([BOX, BOX], [(0, 0), (0.2, 0.5 + np.sqrt(0.5))], [0, np.pi / 4])
    assert len(contacts) == 1
    np.testing.assert_allclose(contacts.point[0], [0.2, 0.5], atol=1e-14)
    np.testing.assert_allclose(contacts.normal[0], [0, 1], atol=1e-14)
    assert (contacts.body_a[0], contacts.body_b[0]) == (1, 0)


def test_corner_past_a_corner_is_no_contact() -> None:
    assert len(found([BOX, BOX], [(0, 0), (1.0005, 1.0005)], [0, 0])) == 0
    assert len(found([BOX, BOX], [(0, 0), (0.999, 0.9995)], [0, 0])) > 0


def test_discs() -> None:
    two = found([Disc(1.0), Disc(0.5)], [(0, 0), (0, 1.5)], [0, 0])
    np.testing.assert_allclose(two.normal, [[0, -1]])
    np.testing.assert_allclose(two.point, [[0, 1]])
    face = found([Disc(1.0), BOX], [(0.2, 1.5), (0, 0)], [0, 0])
    np.testing.assert_allclose(face.normal, [[0, 1]])
    assert np.isinf(face.radius_b[0])
    corner = found([BOX, Disc(1.0)], [(0, 0), (0.5 + 0.6, 0.5 + 0.8)], [0, 0])
    np.testing.assert_allclose(corner.normal, [[0.6, 0.8]])
    np.testing.assert_allclose(corner.point, [[0.5, 0.5]], atol=1e-15)
    assert (corner.radius_a[0], corner.radius_b[0]) == (1.0, 0.0)
    floor = found([Disc(1.0), HalfSpace((0, 1), 0.5)], [(7, 1.5), (0, 0)], [0, 0])
    np.testing.assert_allclose(floor.point, [[7, 0.5]])


def test_fixed_bodies_do_not_touch_each_other() -> None:
    arrays = pack_shapes_2d([BOX, BOX, HalfSpace((0, 1))], np.array([False, False, False]))
    assert len(detect_2d(arrays, np.array([(0, 0.5), (0.5, 0.5), (0, 0)]), np.zeros(3), 1.0)) == 0


def test_shape_of_space_refused() -> None:
    with pytest.raises(SceneError, match="plane"):
        pack_shapes_2d([HalfSpace((0, 0, 1))], np.array([False]))


def heap(seed: int, count: int = 40) -> tuple[list[object], np.ndarray, np.ndarray]:
    generator = np.random.default_rng(seed)
    shapes: list[object] = [
        Disc(0.4) if k % 4 == 0 else Polygon.regular(3 + k % 5, 0.5) for k in range(count)
    ]
    return shapes, generator.uniform(0, 5, (count, 2)), generator.uniform(0, 6, count)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=30)
def test_broad_phase_finds_every_near_pair(seed: int) -> None:
    """Against all pairs of boxes in plain NumPy."""
    shapes, places, angles = heap(seed)
    arrays = pack_shapes_2d(shapes, np.ones(len(shapes), bool))
    vertices, _ = place_shapes(
        arrays.kind, arrays.first, arrays.vertices, arrays.normals, places, angles
    )
    boxes = bound_shapes(arrays.first, vertices, arrays.radius, places, np.full(len(shapes), 0.01))
    x0, y0, x1, y1 = boxes.T
    near = (x0[:, None] <= x1) & (x0 <= x1[:, None]) & (y0[:, None] <= y1) & (y0 <= y1[:, None])
    expected = np.argwhere(np.triu(near, 1))
    np.testing.assert_array_equal(find_near_pairs(arrays.kind, boxes, arrays.movable), expected)


@pytest.mark.long
@given(st.integers(0, 2**32 - 1), st.floats(-3, 3), st.floats(-100, 100))
@settings(max_examples=30)
def test_turned_scene_has_turned_contacts(seed: int, turn: float, shift: float) -> None:
    """Gaps do not change, normals turn, names stay, wherever the frame is."""
    shapes, places, angles = heap(seed)
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    here = found(shapes, places, angles, 1e-2)
    there = found(shapes, places @ rotation.T + shift, angles + turn, 1e-2)
    rows, known = match_keys(there.key, here.key)
    sure = np.abs(here.gap - 2e-2) > 1e-9  # a contact at the margin may fall on either side
    assert known[sure].mean() > 0.9  # ties between two faces may be broken otherwise
    np.testing.assert_allclose(there.gap[rows[known]], here.gap[known], atol=1e-11)
    np.testing.assert_allclose(
        there.normal[rows[known]], here.normal[known] @ rotation.T, atol=1e-9
    )


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=20)
def test_keys_name_one_contact_each(seed: int) -> None:
    shapes, places, angles = heap(seed)
    contacts = found(shapes, places, angles)
    assert len(np.unique(contacts.key)) == len(contacts)


def test_rows_of_keys() -> None:
    rows, there = match_keys(np.array([5, 3, 9]), np.array([3, 4, 9, 5]))
    np.testing.assert_array_equal(there, [True, False, True, True])
    np.testing.assert_array_equal(rows[there], [1, 2, 0])
    assert not match_keys(np.zeros(0, np.int64), np.array([1]))[1].any()


@given(st.floats(-3, 3), st.floats(-3, 3), st.floats(0, 6))
@settings(max_examples=30)
def test_widest_face_is_the_separation(x: float, y: float, turn: float) -> None:
    """Against all vertices over all faces in plain NumPy."""
    own, c, s = Polygon.regular(5, 1.0), np.cos(turn), np.sin(turn)
    other = Polygon.regular(3, 0.7).vertices @ np.array([[c, s], [-s, c]]) + [x, y]
    heights = np.einsum("fvi,fi->fv", other - own.vertices[:, None], own.normals).min(axis=1)
    face, separation = find_widest_face(own.vertices, own.normals, other)
    assert [separation, heights[face]] == pytest.approx([heights.max()] * 2, abs=1e-14)
