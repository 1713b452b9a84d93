"""Solids for tests: their contacts, and two stones at random angles that nearly touch."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from rigid_lcp import HalfSpace, Polyhedron, make_box
from rigid_lcp.contact import detect_3d, pack_shapes_3d
from rigid_lcp.contact.arrays import Contacts
from rigid_lcp.motion.gyroscopic import turn_inertia
from rigid_lcp.shapes.rotations import Floats, make_rotation, normalise

UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])
FLOOR = HalfSpace([0.0, 0.0, 1.0], 0.0)
CUBE = make_box(1.0, 1.0, 1.0)
Placed = tuple[Sequence[object], Floats, Floats]


def angular_momentum(inertia: Floats, quaternion: Floats, spin: Floats) -> Floats:
    """``I(q) w`` in the world frame."""
    return np.einsum("...ij,...j->...i", turn_inertia(inertia, quaternion), spin)


def make_stone(generator: np.random.Generator, size: float, corners: int = 16) -> Polyhedron:
    """A random convex stone that passes a square sieve of about ``size`` [m].

    Points on an ellipsoid, each the farthest of ten random ones from those before it (Mitchell's
    best candidate), so that edges stay sharp and faces are of like size.
    """
    chosen = np.empty((0, 3))
    while len(chosen) < corners:
        tries = generator.normal(size=(10, 3))
        tries /= np.linalg.norm(tries, axis=1)[:, None]
        nearest = -(tries @ chosen.T).max(axis=1, initial=-1.0)
        chosen = np.vstack([chosen, tries[np.argmax(nearest)]])
    return Polyhedron(0.5 * size * np.array([1.3, 1.0, 0.75]) * chosen)


def contacts(
    shapes: Sequence[object], position: object, quaternion: object = None, margin: float = 1e-3
) -> Contacts:
    """Contacts with a gap up to ``2 margin``."""
    movable = np.array([not isinstance(shape, HalfSpace) for shape in shapes])
    turns = np.array([UPRIGHT] * len(shapes)) if quaternion is None else np.array(quaternion)
    return detect_3d(pack_shapes_3d(shapes, movable), np.array(position, float), turns, margin)


def coal_distance(shapes: Sequence[Polyhedron], position: Floats, turns: Floats) -> Any:
    """What coal finds for two polyhedra: ``min_distance`` and the nearest points."""
    import coal

    hulls, places = [], []
    for shape, x, turn in zip(shapes, position, make_rotation(turns), strict=True):
        points = coal.StdVec_Vec3s()
        for corner in shape.vertices:
            points.append(corner)
        hulls.append(coal.Convex.convexHull(points, False, "Qt"))
        places.append(coal.Transform3s(turn, x))
    result = coal.DistanceResult()
    coal.distance(hulls[0], places[0], hulls[1], places[1], coal.DistanceRequest(), result)
    return result


def sort_points(found: Contacts) -> Floats:
    across = np.round(found.point[:, :2], 9) + 0.0
    return found.point[np.lexsort(across.T)]


def near_pair(seed: int, gap: float = 1e-4) -> Placed:
    """Two stones at random angles, moved together until the least gap is about ``gap`` [m]."""
    generator = np.random.default_rng(seed)
    shapes = [make_stone(generator, 1.0), make_stone(generator, 0.7, 12)]
    quaternion = normalise(generator.normal(size=(2, 4)))
    direction = generator.normal(size=3)
    direction /= np.linalg.norm(direction)
    arrays = pack_shapes_3d(shapes, np.array([True, True]))

    def least(distance: float, margin: float) -> float:
        position = np.array([np.zeros(3), distance * direction])
        return float(detect_3d(arrays, position, quaternion, margin).gap.min(initial=np.inf))

    close, far = 0.0, 2.0  # bisection: nearer than the gap, or not
    for _ in range(45):
        middle = 0.5 * (close + far)
        close, far = (close, middle) if least(middle, 2e-3) > gap else (middle, far)
    return shapes, np.array([np.zeros(3), close * direction]), quaternion
