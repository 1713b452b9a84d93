"""Which points may be in which faces, and which edges across which: boxes of bodies, then of parts.

The lists are good until a vertex has moved half the skin.  They stand in the order of bodies,
points and faces, whatever moved before.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from qdem_fem.contact.search import NO_IMAGE
from qdem_fem.contact.spheres import row
from qdem_fem.contact.surface.arrays import Near, Overlaps, Surface
from qdem_fem.contact.surface.geometry import blend

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@njit(cache=True)
def grown(values: Any, count: int) -> Any:  # pragma: no cover
    """Room for twice as many."""
    longer = np.empty((2 * count, *values.shape[1:]), values.dtype)
    longer[:count] = values[:count]
    return longer


@njit(cache=True)
def boxes_of(position: Any, parts: Any) -> tuple[Any, Any]:  # pragma: no cover
    """Least and greatest corners (k, 3) of parts (k, n) of vertices."""
    low, high = np.empty((len(parts), 3)), np.empty((len(parts), 3))
    for k in range(len(parts)):
        for c in range(3):
            low[k, c] = high[k, c] = position[parts[k, 0], c]
            for i in parts[k, 1:]:
                low[k, c], high[k, c] = (
                    min(low[k, c], position[i, c]),
                    max(high[k, c], position[i, c]),
                )
    return low, high


@njit(cache=True)
def boxes_near(
    low: Any, high: Any, i: int, low_other: Any, high_other: Any, j: int, reach: float, image: Any
) -> bool:  # pragma: no cover
    """Whether two boxes are nearer than ``reach`` by every axis; the second moved by ``image``."""
    for c in range(3):
        if (
            low[i, c] - image[c] - reach > high_other[j, c]
            or low_other[j, c] - reach > high[i, c] - image[c]
        ):
            return False
    return True


@njit(cache=True)
def images_near(
    low: Any, high: Any, a: int, b: int, reach: float, way: Any
) -> tuple[int, int]:  # pragma: no cover
    """First and last n for which the box of body b, moved by n ``way``, may be near that of a."""
    for c in range(3):
        if way[c] > 0.0:
            return (
                int(np.ceil((low[a, c] - high[b, c] - reach) / way[c])),
                int(np.floor((high[a, c] - low[b, c] + reach) / way[c])),
            )
    return 0, 0


@njit(cache=True)
def points_near(
    surface: Any, position: Any, box: Any, first_point: Any, first_face: Any, reach: float,
    way: Any, seam: Any,
) -> tuple[Any, Any, Any, Any, Any]:  # fmt: skip  # pragma: no cover
    """``point``, ``body``, ``first``, ``face`` of `Near`, image of the body; ``box`` of bodies.

    ``way`` (3,) [m]: to the next image, zero where nothing is periodic; ``seam`` (b,) [m]: where
    along it a body begins that is one with its images, of which a point is near to one; else NaN.
    """
    low, high = box
    points = np.empty((len(surface.point_area), 3))
    for q in range(len(points)):
        nodes = surface.point_node[q, 0], surface.point_node[q, 1], surface.point_node[q, 2]
        points[q, 0], points[q, 1], points[q, 2] = blend(
            position, nodes, row(surface.point_share, q)
        )
    face_low, face_high = boxes_of(position, surface.face)
    found = np.empty((64, 4), np.int64)  # point, body, first face, image
    faces = np.empty(256, np.int64)
    count, total = 0, 0
    for a in range(len(low)):
        for b in range(len(low)):
            if a == b:
                continue
            least, most = images_near(low, high, a, b, reach, way)
            for n in range(least, most + 1):
                image = n * way
                if not boxes_near(low, high, a, low, high, b, reach, image):
                    continue
                for q in range(first_point[a], first_point[a + 1]):
                    if not boxes_near(points, points, q, low, high, b, reach, image):
                        continue
                    if not np.isnan(seam[b]) and image_of(points, q, seam[b], way) != n:
                        continue
                    begin = total
                    for f in range(first_face[b], first_face[b + 1]):
                        if boxes_near(points, points, q, face_low, face_high, f, reach, image):
                            if total == len(faces):
                                faces = grown(faces, total)
                            faces[total] = f
                            total += 1
                    if total > begin:
                        if count == len(found):
                            found = grown(found, count)
                        found[count, 0], found[count, 1] = q, b
                        found[count, 2], found[count, 3] = begin, n
                        count += 1
    first = np.empty(count + 1, np.int64)
    first[:count], first[count] = found[:count, 2], total
    return (
        found[:count, 0].copy(), found[:count, 1].copy(), first, faces[:total].copy(),
        found[:count, 3].copy(),
    )  # fmt: skip


@njit(cache=True)
def image_of(points: Any, q: int, seam: float, way: Any) -> int:  # pragma: no cover
    """The image of a slab that begins at ``seam`` [m] that point q is at: between its two sides."""
    for c in range(3):
        if way[c] > 0.0:
            return int(np.floor((points[q, c] - seam) / way[c]))
    return 0


@njit(cache=True)
def parts_near(
    parts: Any, position: Any, box: Any, first_part: Any, stop_part: Any, reach: float, way: Any
) -> Any:  # pragma: no cover
    """Faces or edges (k, n) of two bodies, of the first's first, and the second's image (m, 3).

    ``first_part``, ``stop_part``: first of every body, and the one behind its last.
    """
    low, high = box
    part_low, part_high = boxes_of(position, parts)
    found, count = np.empty((64, 3), np.int64), 0
    for a in range(len(low)):
        for b in range(a + 1, len(low)):
            least, most = images_near(low, high, a, b, reach, way)
            for n in range(least, most + 1):
                image = n * way
                if not boxes_near(low, high, a, low, high, b, reach, image):
                    continue
                for i in range(first_part[a], stop_part[a]):
                    if not boxes_near(part_low, part_high, i, low, high, b, reach, image):
                        continue
                    for j in range(first_part[b], stop_part[b]):
                        if boxes_near(part_low, part_high, i, part_low, part_high, j, reach, image):
                            if count == len(found):
                                found = grown(found, count)
                            found[count, 0], found[count, 1], found[count, 2] = i, j, n
                            count += 1
    return found[:count].copy()


def make_near(
    point: Integers,
    body: Integers,
    first: Integers,
    face: Integers,
    edges: Integers,
    image: Floats = NO_IMAGE,
    edge_image: Floats = NO_IMAGE,
) -> Near:
    """Lists without a history."""
    count, pairs = len(point), len(edges)
    return Near(
        point, body, first, face, np.full(count, -1.0), np.full(count, -1.0), np.zeros((count, 3)),
        image, edges, edge_image, np.full(pairs, -1.0), np.full(pairs, -1.0), np.zeros(pairs),
        np.zeros((pairs, 3)),
    )  # fmt: skip


def carry_history(old: Near, new: Near, bodies: int) -> None:
    """Take what the pairs of ``old`` remember over to the same pairs of ``new``."""
    here, there = same_keys(*(near.point * bodies + near.body for near in (old, new)))
    new.weight[there], new.spring[there] = old.weight[here], old.spring[here]
    here, there = same_pairs(old.edges, new.edges, old.edge_image, new.edge_image)
    for name in ("edge_weight", "edge_start", "edge_spring"):
        getattr(new, name)[there] = getattr(old, name)[here]


def same_keys(old: Integers, new: Integers) -> tuple[Integers, Integers]:
    """Places of the keys that are in both, in each."""
    _, here, there = np.intersect1d(old, new, assume_unique=True, return_indices=True)
    return here, there


def same_pairs(
    old: Integers, new: Integers, old_image: Floats = NO_IMAGE, new_image: Floats = NO_IMAGE
) -> tuple[Integers, Integers]:
    """Places of the pairs (m, 2) that are in both, in each; of one image (m, 3) [m], if any."""
    most = 1 + max(int(pairs.max(initial=0)) for pairs in (old, new))
    keys = [pairs[:, 0] * most + pairs[:, 1] for pairs in (old, new)]
    if new_image.ndim > 1:  # one pair may be near by several images
        both = np.concatenate([old_image, new_image]).sum(axis=1)
        number = np.unique(both, return_inverse=True)[1]
        keys = np.split(np.concatenate(keys) * (1 + number.max(initial=0)) + number, [len(keys[0])])
    return same_keys(*keys)


def make_overlaps(faces: Integers, image: Floats = NO_IMAGE) -> Overlaps:
    """Pairs of faces (m, 2) without a history."""
    count = len(faces)
    return Overlaps(
        faces, np.full(count, -1.0), np.full(count, -1.0), np.zeros((count, 3)),
        np.zeros((count, 6)), np.zeros((count, 6, 3)), np.zeros((count, 3)), image,
    )  # fmt: skip


def renew_overlaps(
    old: Overlaps, surface: Surface, position: Any, firsts: tuple[Integers, ...], reach: float,
    way: Floats, stop: Integers,
) -> Overlaps:  # fmt: skip
    """The pairs of faces for vertices at ``position`` (c, 3) [m], with the history of the old.

    ``stop`` (b,): behind the last face of each body that is no image of another.
    """
    node, face = firsts[0], firsts[1]
    low = np.minimum.reduceat(position, node[:-1])
    high = np.maximum.reduceat(position, node[:-1])
    found = parts_near(surface.face, position, (low, high), face, stop, reach, way)
    new = make_overlaps(found[:, :2].copy(), found[:, 2:] * way if way.any() else NO_IMAGE)
    here, there = same_pairs(old.faces, new.faces, old.image, new.image)
    for name in ("area", "spring", "share", "pull", "account"):
        getattr(new, name)[there] = getattr(old, name)[here]
    return new


def renew_near(
    old: Near | None, surface: Surface, position: Any, firsts: tuple[Integers, ...], reach: float,
    way: Floats, seam: Floats,
) -> Near:  # fmt: skip
    """The lists for vertices at ``position`` (c, 3) [m], with the history of the ``old`` ones.

    ``firsts``: first vertex, face, point and edge of every body, and the ends; ``way`` and ``seam``
    as of `points_near`.
    """
    node, face, point, edge = firsts
    low = np.minimum.reduceat(position, node[:-1])
    high = np.maximum.reduceat(position, node[:-1])
    *found, times = points_near(surface, position, (low, high), point, face, reach, way, seam)
    edges = parts_near(surface.edge, position, (low, high), edge, edge[1:], reach, way)
    images = (NO_IMAGE, NO_IMAGE)
    if way.any():
        images = (times[:, None] * way, edges[:, 2:] * way)
    point, body, begin, faces = found
    new = make_near(point, body, begin, faces, edges[:, :2].copy(), *images)
    if old is not None:
        carry_history(old, new, len(low))
    return new
