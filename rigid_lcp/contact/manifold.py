"""Point contacts of two polyhedra: corners on faces and crossing edges, the outer ones.

Two faces upon each other share a polygon.  Its corners are corners of one body on the face of
the other, or crossings of their edges; each is a contact with the normal and the gap of its own
two features (eq. 9), also while the faces are slightly tilted.
"""

import numpy as np
from numba import njit

from rigid_lcp.arrays import Floats, Ints
from rigid_lcp.contact.arrays import LENGTH_TIE
from rigid_lcp.contact.near_pairs import ZERO
from rigid_lcp.contact.separation import NEARLY_OPPOSITE, POLYHEDRA, Solids, cross_edges
from rigid_lcp.shapes import vectors

CORNER_FACE, FACE_CORNER, EDGES = 0, 1, 2
"""Corner of a on a face of b; corner of b on a face of a; an edge of a across one of b."""
ROOM = 256
"""Candidates looked at for one pair; there are a few dozen for grains of a hundred corners."""
CANDIDATE_COLUMNS = 10
"""Row of a candidate: kind, feature of a, feature of b, gap, normal from b to a (3), point (3)."""
SAME_CONTACT, SLOPE = POLYHEDRA.same_contact, POLYHEDRA.slope
OUTSIDE_HULL, MOST_KEPT = POLYHEDRA.outside_hull, POLYHEDRA.most_kept


@njit(cache=True)
def is_within_face(solids: Solids, body: int, face: int, x: Floats, slack: float) -> bool:
    """The point projects into the face, or no farther outside than ``slack`` [m]."""
    base = solids.first_vertex[body]
    n = solids.normal[face]
    start, stop = solids.first_corner[face], solids.first_corner[face + 1]
    for k in range(start, stop):
        p = solids.vertex[base + solids.loop[k]]
        q = solids.vertex[base + solids.loop[k + 1 if k + 1 < stop else start]]
        out = vectors.cross(vectors.subtract(q, p), n)
        beyond = vectors.dot(out, vectors.subtract(x, p))
        if beyond > slack * np.sqrt(vectors.dot(out, out)):
            return False
    return True


@njit(cache=True)
def add_candidate(
    found: Floats, count: int, kind: int, feature_a: int, feature_b: int, gap: float,
    normal: Floats, sign: float, point: Floats, same: float,
) -> int:  # fmt: skip
    """Store a candidate, unless one is there within ``same`` [m]; returns how many there are.

    Of two in one place a corner on a face stays before crossing edges, and a's before b's: their
    normals differ by no more than the tilt of the faces, and names must not change with round-off.
    """
    place = count
    for k in range(count):
        apart = vectors.subtract(found[k, 7:10], point)
        if vectors.dot(apart, apart) < same * same:
            if found[k, 0] <= kind:
                return count
            place = k
            break
    if place >= len(found):
        return count
    found[place, 0], found[place, 1], found[place, 2] = kind, feature_a, feature_b
    found[place, 3] = gap
    for axis in range(3):
        found[place, 4 + axis] = sign * normal[axis]
        found[place, 7 + axis] = point[axis]
    return max(count, place + 1)


@njit(cache=True)
def find_face_candidates(
    solids: Solids, face: int, own: int, other: int, own_is_b: bool, edges_other: Ints,
    margin: float, size: float, found: Floats,
) -> int:  # fmt: skip
    """All point contacts of ``other`` with one face of ``own``; returns how many."""
    count = int(ZERO)
    n = solids.normal[face]
    level = solids.offset[face]
    first_own, first_other = solids.first_vertex[own], solids.first_vertex[other]
    sign = 1.0 if own_is_b else -1.0
    for v in range(first_other, solids.first_vertex[other + 1]):
        x = solids.vertex[v]
        gap = vectors.dot(n, x) - level
        if gap <= margin and is_within_face(solids, own, face, x, LENGTH_TIE * size):
            here, there = v - first_other, face - solids.first_face[own]
            kind, first, second = int(CORNER_FACE), here, there
            if not own_is_b:
                kind, first, second = int(FACE_CORNER), there, here
            count = add_candidate(
                found, count, kind, first, second, gap, n, sign, x, SAME_CONTACT * size
            )
    opposite = np.cos(NEARLY_OPPOSITE)
    start, stop = solids.first_corner[face], solids.first_corner[face + 1]
    for g in range(solids.first_face[other], solids.first_face[other + 1]):
        m = solids.normal[g]
        if -vectors.dot(m, n) < opposite:
            continue
        for k in range(start, stop):
            x = solids.vertex[first_own + solids.loop[k]]
            gap = vectors.dot(m, x) - solids.offset[g]
            if gap <= margin and is_within_face(solids, other, g, x, LENGTH_TIE * size):
                here, there = g - solids.first_face[other], solids.loop[k]
                kind, first, second = int(FACE_CORNER), here, there
                if not own_is_b:
                    kind, first, second = int(CORNER_FACE), there, here
                count = add_candidate(
                    found, count, kind, first, second, gap, m, -sign, x, SAME_CONTACT * size
                )
    a, b = (other, own) if own_is_b else (own, other)
    crossing = np.empty(9)
    towards = sign * n
    for f in range(solids.first_edge[own], solids.first_edge[own + 1]):
        if not is_edge_of_face(solids, f, start, stop):
            continue
        for e in edges_other:
            edge_a, edge_b = (e, f) if own_is_b else (f, e)
            if not cross_edges(solids, a, edge_a, b, edge_b, towards, crossing):
                continue
            if not (0.0 < crossing[0] < 1.0 and 0.0 < crossing[1] < 1.0):
                continue
            normal = crossing[3:6]
            if crossing[2] > margin or vectors.dot(normal, towards) < opposite:
                continue
            if -sign * vectors.dot(normal, solids.bisector[e]) < solids.seen_about[e]:
                continue
            count = add_candidate(
                found, count, int(EDGES), edge_a - solids.first_edge[a],
                edge_b - solids.first_edge[b], crossing[2], normal, 1.0, crossing[6:9],
                SAME_CONTACT * size,
            )  # fmt: skip
    return count


@njit(cache=True)
def is_edge_of_face(solids: Solids, edge: int, start: int, stop: int) -> bool:
    """Both corners of the edge belong to the face whose corners are ``loop[start:stop]``."""
    ends = 0
    for k in range(start, stop):
        if solids.loop[k] == solids.edge[edge, 0] or solids.loop[k] == solids.edge[edge, 1]:
            ends += 1
    return ends == 2


@njit(cache=True)
def find_least_gap(found: Floats, count: int) -> float:
    """Least gap of the candidates [m]; inf without any."""
    least = np.inf
    for k in range(count):
        least = min(least, found[k, 3])
    return least


@njit(cache=True)
def find_farthest_from(found: Floats, count: int, x: Floats, tie: float) -> int:
    """Row of the candidate farthest from a point, less `SLOPE` gaps; the first within ``tie``."""
    best, most = 0, -np.inf
    for k in range(count):
        apart = vectors.subtract(found[k, 7:10], x)
        away = np.sqrt(vectors.dot(apart, apart)) - SLOPE * found[k, 3]
        if away > most + tie:
            best, most = k, away
    return best


@njit(cache=True)
def find_farthest_along(
    found: Floats, count: int, start: int, d: vectors.Vector, tie: float
) -> int:
    """Row of the candidate farthest from row ``start`` along d, less `SLOPE` gaps; -1 if none is
    beyond ``tie`` [m]."""
    best, most = -1, -np.inf
    length = np.sqrt(vectors.dot(d, d))
    step = tie * length
    for k in range(count):
        along = vectors.dot(d, vectors.subtract(found[k, 7:10], found[start, 7:10]))
        worth = along - SLOPE * length * (found[k, 3] - found[start, 3])
        if along > step and worth > most + step:
            best, most = k, worth
    return best


@njit(cache=True)
def keep_outer_rows(found: Floats, count: int, size: float, kept: Ints, number: int) -> int:
    """Add to the ``kept`` rows p, q, left, right (-1: none) those that their hull leaves out.

    Edge by edge of the hull, the candidate farthest beyond it by more than `OUTSIDE_HULL`: as a
    stone on a face of five corners may stand on any three of them.  Returns the number of rows.
    """
    ring = np.empty(MOST_KEPT, np.int64)
    corners = 0
    for row in (kept[0], kept[3], kept[1], kept[2]):  # anticlockwise about the normal
        if row >= 0:
            ring[corners] = row
            corners += 1
    normal = found[kept[0], 4:7]
    least = OUTSIDE_HULL * size
    added = True
    while added and 2 < corners < MOST_KEPT:  # every edge once a round: what is too much is spread
        added, place = False, 0
        while place < corners < MOST_KEPT:
            start, end = found[ring[place]], found[ring[(place + 1) % corners]]
            out = vectors.cross(vectors.subtract(end[7:10], start[7:10]), normal)
            length = np.sqrt(vectors.dot(out, out))
            higher = max(start[3], end[3])
            best, most = -1, least * length
            for k in range(count):
                worth = vectors.dot(out, vectors.subtract(found[k, 7:10], start[7:10]))
                worth -= SLOPE * length * max(found[k, 3] - higher, 0.0)
                if worth > most:
                    best, most = k, worth + LENGTH_TIE * size * length
            place += 1
            if best < 0:
                continue
            for k in range(corners, place, -1):
                ring[k] = ring[k - 1]
            ring[place] = kept[number] = best
            added, corners, number, place = True, corners + 1, number + 1, place + 1
    return number


@njit(cache=True)
def keep_outer(found: Floats, count: int, size: float) -> int:
    """Keep the candidates that bear in the first rows of ``found``: returns how many.

    The farthest from the middle, the farthest from that, and on either side of the line through
    both the farthest; then what lies outside of these (`keep_outer_rows`), `MOST_KEPT` in all;
    the deepest of all takes the place of the nearest of them if it is deeper.  One that is higher
    by g must be `SLOPE` g farther out to be taken: of a worn corner the ends that touch, not the
    one beside them.  Lengths within `LENGTH_TIE` of each other count as equal: the first is
    taken.
    """
    if count <= 4:
        return count
    tie = LENGTH_TIE * size
    middle = np.zeros(3)
    deepest = 0
    for k in range(count):
        for axis in range(3):
            middle[axis] += found[k, 7 + axis] / count
        if found[k, 3] < found[deepest, 3] - tie:
            deepest = k
    p = find_farthest_from(found, count, middle, tie)
    q = find_farthest_from(found, count, found[p, 7:10], tie)
    d = vectors.cross(found[p, 4:7], vectors.subtract(found[q, 7:10], found[p, 7:10]))
    rows = np.empty(MOST_KEPT + 4, np.int64)
    rows[0], rows[1] = p, q
    rows[2] = find_farthest_along(found, count, p, d, tie)
    rows[3] = find_farthest_along(found, count, p, (-d[0], -d[1], -d[2]), tie)
    all_rows = keep_outer_rows(found, count, size, rows, 4)
    kept = np.empty((all_rows, CANDIDATE_COLUMNS))
    number, nearest, least, lowest = 0, 0, np.inf, np.inf
    for row in rows[:all_rows]:
        if row < 0:
            continue
        kept[number] = found[row]
        apart = vectors.subtract(found[row, 7:10], found[deepest, 7:10])
        squares = vectors.dot(apart, apart)
        if squares < least:
            nearest, least = number, squares
        lowest = min(lowest, found[row, 3])
        number += 1
    if found[deepest, 3] < lowest - tie:
        kept[nearest] = found[deepest]
    found[:number] = kept[:number]
    return number
