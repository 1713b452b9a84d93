"""Which points may be in which faces, and which edges across which: boxes of bodies, then of parts.

The lists are good until a vertex has moved half the skin.  They stand in the order of bodies,
points and faces, whatever moved before.
"""

from typing import Any

import numpy as np
from numba import njit

from qdem_fem.contact.search import grow_array
from qdem_fem.contact.surface.arrays import Near, Surface
from qdem_fem.contact.surface.geometry import blend
from qdem_fem.files import Integers
from qdem_fem.kernel import read_row


@njit(cache=True)
def make_boxes_of(position: Any, parts: Any) -> tuple[Any, Any]:  # pragma: no cover
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
def are_boxes_near(
    low: Any, high: Any, i: int, low_other: Any, high_other: Any, j: int, reach: float
) -> bool:  # pragma: no cover
    """Whether two boxes are nearer than ``reach`` by every axis."""
    for c in range(3):
        if low[i, c] - reach > high_other[j, c] or low_other[j, c] - reach > high[i, c]:
            return False
    return True


@njit(cache=True)
def find_points_nearby(
    surface: Any, position: Any, box: Any, first_point: Any, first_face: Any, reach: float
) -> tuple[Any, Any, Any, Any]:  # pragma: no cover
    """``point``, ``body``, ``first``, ``face`` of `Near`; ``box`` of bodies."""
    low, high = box
    points = np.empty((len(surface.point_area), 3))
    for q in range(len(points)):
        nodes = surface.point_node[q, 0], surface.point_node[q, 1], surface.point_node[q, 2]
        points[q, 0], points[q, 1], points[q, 2] = blend(
            position, nodes, read_row(surface.point_share, q)
        )
    face_low, face_high = make_boxes_of(position, surface.face)
    found = np.empty((64, 3), np.int64)  # point, body, first face
    faces = np.empty(256, np.int64)
    count, total = 0, 0
    for a in range(len(low)):
        for b in range(len(low)):
            if a == b or not are_boxes_near(low, high, a, low, high, b, reach):
                continue
            for q in range(first_point[a], first_point[a + 1]):
                if not are_boxes_near(points, points, q, low, high, b, reach):
                    continue
                begin = total
                for f in range(first_face[b], first_face[b + 1]):
                    if are_boxes_near(points, points, q, face_low, face_high, f, reach):
                        if total == len(faces):
                            faces = grow_array(faces, total + 1)
                        faces[total] = f
                        total += 1
                if total > begin:
                    if count == len(found):
                        found = grow_array(found, count + 1)
                    found[count, 0], found[count, 1], found[count, 2] = q, b, begin
                    count += 1
    first = np.empty(count + 1, np.int64)
    first[:count], first[count] = found[:count, 2], total
    return found[:count, 0].copy(), found[:count, 1].copy(), first, faces[:total].copy()


@njit(cache=True)
def find_edges_nearby(
    edge: Any, position: Any, box: Any, first_edge: Any, reach: float
) -> Any:  # pragma: no cover
    """Edges of two bodies, of the first's first, (m, 2)."""
    low, high = box
    edge_low, edge_high = make_boxes_of(position, edge)
    found, count = np.empty((64, 2), np.int64), 0
    for a in range(len(low)):
        for b in range(a + 1, len(low)):
            if not are_boxes_near(low, high, a, low, high, b, reach):
                continue
            for i in range(first_edge[a], first_edge[a + 1]):
                if not are_boxes_near(edge_low, edge_high, i, low, high, b, reach):
                    continue
                for j in range(first_edge[b], first_edge[b + 1]):
                    if are_boxes_near(edge_low, edge_high, i, edge_low, edge_high, j, reach):
                        if count == len(found):
                            found = grow_array(found, count + 1)
                        found[count, 0], found[count, 1] = i, j
                        count += 1
    return found[:count].copy()


def make_near(
    point: Integers, body: Integers, first: Integers, face: Integers, edges: Integers
) -> Near:
    """Lists without a history."""
    count, pairs = len(point), len(edges)
    return Near(
        point, body, first, face, np.full(count, -1.0), np.full(count, -1.0), np.zeros((count, 3)),
        edges, np.full(pairs, -1.0), np.full(pairs, -1.0), np.zeros(pairs), np.zeros((pairs, 3)),
    )  # fmt: skip


def carry_history(old: Near, new: Near, bodies: int) -> None:
    """Take what the pairs of ``old`` remember over to the same pairs of ``new``."""
    points = [near.point * bodies + near.body for near in (old, new)]
    most = 1 + max(int(near.edges.max(initial=0)) for near in (old, new))
    edges = [near.edges[:, 0] * most + near.edges[:, 1] for near in (old, new)]
    for keys, names in (
        (points, ("weight", "spring")),
        (edges, ("edge_weight", "edge_start", "edge_spring")),
    ):
        before, now = keys
        _, here, there = np.intersect1d(before, now, assume_unique=True, return_indices=True)
        for name in names:
            getattr(new, name)[there] = getattr(old, name)[here]


def renew_near(
    old: Near, surface: Surface, position: Any, firsts: tuple[Integers, ...], reach: float
) -> Near:
    """The lists for vertices at ``position`` (c, 3) [m], with the history of the ``old`` ones.

    ``firsts``: first vertex, face, point and edge of every body, and the ends.
    """
    node, face, point, edge = firsts
    low = np.minimum.reduceat(position, node[:-1])
    high = np.maximum.reduceat(position, node[:-1])
    found = find_points_nearby(surface, position, (low, high), point, face, reach)
    new = make_near(*found, find_edges_nearby(surface.edge, position, (low, high), edge, reach))
    carry_history(old, new, len(low))
    return new
