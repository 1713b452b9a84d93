"""Contacts in the plane: which pairs are near, and the point contacts of every pair (eq. 9).

Every point contact is a vertex (or a disc's centre) of one body against a face (or a vertex, or a
centre) of another.  Two faces that lie upon each other make two of them, at the ends of the piece
they share (Fig. 2, right); a vertex on a half-space is one each.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit

from rigid_lcp.arrays import Bools, Floats, Ints
from rigid_lcp.contact import near_pairs
from rigid_lcp.contact.arrays import FEATURE_BITS, LENGTH_TIE, Contacts, pack_key
from rigid_lcp.contact.parting_faces import choose_face
from rigid_lcp.errors import SceneError
from rigid_lcp.shapes import Disc, HalfSpace, Polygon


@dataclass(frozen=True)
class Shapes2D:
    """Shapes of all bodies in flat arrays, in their own frames: what the kernels read."""

    kind: Ints
    first: Ints  # where the vertices of each body start, (n + 1,)
    vertices: Floats
    """Vertices of all polygons, and the normal of each half-space in place of one, (m, 2)."""
    normals: Floats  # outward normals of the faces that start at these vertices, (m, 2)
    radius: Floats  # radius of a disc, offset of a half-space, reach of a polygon [m]
    movable: Bools  # pairs of bodies that can not move are never looked at


def pack_shapes_2d(
    shapes: Sequence[object], movable: Bools, called: Callable[[int], str] = "body {}".format
) -> Shapes2D:
    """Flat arrays of polygons, discs and half-spaces; `SceneError` for any other shape.

    ``called``: the name of a body for messages, by its number.
    """
    kind, first, vertices, normals, radius = [], [0], [], [], []
    for number, shape in enumerate(shapes):
        if isinstance(shape, Polygon):
            kind.append(near_pairs.POLYGON)
            corners, outward, size = shape.vertices, shape.normals, shape.reach
        elif isinstance(shape, Disc):
            kind.append(near_pairs.DISC)
            corners, outward, size = np.zeros((0, 2)), np.zeros((0, 2)), shape.radius
        elif isinstance(shape, HalfSpace) and shape.dim == 2:
            kind.append(near_pairs.HALF_SPACE)
            corners, outward, size = shape.normal[None], shape.normal[None], shape.offset
        else:
            raise SceneError(
                f"it is no shape of the plane ({type(shape).__name__})", where=called(number),
                remedy="use Polygon, Disc or HalfSpace with a normal of two numbers",
            )  # fmt: skip
        if len(corners) >= 1 << FEATURE_BITS:
            raise SceneError(
                f"it has {len(corners)} vertices", where=called(number),
                remedy=f"use fewer than {1 << FEATURE_BITS}, or a disc",
            )  # fmt: skip
        vertices.append(corners)
        normals.append(outward)
        radius.append(size)
        first.append(first[-1] + len(corners))
    return Shapes2D(
        np.array(kind, dtype=np.int64), np.array(first, dtype=np.int64),
        np.concatenate([*vertices, np.zeros((0, 2))]), np.concatenate([*normals, np.zeros((0, 2))]),
        np.array(radius, dtype=float), np.asarray(movable, dtype=bool),
    )  # fmt: skip


def detect_2d(
    shapes: Shapes2D, position: Floats, angle: Floats, margin: Floats | float,
    drift: Floats | None = None,
) -> Contacts:  # fmt: skip
    """All point contacts with ``gap <= margin[a] + margin[b]``.

    ``position`` (n, 2) [m], ``angle`` (n,) [rad]; ``margin`` [m] one number or (n,); ``drift``
    (n, 3): how bodies will move on [m, rad], which chooses among faces that part a pair
    (`rigid_lcp.contact.parting_faces`).  The order of the contacts depends on the numbers of the
    bodies only.  Friction and restitution are zero: they belong to the scene.
    """
    margins = np.full(len(shapes.kind), margin, dtype=float)
    position = np.ascontiguousarray(position)
    vertices, normals = near_pairs.place_shapes(
        shapes.kind, shapes.first, shapes.vertices, shapes.normals, position, angle
    )
    boxes = near_pairs.bound_shapes(shapes.first, vertices, shapes.radius, position, margins)
    pairs = near_pairs.find_near_pairs(shapes.kind, boxes, shapes.movable)
    bodies, numbers, key = find_pair_contacts(
        pairs, shapes.kind, shapes.first, vertices, normals, shapes.radius, position, margins,
        np.zeros((len(position), 3)) if drift is None else drift,
    )  # fmt: skip
    columns = near_pairs.order_contacts(shapes.kind, bodies, numbers, key)
    zero, edges = np.zeros((2, len(key))), np.zeros((2, len(key), 2))
    return Contacts(*columns, zero[0], zero[1], edges[0], edges[1])


@njit(cache=True)
def find_widest_face(own: Floats, normals: Floats, other: Floats) -> tuple[int, float]:
    """Face whose line separates the other polygon most, and by how much [m]: the gap if > 0."""
    best, separation = 0, -np.inf
    for face in range(len(own)):
        nearest = np.inf
        for v in range(len(other)):
            nearest = min(
                nearest,
                normals[face, 0] * (other[v, 0] - own[face, 0])
                + normals[face, 1] * (other[v, 1] - own[face, 1]),
            )
        if nearest > separation:
            best, separation = face, nearest
    return best, separation


@njit(cache=True)
def _store_row(rows: Floats, row: int, side: int, vertex: int, face: int, gap: float) -> None:
    rows[row, 0], rows[row, 1], rows[row, 2], rows[row, 3] = side, vertex, face, gap


@njit(cache=True)
def find_face_contacts(
    face_own: Floats, face_normals: Floats, face: int, own: Floats, normals: Floats,
    margin: float, tie: float, chosen: bool, found: Floats,
) -> int:  # fmt: skip
    """Contacts of a polygon with ``face`` of another, at most two: returns how many.

    The candidates are the ends of the opposite face above ``face``, and the ends of ``face`` below
    the opposite one; those farthest apart along the face are kept.  Row of ``found``: 0 where the
    vertex is the other polygon's (1 where it is an end of ``face``), vertex, face, gap.  Where
    there is none, and the bodies overlap or the face was ``chosen``, the nearest vertex is one.
    """
    n, corner = face_normals[face], face_own[face]
    ends = (face, (face + 1) % len(face_own))
    t0, t1 = -n[1], n[0]
    length = t0 * (face_own[ends[1], 0] - corner[0]) + t1 * (face_own[ends[1], 1] - corner[1])
    none = opposite = int(near_pairs.ZERO)
    steepest = np.inf
    for k in range(len(own)):
        cosine = n[0] * normals[k, 0] + n[1] * normals[k, 1]
        if cosine < steepest:
            opposite, steepest = k, cosine
    m, base = normals[opposite], own[opposite]
    tips = (opposite, (opposite + 1) % len(own))
    span = -m[1] * (own[tips[1], 0] - base[0]) + m[0] * (own[tips[1], 1] - base[1])
    place, candidate = np.empty(4), np.empty((4, 4))
    count, deepest, lowest = none, none, np.inf
    for side in range(2):
        for end in range(2):
            if side == 0:
                vertex, other = tips[end], face
                x, y = own[vertex, 0] - corner[0], own[vertex, 1] - corner[1]
                gap, along, limit = n[0] * x + n[1] * y, t0 * x + t1 * y, length
                place[count] = along
                if gap < lowest:
                    deepest, lowest = vertex, gap
            else:
                vertex, other = ends[end], opposite
                x, y = face_own[vertex, 0] - base[0], face_own[vertex, 1] - base[1]
                gap, along, limit = m[0] * x + m[1] * y, -m[1] * x + m[0] * y, span
                place[count] = length * end
            if gap <= margin and -tie <= along <= limit + tie:
                _store_row(candidate, count, side, vertex, other, gap)
                count += 1
    if count > 0:
        low = high = 0
        for k in range(1, count):
            if place[k] < place[low] - tie:
                low = k
            if place[k] > place[high] + tie:
                high = k
        found[0], found[1] = candidate[low], candidate[high]
        return 1 if low == high else 2
    if lowest < 0.0 or (chosen and lowest <= margin):  # corner over corner, wherever it is
        _store_row(found, none, none, deepest, face, lowest)
        return 1
    return 0


@njit(cache=True)
def find_pair_contacts(
    pairs: Ints, kind: Ints, first: Ints, vertices: Floats, normals: Floats, radius: Floats,
    position: Floats, margins: Floats, drift: Floats,
) -> tuple[Ints, Floats, Ints]:  # fmt: skip
    """Contacts of the pairs: bodies (nc, 2), numbers (nc, 7), keys (nc,).

    A row of numbers: point (2), normal (2), gap, radii of curvature of a and b.  Pairs that several
    faces part wait until the others' contacts are known (`rigid_lcp.contact.parting_faces`).
    """
    room = 0
    for i, j in pairs:
        room += first[i + 1] - first[i] + 1 if kind[j] == near_pairs.HALF_SPACE else 2
    bodies, numbers = np.empty((room, 2), np.int64), np.empty((room, 7))
    key = np.empty(room, np.int64)
    found = np.empty((2, 4))
    c = none = int(near_pairs.ZERO)
    late = np.zeros(len(pairs), np.bool_)
    for turn in range(2 * len(pairs)):
        p = turn % len(pairs)
        if late[p] != (turn >= len(pairs)):
            continue
        i, j = pairs[p]
        margin = margins[i] + margins[j]
        if kind[j] == near_pairs.HALF_SPACE:
            n, offset = normals[first[j]], radius[j]
            if kind[i] == near_pairs.DISC:
                x, y = position[i]
                gap = n[0] * x + n[1] * y - offset - radius[i]
                if gap <= margin:
                    bodies[c, 0], bodies[c, 1], key[c] = i, j, pack_key(i, j, none, none)
                    _store(numbers, c, x - radius[i] * n[0], y - radius[i] * n[1], n[0], n[1], gap,
                           radius[i], np.inf)  # fmt: skip
                    c += 1
                continue
            for v in range(first[i], first[i + 1]):
                x, y = vertices[v]
                gap = n[0] * x + n[1] * y - offset
                if gap <= margin:
                    bodies[c, 0], bodies[c, 1], key[c] = i, j, pack_key(i, j, v - first[i], none)
                    _store(numbers, c, x, y, n[0], n[1], gap, 0.0, np.inf)
                    c += 1
        elif kind[i] == near_pairs.POLYGON and kind[j] == near_pairs.POLYGON:
            vi, ni = vertices[first[i] : first[i + 1]], normals[first[i] : first[i + 1]]
            vj, nj = vertices[first[j] : first[j + 1]], normals[first[j] : first[j + 1]]
            face_i, gap_i = find_widest_face(vi, ni, vj)
            if gap_i > margin:
                continue
            face_j, gap_j = find_widest_face(vj, nj, vi)
            if gap_j > margin:
                continue
            tie = LENGTH_TIE * min(radius[i], radius[j])
            upper, lower, face, gap, chosen = i, j, face_j, gap_j, False
            if gap_i >= gap_j - tie:
                upper, lower, face, gap = j, i, face_i, gap_i
            if gap >= -max(margin, tie):
                oi, oj = (ni * vi).sum(axis=1), (nj * vj).sum(axis=1)
                two, sign = np.array([i, j]), 1.0 if lower == j else -1.0
                widest = sign * (nj if lower == j else ni)[face]
                side, better = choose_face(
                    ni, oi, vi, nj, oj, vj, position[two], drift[two], widest, gap, tie,
                    max(margin, tie), bodies, numbers, c if late[p] else -1, i, j,
                )  # fmt: skip
                if side >= 0 and not late[p]:
                    late[p] = True
                    continue
                if side >= 0:
                    face, chosen = better, True
                    upper, lower = (i, j) if side == 1 else (j, i)
            if lower == j:
                count = find_face_contacts(vj, nj, face, vi, ni, margin, tie, chosen, found)
            else:
                count = find_face_contacts(vi, ni, face, vj, nj, margin, tie, chosen, found)
            for k in range(count):
                a, b = (upper, lower) if found[k, 0] == 0.0 else (lower, upper)
                vertex, face = int(found[k, 1]), int(found[k, 2])
                x, y = vertices[first[a] + vertex]
                n = normals[first[b] + face]
                bodies[c, 0], bodies[c, 1], key[c] = a, b, pack_key(a, b, vertex, face)
                _store(numbers, c, x, y, n[0], n[1], found[k, 3], 0.0, np.inf)
                c += 1
        elif kind[i] == near_pairs.DISC and kind[j] == near_pairs.DISC:
            c += _find_round_contact(i, j, position[i], position[j], radius[i], radius[j], none,
                                margin, c, bodies, numbers, key)  # fmt: skip
        else:
            disc, grain = (i, j) if kind[i] == near_pairs.DISC else (j, i)
            x, y = position[disc]
            own = vertices[first[grain] : first[grain + 1]]
            outward = normals[first[grain] : first[grain + 1]]
            face, distance = find_widest_face(own, outward, position[disc : disc + 1])
            if distance - radius[disc] > margin:
                continue
            n, following = outward[face], (face + 1) % len(own)
            start = -n[1] * (x - own[face, 0]) + n[0] * (y - own[face, 1])
            left = -n[1] * (x - own[following, 0]) + n[0] * (y - own[following, 1])
            if distance > 0.0 and (start < 0.0 or left > 0.0):
                corner = face if start < 0.0 else following
                c += _find_round_contact(disc, grain, position[disc], own[corner], radius[disc],
                                    0.0, corner, margin, c, bodies, numbers, key)  # fmt: skip
                continue
            # A key with a vertex of one beyond the last: a face is no vertex.
            bodies[c, 0], bodies[c, 1] = disc, grain
            key[c] = pack_key(disc, grain, none + 1, face)
            _store(numbers, c, x - radius[disc] * n[0], y - radius[disc] * n[1], n[0], n[1],
                   distance - radius[disc], radius[disc], np.inf)  # fmt: skip
            c += 1
    return bodies[:c], numbers[:c], key[:c]


@njit(cache=True)
def _store(
    numbers: Floats, c: int, x: float, y: float, n0: float, n1: float, gap: float, ra: float,
    rb: float,
) -> None:  # fmt: skip
    numbers[c, 0], numbers[c, 1], numbers[c, 2], numbers[c, 3] = x, y, n0, n1
    numbers[c, 4], numbers[c, 5], numbers[c, 6] = gap, ra, rb


@njit(cache=True)
def _find_round_contact(
    a: int, b: int, centre_a: Floats, centre_b: Floats, radius_a: float, radius_b: float,
    corner: int, margin: float, c: int, bodies: Ints, numbers: Floats, key: Ints,
) -> int:  # fmt: skip
    """Stores the contact of two circles (one may be a vertex, of radius 0) if they are near."""
    x, y = centre_a[0] - centre_b[0], centre_a[1] - centre_b[1]
    distance = np.hypot(x, y)
    if distance - radius_a - radius_b > margin:
        return 0
    n0, n1 = (x / distance, y / distance) if distance > 0.0 else (0.0, 1.0)
    bodies[c, 0], bodies[c, 1], key[c] = a, b, pack_key(a, b, int(near_pairs.ZERO), corner)
    _store(numbers, c, centre_a[0] - radius_a * n0, centre_a[1] - radius_a * n1, n0, n1,
           distance - radius_a - radius_b, radius_a, radius_b)  # fmt: skip
    return 1
