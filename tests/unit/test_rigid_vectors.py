"""Kernels of vectors, rotations and frames against what NumPy makes of whole arrays."""

from __future__ import annotations

import numpy as np

from rigid_lcp.contact import build_frames
from rigid_lcp.contact.near_pairs import order_contacts
from rigid_lcp.contact.placed_solids import pack_shapes_3d, place_solids
from rigid_lcp.motion.equations import find_response, make_body_space
from rigid_lcp.motion.world import Scene, make_world
from rigid_lcp.shapes import make_box, make_rotation, multiply_quaternions, normalise, vectors
from tests.rigid_solids import FLOOR, make_stone

ROUND_OFF = 1e-15
RANDOM = np.random.default_rng(2)


def test_products_and_rotations_agree_with_numpy() -> None:
    q, p = normalise(RANDOM.normal(size=(2, 4)))
    a, b = RANDOM.normal(size=(2, 3))
    assert np.allclose(vectors.multiply(q, p), multiply_quaternions(q, p), atol=2 * ROUND_OFF)
    assert np.allclose(vectors.cross(a, b), np.cross(a, b), atol=0)
    assert np.allclose([vectors.dot(a, b), vectors.project(a, b)], a @ b, atol=4 * ROUND_OFF)
    turn = vectors.make_rotation(q)
    assert np.allclose(turn, make_rotation(q), atol=0)
    assert np.allclose(vectors.rotate(turn, a), make_rotation(q) @ a, atol=4 * ROUND_OFF)
    assert np.allclose(vectors.rotate_back(turn, a), make_rotation(q).T @ a, atol=4 * ROUND_OFF)


def test_frames_are_right_handed() -> None:
    """Also about the axes, where two components of the normal are equal."""
    normal = np.vstack([RANDOM.normal(size=(20, 3)), np.eye(3), -np.eye(3)])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    frames = build_frames(normal)
    assert np.allclose(frames @ frames.swapaxes(1, 2), np.eye(3), atol=4 * ROUND_OFF)
    assert np.allclose(np.linalg.det(frames), 1.0, atol=8 * ROUND_OFF)
    assert np.array_equal(frames[:, 0], normal)


def test_features_are_placed_as_numpy_places_them() -> None:
    shapes = [make_stone(RANDOM, 0.1), FLOOR, make_box(1, 2, 3)]
    place, turn = RANDOM.normal(size=(3, 3)), normalise(RANDOM.normal(size=(3, 4)))
    packed = pack_shapes_3d(shapes, np.array([True, False, True]))
    placed = place_solids(packed, place, turn)
    for body in (0, 2):
        rows = slice(placed.first_vertex[body], placed.first_vertex[body + 1])
        faces = slice(placed.first_face[body], placed.first_face[body + 1])
        r = make_rotation(turn[body])
        corners = packed.solids.vertex[rows] @ r.T + place[body]
        assert np.allclose(placed.vertex[rows], corners, atol=8 * ROUND_OFF)
        height = corners @ placed.normal[faces].T - placed.offset[faces]
        assert np.allclose(height.max(axis=0), 0.0, atol=16 * ROUND_OFF)  # faces bear corners
    face = placed.first_face[1]
    assert np.array_equal(placed.normal[face], [0, 0, 1])
    assert placed.offset[face] == 0.0


def test_contacts_come_by_their_pairs_as_they_were_found() -> None:
    """Whichever of the two is a; a half-space, body 1, is always the second."""
    bodies = np.array([[2, 3], [2, 1], [2, 0], [0, 2], [3, 2]])
    number = np.arange(45.0).reshape(5, 9)
    found = order_contacts(np.array([0, 2, 0, 0]), bodies, number, np.arange(5))
    assert np.array_equal(found[5], [2, 3, 1, 0, 4])
    assert np.array_equal(np.column_stack([*found[:2]]), bodies[found[5]])
    assert np.array_equal(np.column_stack([*found[2:5], *found[6:]]), number[found[5]])


def test_impulses_change_velocities_as_the_sparse_product_says() -> None:
    scene = Scene(dim=3)
    scene.add(FLOOR)
    for k in range(2):
        scene.add(make_box(1, 2, 1), density=1e3, position=[0.0, 0.1 * k, 0.5 + k])
    world, motion = make_world(scene)
    contacts = world.contacts(motion, 1e-3)
    bodies = make_body_space(contacts, motion.position, world.columns, world.inverse_mass(motion))
    impulse = RANDOM.normal(size=(len(contacts), 3))
    change = (bodies.inverse_mass @ (bodies.jacobian.T @ impulse.ravel())).reshape(2, 6)
    assert np.allclose(find_response(bodies, impulse), change, atol=ROUND_OFF)
