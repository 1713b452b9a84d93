"""All point contacts of two polyhedra: the features that keep them apart say which (eqs 8 and 9).

The greatest separation along the normal of a face, or across two edges, is the distance, and these
features make the contacts (`rigid_lcp.contact.manifold`), unless corners are nearest: then it is
less than the distance, no candidate is as near as it says, and the nearest corner makes one too.
Where the nearest features are a corner and an edge, or two corners, no face and no pair of crossing
edges names the normal: it lies along the line of nearest points, as between two spheres of radius
zero.  The plane across it through either point parts the two bodies, so bodies that do not approach
along it can not meet by translation.  At touch (within `rigid_lcp.contact.arrays.LENGTH_TIE`)
the normal is that of the face that keeps the bodies farthest apart, which it also is once they
overlap: the gap is continuous there; a normal, as that of the distance to a point, can not be.
"""

import numpy as np
from numba import njit

from rigid_lcp.arrays import Floats, Ints
from rigid_lcp.contact.arrays import LENGTH_TIE
from rigid_lcp.contact.manifold import (
    CORNER_FACE,
    EDGES,
    FACE_CORNER,
    SAME_CONTACT,
    add_candidate,
    find_face_candidates,
    find_least_gap,
    keep_outer,
)
from rigid_lcp.contact.near_pairs import ZERO
from rigid_lcp.contact.parting_faces import choose_face
from rigid_lcp.contact.separation import (
    NEARLY_OPPOSITE,
    Solids,
    cross_edges,
    find_near_edges,
    separate_edges,
    separate_faces,
)
from rigid_lcp.shapes import vectors

CORNER_EDGE, EDGE_CORNER, CORNERS = 3, 4, 5
"""Corner of a on an edge of b; corner of b on an edge of a; corner on corner."""
PAIRS = 64
"""Pairs of a corner and an edge kept for two bodies; some contacts of them are."""
PAIR_COLUMNS = 8
"""Row of a pair: distance, corner, edge, the end of the edge that is nearest (-1: neither), 1 if
the corner is a's (-1: b's), vector from b's point to a's (3)."""


@njit(cache=True)
def list_corner_edge_pairs(
    solids: Solids, own: int, other: int, edges_other: Ints, sign: float, within: float,
    tie: float, pairs: Floats, count: int,
) -> int:  # fmt: skip
    """Corners of ``own`` no farther than ``within`` [m] from edges of ``other``, into ``pairs``.

    The nearest of all is row 0, whatever there is room for; of two within ``tie`` [m] the first.
    ``sign`` is 1 where own is body a.  Returns how many rows there are.
    """
    base, corners = solids.first_vertex[other], solids.first_vertex[own]
    for e in edges_other:
        p = solids.vertex[base + solids.edge[e, 0]]
        u = vectors.subtract(solids.vertex[base + solids.edge[e, 1]], p)
        squares = vectors.dot(u, u)
        for v in range(corners, solids.first_vertex[own + 1]):
            d = vectors.subtract(solids.vertex[v], p)
            place = min(max(vectors.dot(d, u) / squares, 0.0), 1.0)
            d = vectors.add(d, -place, u)
            distance = vectors.dot(d, d)
            if distance > within * within:
                continue
            distance = np.sqrt(distance)
            row = min(count, PAIRS - 1)
            if count > 0 and distance < pairs[0, 0] - tie:
                pairs[row] = pairs[0]
                row = 0
            count = min(count + 1, PAIRS)
            slack = tie / np.sqrt(squares)
            end = 0 if place <= slack else (1 if place >= 1.0 - slack else -1)
            pairs[row, 0], pairs[row, 1], pairs[row, 2] = distance, v - corners, e
            pairs[row, 3], pairs[row, 4] = end, sign
            pairs[row, 5], pairs[row, 6], pairs[row, 7] = sign * d[0], sign * d[1], sign * d[2]
    return count


@njit(cache=True)
def shares_gap(solids: Solids, pair: Floats, normal: Floats, tie: float) -> bool:
    """The pair lies across the same gap as the nearest one, whose ``normal`` it nearly has.

    So do the two ends of what parallel edges have in common.
    """
    away = pair[5:8]
    if pair[0] > tie and vectors.dot(away, normal) < np.cos(NEARLY_OPPOSITE) * pair[0]:
        return False
    edge = int(pair[2])
    return pair[4] * vectors.dot(solids.bisector[edge], normal) >= solids.seen_about[edge]


@njit(cache=True)
def find_corner_candidates(
    solids: Solids, a: int, b: int, near_a: Ints, near_b: Ints, within: float, size: float,
    touching: Floats, found: Floats, count: int,
) -> int:  # fmt: skip
    """Add the nearest corner-edge pair no farther than ``within`` [m], and those beside it.

    ``near_a``, ``near_b``: edges of each body near the other; ``touching`` (3,): normal where the
    points are less than `LENGTH_TIE` of ``size`` [m] apart.  Rows of ``found`` as
    `rigid_lcp.contact.manifold.CANDIDATE_COLUMNS` says; returns how many there are.
    """
    tie = LENGTH_TIE * size
    pairs = np.empty((PAIRS, PAIR_COLUMNS))
    many = list_corner_edge_pairs(solids, a, b, near_b, 1.0, within, tie, pairs, int(ZERO))
    many = list_corner_edge_pairs(solids, b, a, near_a, -1.0, within, tie, pairs, many)
    nearest, normal, point = touching, np.empty(3), np.empty(3)
    for row in range(many):
        pair = pairs[row]
        of_a = pair[4] > 0.0
        if not of_a and pair[3] >= 0.0:  # corner on corner: found from a's side already
            continue
        own, other = (a, b) if of_a else (b, a)
        for axis in range(3):
            normal[axis] = pair[5 + axis] / pair[0] if pair[0] > tie else touching[axis]
            point[axis] = solids.vertex[solids.first_vertex[own] + int(pair[1]), axis]
        if row == 0:
            nearest = normal.copy()
        elif not shares_gap(solids, pair, nearest, tie):
            continue
        corner, edge = int(pair[1]), int(pair[2])
        first, second = corner, edge - solids.first_edge[other]
        kind = CORNER_EDGE if of_a else EDGE_CORNER
        if pair[3] >= 0.0:
            kind, second = CORNERS, solids.edge[edge, int(pair[3])]
        if not of_a:
            first, second = second, first
        count = add_candidate(
            found, count, kind, first, second, pair[0], normal, 1.0, point, SAME_CONTACT * size
        )
    return count


@njit(cache=True)
def list_faces(solids: Solids, body: int) -> tuple[Floats, Floats, Floats]:
    """Normals (f, 3) and offsets (f,) [m] of a body's faces, and its corners (v, 3) [m]."""
    start, stop = solids.first_face[body], solids.first_face[body + 1]
    corners = solids.vertex[solids.first_vertex[body] : solids.first_vertex[body + 1]]
    return solids.normal[start:stop], solids.offset[start:stop], corners


@njit(cache=True)
def add_nearest_corner(
    solids: Solids, face: int, own: int, other: int, own_is_b: bool, margin: float, found: Floats
) -> int:
    """The corner of ``other`` nearest to the plane of a face of ``own``, wherever it projects."""
    normal, first = solids.normal[face], solids.first_vertex[other]
    best, least = first, np.inf
    for v in range(first, solids.first_vertex[other + 1]):
        gap = vectors.dot(normal, solids.vertex[v]) - solids.offset[face]
        if gap < least:
            best, least = v, gap
    if least > margin:
        return 0
    corner, there = best - first, face - solids.first_face[own]
    kind, first_name, second = int(CORNER_FACE), corner, there
    if not own_is_b:
        kind, first_name, second = int(FACE_CORNER), there, corner
    return add_candidate(
        found, int(ZERO), kind, first_name, second, least, normal, 1.0 if own_is_b else -1.0,
        solids.vertex[best], 0.0,
    )  # fmt: skip


@njit(cache=True)
def find_solid_contacts(
    solids: Solids, a: int, b: int, box_a: Floats, box_b: Floats, margin: float, size: float,
    centres: Floats, drifts: Floats, bodies: Ints, numbers: Floats, known: int, found: Floats,
) -> int:  # fmt: skip
    """Point contacts of two polyhedra with a gap up to ``margin`` [m]; returns how many.

    ``box_a``, ``box_b``: bounding boxes, swollen or not; ``size``: the smaller reach of the
    two [m].  Rows of ``found`` as `CANDIDATE_COLUMNS` says.  The others as for
    `rigid_lcp.contact.parting_faces.choose_face`: where several faces part the two, the result is
    -1 unless the ``known`` contacts of other pairs are given.
    """
    face_a, gap_a = separate_faces(solids, a, b, margin)
    if gap_a > margin:
        return 0
    face_b, gap_b = separate_faces(solids, b, a, margin)
    if gap_b > margin:
        return 0
    near_a = find_near_edges(solids, a, box_b, margin)
    near_b = find_near_edges(solids, b, box_a, margin)
    edge_a, edge_b, gap_edges = separate_edges(solids, a, b, near_a, near_b, margin)
    if gap_edges > margin:
        return 0
    own_is_b = gap_b >= gap_a - LENGTH_TIE * size
    face, own, other = (face_b, b, a) if own_is_b else (face_a, a, b)
    crossing = np.empty(9)
    towards = solids.normal[face] * (1.0 if own_is_b else -1.0)
    # The normal is on the outer side of b's edge; grains with sharp edges may have it at more than
    # a right angle to that of the face.
    crosses = (
        edge_a >= 0
        and cross_edges(solids, a, edge_a, b, edge_b, solids.bisector[edge_b], crossing)
        and -LENGTH_TIE <= crossing[0] <= 1.0 + LENGTH_TIE
        and -LENGTH_TIE <= crossing[1] <= 1.0 + LENGTH_TIE
    )
    faces = max(gap_a, gap_b)
    alone = (
        crosses
        and gap_edges > faces + LENGTH_TIE * size
        and vectors.dot(crossing[3:6], towards) < np.cos(NEARLY_OPPOSITE)
    )
    count = int(ZERO)
    tie = LENGTH_TIE * size
    depth = max(margin, tie)
    if max(faces, gap_edges) >= -depth:
        widest = crossing[3:6] if crosses and gap_edges > faces + tie else towards
        side, better = choose_face(
            *list_faces(solids, a), *list_faces(solids, b), centres, drifts, widest,
            max(faces, gap_edges), tie, depth, bodies, numbers, known, a, b,
        )  # fmt: skip
        if side >= 0 and known < 0:
            return -1
        if side >= 0:
            own, other, near = (b, a, near_a) if side == 1 else (a, b, near_b)
            better += solids.first_face[own]
            count = find_face_candidates(
                solids, better, own, other, side == 1, near, margin, size, found
            )
            if count == 0:
                count = add_nearest_corner(solids, better, own, other, side == 1, margin, found)
            return keep_outer(found, count, size)
    if not alone:
        near = near_a if own_is_b else near_b
        count = find_face_candidates(solids, face, own, other, own_is_b, near, margin, size, found)
    least = find_least_gap(found, count)
    apart, missing = max(faces, gap_edges), least > gap_edges + LENGTH_TIE * size
    deep = count == 0 and apart < -LENGTH_TIE * size
    if alone or (crosses and missing and (gap_edges == apart or deep)):
        count = add_candidate(
            found, count, int(EDGES), edge_a - solids.first_edge[a],
            edge_b - solids.first_edge[b], crossing[2], crossing[3:6], 1.0, crossing[6:9],
            SAME_CONTACT * size,
        )  # fmt: skip
        least = find_least_gap(found, count)
    if apart > -LENGTH_TIE * size and least > apart + LENGTH_TIE * size:
        within = min(margin, least - LENGTH_TIE * size)
        count = find_corner_candidates(
            solids, a, b, near_a, near_b, within, size, towards, found, count
        )
    return keep_outer(found, count, size)
