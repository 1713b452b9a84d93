"""Kernels of vectors, frames and placed features against what NumPy makes of whole arrays."""

from __future__ import annotations

import numpy as np
import pytest

from rigid_lcp.contact import build_frames, pack_shapes_3d
from rigid_lcp.contact.near_pairs import order_contacts
from rigid_lcp.contact.placed_solids import place_solids
from rigid_lcp.errors import SceneError
from rigid_lcp.motion.gyroscopic import rotate_freely, turn_inertia
from rigid_lcp.shapes import make_rotation, multiply_quaternions, normalise, vectors
from tests.rigid_solids import FLOOR, make_stone

RANDOM = np.random.default_rng(2)
TIE = 2e-15  # round-off of three products of numbers of size 1 to 3


def test_products_and_rotations_agree_with_numpy() -> None:
    (q, p), (a, b) = normalise(RANDOM.normal(size=(2, 4))), RANDOM.normal(size=(2, 3))
    turn = vectors.make_rotation(q)
    assert np.array_equal(vectors.cross(a, b), np.cross(a, b))
    assert np.array_equal(turn, make_rotation(q))
    assert np.allclose([vectors.dot(a, b), vectors.project(a, b)], a @ b, atol=TIE)
    assert np.allclose(vectors.multiply(q, p), multiply_quaternions(q, p), atol=TIE)
    assert np.allclose(vectors.rotate(turn, a), make_rotation(q) @ a, atol=TIE)
    assert np.allclose(vectors.rotate_back(turn, a), make_rotation(q).T @ a, atol=TIE)


def test_frames_are_right_handed() -> None:
    normal = np.vstack([RANDOM.normal(size=(20, 3)), np.eye(3), -np.eye(3)])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    frames = build_frames(normal)
    assert np.allclose(frames @ frames.swapaxes(1, 2), np.eye(3), atol=TIE)
    assert np.allclose(np.cross(normal, frames[:, 1]), frames[:, 2], atol=TIE)


def test_features_are_placed_with_their_bodies_and_walls_stay() -> None:
    place, turn = RANDOM.normal(size=(2, 3)), normalise(RANDOM.normal(size=(2, 4)))
    packed = pack_shapes_3d([make_stone(RANDOM, 0.1), FLOOR], np.array([True, False]))
    placed = place_solids(packed, place, turn)
    corners = packed.solids.vertex @ make_rotation(turn[0]).T + place[0]
    assert np.allclose(placed.vertex, corners, atol=TIE)
    height = corners @ placed.normal[:-1].T - placed.offset[:-1]
    assert np.allclose(height.max(axis=0), 0.0, atol=4 * TIE)  # of the corners of each face
    assert np.array_equal([*placed.normal[-1], placed.offset[-1]], [0.0, 0.0, 1.0, 0.0])


def test_contacts_come_by_their_pairs_as_they_were_found() -> None:
    """Whichever of the two is a; a half-space, body 1, is always the second."""
    bodies = np.array([[2, 3], [3, 1], [2, 0], [0, 2], [3, 2]])
    number = np.arange(45.0).reshape(5, 9)
    found = order_contacts(np.array([0, 2, 0, 0]), bodies, number, np.arange(5))
    assert np.array_equal(found[5], [2, 3, 0, 4, 1])
    rows = np.column_stack([bodies, number])[found[5]]
    assert np.array_equal(np.column_stack([*found[:5], *found[6:]]), rows)


def test_moments_that_underflow_are_a_sentence_and_tensors_broadcast() -> None:
    still, turns = np.array([[1.0, 0, 0, 0]]), normalise(RANDOM.normal(size=(3, 4)))
    with pytest.raises(SceneError, match="quaternion"):
        rotate_freely((np.zeros((1, 3)), still), still, np.ones((1, 3)), 1e-3)
    assert turn_inertia(np.eye(3), turns) == pytest.approx(np.tile(np.eye(3), (3, 1, 1)))
