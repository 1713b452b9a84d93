"""Contacts in space: which pairs are near, and the point contacts of every pair (eq. 9).

Polyhedra: corners on faces and crossing edges, else on edges and corners, of each pair the outer
ones (`rigid_lcp.contact.solids`); spheres: the nearest point of the other body, in closed form.
"""

import numpy as np
from numba import njit

from rigid_lcp.arrays import Floats, Ints
from rigid_lcp.contact import manifold
from rigid_lcp.contact.arrays import FEATURE_BITS, LENGTH_TIE, Contacts, pack_key
from rigid_lcp.contact.near_pairs import (
    HALF_SPACE,
    ZERO,
    bound_shapes,
    find_near_pairs,
    order_contacts,
)
from rigid_lcp.contact.placed_solids import MOST_EDGES, POLYHEDRON, SPHERE, Shapes3D, place_solids
from rigid_lcp.contact.separation import Solids
from rigid_lcp.contact.solids import CORNER_EDGE, CORNERS, EDGE_CORNER, find_solid_contacts
from rigid_lcp.shapes import vectors


@njit(cache=True)
def touch_sphere_sphere(x: Floats, radius: float, y: Floats, other: float, row: Floats) -> int:
    """Eq. 8 for centres x (sphere a) and y (b); concentric ones are parted along z.

    Fills ``row`` as `touch_sphere_solid` does; returns 0, the only feature a sphere has.
    """
    _fill_round(row, x, radius, vectors.subtract(x, y), other)
    return 0


@njit(cache=True)
def touch_sphere_plane(solids: Solids, plane: int, x: Floats, radius: float, row: Floats) -> int:
    """Gap of a sphere over a half-space; fills ``row``, returns the feature 0."""
    face = solids.first_face[plane]
    n = vectors.read(solids.normal, face)
    _fill(row, x, radius, n, vectors.dot(n, x) - solids.offset[face] - radius, np.inf)
    return 0


@njit(cache=True)
def touch_sphere_solid(solids: Solids, body: int, x: Floats, radius: float, row: Floats) -> int:
    """Contact of a sphere (body a) with the nearest point of a polyhedron (body b).

    ``row`` is filled with point (3), normal (3), gap, radii of curvature of a and b, b's zero for
    a corner or an edge.  A centre inside the polyhedron leaves through the nearest face.  Returns
    the number of the feature: faces first, then edges, then corners.
    """
    first_face, first_edge = solids.first_face[body], solids.first_edge[body]
    faces = solids.first_face[body + 1] - first_face
    edges = solids.first_edge[body + 1] - first_edge
    best, separation = first_face, -np.inf
    for f in range(first_face, first_face + faces):
        distance = vectors.dot(solids.normal[f], x) - solids.offset[f]
        if distance > separation:
            best, separation = f, distance
    if separation <= 0.0 or manifold.is_within_face(solids, body, best, x, 0.0):
        normal = vectors.read(solids.normal, best)
        _fill(row, x, radius, normal, separation - radius, np.inf)
        return best - first_face
    feature, nearest = 0, np.inf
    base = solids.first_vertex[body]
    away = (0.0, 0.0, 0.0)
    for e in range(first_edge, first_edge + edges):
        p = solids.vertex[base + solids.edge[e, 0]]
        u = vectors.subtract(solids.vertex[base + solids.edge[e, 1]], p)
        along = vectors.dot(u, vectors.subtract(x, p))
        place = min(max(along / vectors.dot(u, u), 0.0), 1.0)
        apart = vectors.subtract(x, vectors.add(p, place, u))
        squares = vectors.dot(apart, apart)
        if squares < nearest:
            nearest, away = squares, apart
            feature = faces + e - first_edge
            if place == 0.0 or place == 1.0:
                feature = faces + edges + solids.edge[e, int(place)]
    _fill_round(row, x, radius, away, 0.0)
    return feature


@njit(cache=True)
def _fill_round(row: Floats, x: Floats, radius: float, away: vectors.Vector, other: float) -> None:
    """Store the contact with a sphere, or a point of radius 0, that x is ``away`` from; along z
    where it is not."""
    distance = np.sqrt(vectors.dot(away, away))
    normal = vectors.divide(away, distance) if distance > 0.0 else (0.0, 0.0, 1.0)
    _fill(row, x, radius, normal, distance - radius - other, other)


@njit(cache=True)
def _fill(
    row: Floats, x: Floats, radius: float, normal: vectors.Vector, gap: float, curvature: float
) -> None:
    """Store point on the sphere, normal, gap and radii of curvature."""
    for axis in range(3):
        row[axis] = x[axis] - radius * normal[axis]
        row[3 + axis] = normal[axis]
    row[6], row[7], row[8] = gap, radius, curvature


def detect_3d(
    shapes: Shapes3D, position: Floats, quaternion: Floats, margin: Floats | float,
    drift: Floats | None = None,
) -> Contacts:  # fmt: skip
    """All point contacts with ``gap <= margin[a] + margin[b]``.

    ``position`` (n, 3) [m], ``quaternion`` (n, 4), unit; ``margin`` [m] one number or (n,);
    ``drift`` (n, 6): how bodies will move on [m, rad], which chooses among faces that part a pair
    (`rigid_lcp.contact.parting_faces`).  The order of the contacts depends on the numbers of the
    bodies only.  Friction and restitution are zero: they belong to the scene.
    """
    margins = np.full(len(shapes.kind), margin, dtype=float)
    position = np.ascontiguousarray(position, dtype=float)
    solids = place_solids(shapes, position, quaternion)
    boxes = bound_shapes(solids.first_vertex, solids.vertex, shapes.reach, position, margins)
    pairs = find_near_pairs(shapes.kind, boxes, shapes.movable)
    bodies, numbers, key = find_pair_contacts(
        pairs, shapes.kind, solids, shapes.reach, position, margins, boxes,
        np.zeros((len(position), 6)) if drift is None else drift,
    )  # fmt: skip
    columns = order_contacts(shapes.kind, bodies, numbers, key)
    zero = np.zeros((2, len(key)))
    edges = find_edge_directions(shapes.kind, solids, columns[0], columns[1], columns[5])
    return Contacts(*columns, zero[0], zero[1], edges[0], edges[1])


@njit(cache=True)
def find_edge_directions(
    kind: Ints, solids: Solids, body_a: Ints, body_b: Ints, key: Ints
) -> Floats:
    """Unit directions (2, nc, 3) of the edges of a and of b that the contacts' names tell of.

    Zero at corners, faces and spheres.
    """
    directions = np.zeros((2, len(key), 3))
    for c in range(len(key)):
        a, b = body_a[c], body_b[c]
        if kind[b] != POLYHEDRON:
            continue
        edge_a, edge_b = -1, -1
        if kind[a] == SPHERE:  # it has no features of its own: faces, then edges, then corners of b
            past_faces = (key[c] & ((1 << 2 * FEATURE_BITS) - 1)) - (
                solids.first_face[b + 1] - solids.first_face[b]
            )
            if past_faces < solids.first_edge[b + 1] - solids.first_edge[b]:
                edge_b = past_faces
        else:
            edge_a = ((key[c] >> FEATURE_BITS) & (2 * MOST_EDGES - 1)) - MOST_EDGES
            edge_b = (key[c] & (2 * MOST_EDGES - 1)) - MOST_EDGES
        for side, body, edge in ((0, a, edge_a), (1, b, edge_b)):
            if edge >= 0:
                ends, first = solids.edge[solids.first_edge[body] + edge], solids.first_vertex[body]
                start = solids.vertex[first + ends[0]]
                along = vectors.subtract(solids.vertex[first + ends[1]], start)
                length = np.sqrt(vectors.dot(along, along))
                for axis in range(3):
                    directions[side, c, axis] = along[axis] / length
    return directions


@njit(cache=True)
def find_pair_contacts(
    pairs: Ints, kind: Ints, solids: Solids, reach: Floats, position: Floats, margins: Floats,
    boxes: Floats, drift: Floats,
) -> tuple[Ints, Floats, Ints]:  # fmt: skip
    """Contacts of the pairs: bodies (nc, 2), numbers (nc, 9), keys (nc,).

    A row of numbers: point (3), normal (3), gap, radii of curvature of a and b.  Pairs that several
    faces part wait until the others' contacts are known (`rigid_lcp.contact.parting_faces`).
    """
    room = manifold.MOST_KEPT * len(pairs)
    bodies, numbers = np.empty((room, 2), np.int64), np.empty((room, 9))
    key = np.empty(room, np.int64)
    found = np.empty((manifold.ROOM, manifold.CANDIDATE_COLUMNS))
    c = none = int(ZERO)
    late = np.zeros(len(pairs), np.bool_)
    for turn in range(2 * len(pairs)):
        p = turn % len(pairs)
        if late[p] != (turn >= len(pairs)):
            continue
        i, j = pairs[p]
        margin = margins[i] + margins[j]
        if kind[i] == SPHERE or kind[j] == SPHERE:
            sphere, other = (i, j) if kind[i] == SPHERE else (j, i)
            x, radius, row = position[sphere], reach[sphere], numbers[c]
            if kind[other] == SPHERE:
                feature = touch_sphere_sphere(x, radius, position[other], reach[other], row)
            elif kind[other] == HALF_SPACE:
                feature = touch_sphere_plane(solids, other, x, radius, row)
            else:
                feature = touch_sphere_solid(solids, other, x, radius, row)
            if row[6] <= margin:
                bodies[c, 0], bodies[c, 1] = sphere, other
                key[c] = pack_key(sphere, other, none, none) + feature
                c += 1
            continue
        if kind[j] == HALF_SPACE:
            height = vectors.dot(solids.normal[solids.first_face[j]], position[i]) - reach[j]
            if height > margin + (1.0 + LENGTH_TIE) * reach[i]:
                continue
            count = find_corners_on_plane(solids, i, j, margin, reach[i], found)
        else:
            size = min(reach[i], reach[j])
            two = np.array([i, j])
            count = find_solid_contacts(
                solids, i, j, boxes[i], boxes[j], margin, size, position[two], drift[two], bodies,
                numbers, c if late[p] else -1, found,
            )  # fmt: skip
            if count < 0:
                late[p] = True
                continue
        for k in range(count):
            form, first, second = int(found[k, 0]), int(found[k, 1]), int(found[k, 2])
            a, b, sign = i, j, 1.0
            if form in (manifold.FACE_CORNER, EDGE_CORNER):  # the corner is body j's
                a, b, sign, first, second = j, i, -1.0, second, first
            if form == manifold.EDGES:
                first, second = first + MOST_EDGES, second + MOST_EDGES
            elif form in (CORNER_EDGE, EDGE_CORNER):
                second += MOST_EDGES
            elif form == CORNERS:
                second += solids.first_face[j + 1] - solids.first_face[j]
            bodies[c, 0], bodies[c, 1] = a, b
            key[c] = pack_key(a, b, first, second)
            for axis in range(3):
                numbers[c, axis] = found[k, 7 + axis]
                numbers[c, 3 + axis] = sign * found[k, 4 + axis]
            numbers[c, 6], numbers[c, 7] = found[k, 3], 0.0
            numbers[c, 8] = np.inf if form <= manifold.EDGES else 0.0
            c += 1
    return bodies[:c], numbers[:c], key[:c]


@njit(cache=True)
def find_corners_on_plane(
    solids: Solids, body: int, plane: int, margin: float, size: float, found: Floats
) -> int:
    """Corners of a polyhedron near a half-space, the outer ones; returns how many."""
    count, kind = int(ZERO), int(manifold.CORNER_FACE)
    face = solids.first_face[plane]
    n, level, first = solids.normal[face], solids.offset[face], solids.first_vertex[body]
    for v in range(first, solids.first_vertex[body + 1]):
        x = solids.vertex[v]
        gap = vectors.dot(n, x) - level
        if gap <= margin:
            count = manifold.add_candidate(
                found, count, kind, v - first, int(ZERO), gap, n, 1.0, x, LENGTH_TIE * size
            )
    return manifold.keep_outer(found, count, size)
