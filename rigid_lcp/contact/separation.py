"""Separating axes of two convex polyhedra: how far apart they are, and along which normal.

Along the outward normal of a face, or across two edges, the gap of two polyhedra that are apart
is a lower bound of their distance; the greatest of them is the distance itself unless the nearest
features are corners (Gregorius, The separating axis test, GDC 2013).  The axes are features, as
eq. 9 wants them, so normals and gaps are exact to round-off, which those of GJK and EPA are not.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit

from rigid_lcp.arrays import Floats, Ints


@dataclass(frozen=True)
class PolyhedronNumbers:
    """Angles of faces and edges; which contacts of a pair are kept, by shares of its reach."""

    tilt: float = 1e-9  # round-off where a normal lies just between two face normals [rad]
    nearly_opposite: float = 0.1
    """Faces whose normals are opposite within this angle [rad] may lie upon each other: they share
    every point contact that lies within both of them."""
    parallel_edges: float = 1e-6  # least sine of the angle of edges that have a common normal [-]
    same_contact: float = 1e-6  # distance below which two contacts are one [-]
    slope: float = 10.0
    """How much farther out a contact must be for its gap [m/m] to be kept; faces that share
    contacts are tilted by less than its inverse, see `nearly_opposite`."""
    outside_hull: float = 1e-2  # distance of one more from the hull of those kept, at least [-]
    most_kept: int = 12  # contacts [-]


POLYHEDRA = PolyhedronNumbers()
NEARLY_OPPOSITE, PARALLEL_EDGES = POLYHEDRA.nearly_opposite, POLYHEDRA.parallel_edges


class Solids(NamedTuple):
    """All bodies' corners, faces and edges in the world frame, in flat arrays.

    ``first_*`` (n + 1,) tell where those of each body start; features are numbered within their
    body.  ``loop[first_corner[f] : first_corner[f + 1]]``: corners of face f, anticlockwise.
    """

    first_vertex: Ints
    vertex: Floats
    first_face: Ints
    normal: Floats
    offset: Floats  # ``normal . x`` on each face [m]
    first_corner: Ints
    loop: Ints
    first_edge: Ints
    edge: Ints  # first and second corner of each edge, (e, 2)
    bisector: Floats  # unit bisectors of the normals of the two faces at each edge, (e, 3)
    seen: Floats
    """Cosine of half the angle between these normals, (e,): a normal whose cosine with the
    bisector is smaller lies outside the edge's cone of normals."""
    seen_about: Floats  # the same with `NEARLY_OPPOSITE` added to the half angle


@njit(cache=True)
def dot(a: Floats, b: Floats) -> float:
    """Scalar product of two vectors (3,)."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True)
def cross(
    a0: float, a1: float, a2: float, b0: float, b1: float, b2: float
) -> tuple[float, float, float]:
    """Vector product of two vectors, by components: small arrays would cost more than it."""
    return a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0


@njit(cache=True)
def separate_faces(solids: Solids, own: int, other: int, margin: float) -> tuple[int, float]:
    """Face of body ``own`` whose plane keeps ``other`` farthest off, and how far [m].

    Returns at the first face beyond ``margin`` [m]: then there is no contact.
    """
    best, separation = -1, -np.inf
    for f in range(solids.first_face[own], solids.first_face[own + 1]):
        n0, n1, n2 = solids.normal[f]
        nearest = np.inf
        for v in range(solids.first_vertex[other], solids.first_vertex[other + 1]):
            x = solids.vertex[v]
            nearest = min(nearest, n0 * x[0] + n1 * x[1] + n2 * x[2])
            if nearest - solids.offset[f] <= separation:  # no better than another face
                break
        nearest -= solids.offset[f]
        if nearest > separation:
            best, separation = f, nearest
            if separation > margin:
                break
    return best, separation


@njit(cache=True)
def find_near_edges(solids: Solids, own: int, box: Floats, margin: float) -> Ints:
    """Edges of a body whose own boxes come within ``margin`` [m] of ``box`` (x0, y0, z0, x1...)."""
    near = np.empty(solids.first_edge[own + 1] - solids.first_edge[own], np.int64)
    count = 0
    base = solids.first_vertex[own]
    for e in range(solids.first_edge[own], solids.first_edge[own + 1]):
        p = solids.vertex[base + solids.edge[e, 0]]
        q = solids.vertex[base + solids.edge[e, 1]]
        touches = True
        for axis in range(3):
            low, high = min(p[axis], q[axis]), max(p[axis], q[axis])
            if low > box[3 + axis] + margin or high < box[axis] - margin:
                touches = False
        if touches:
            near[count] = e
            count += 1
    return near[:count]


@njit(cache=True)
def separate_edges(
    solids: Solids, a: int, b: int, near_a: Ints, near_b: Ints, margin: float
) -> tuple[int, int, float]:
    """Edges of a and b whose common normal keeps the bodies farthest apart, and how far [m].

    Only edges that see each other count: the normal lies between those of the faces at each.
    ``near_a``, ``near_b``: the edges looked at (`find_near_edges`).  (-1, -1, -inf) if there are
    none.
    """
    best_a, best_b, separation = -1, -1, -np.inf
    base_a, base_b = solids.first_vertex[a], solids.first_vertex[b]
    for e in near_a:
        p = solids.vertex[base_a + solids.edge[e, 0]]
        q = solids.vertex[base_a + solids.edge[e, 1]]
        u0, u1, u2 = q[0] - p[0], q[1] - p[1], q[2] - p[2]
        length_a = u0 * u0 + u1 * u1 + u2 * u2
        m = solids.bisector[e]
        for f in near_b:
            r = solids.vertex[base_b + solids.edge[f, 0]]
            s = solids.vertex[base_b + solids.edge[f, 1]]
            w0, w1, w2 = s[0] - r[0], s[1] - r[1], s[2] - r[2]
            c0, c1, c2 = cross(u0, u1, u2, w0, w1, w2)
            k = solids.bisector[f]
            towards_b = c0 * k[0] + c1 * k[1] + c2 * k[2]
            towards_a = c0 * m[0] + c1 * m[1] + c2 * m[2]
            if towards_a * towards_b > 0.0 and solids.seen[e] > 0.0:  # it leaves both: no root yet
                continue
            squares = c0 * c0 + c1 * c1 + c2 * c2
            if squares <= PARALLEL_EDGES**2 * length_a * (w0 * w0 + w1 * w1 + w2 * w2):
                continue
            scale = 1.0 / np.sqrt(squares)
            if towards_b < 0.0:
                scale = -scale
            if towards_b * scale < solids.seen[f]:
                continue
            if -towards_a * scale < solids.seen[e]:
                continue
            gap = scale * (c0 * (p[0] - r[0]) + c1 * (p[1] - r[1]) + c2 * (p[2] - r[2]))
            if gap > separation:
                best_a, best_b, separation = e, f, gap
                if separation > margin:
                    return best_a, best_b, separation
    return best_a, best_b, separation


@njit(cache=True)
def cross_edges(
    solids: Solids, a: int, edge_a: int, b: int, edge_b: int, towards: Floats, crossing: Floats
) -> bool:
    """Nearest points of the lines of two edges: where, and along which normal.

    ``crossing`` is filled with: place along edge a and along edge b (0 to 1 within them), gap,
    normal (3) on the side of ``towards``, point on a (3).  False for parallel edges.
    """
    base_a, base_b = solids.first_vertex[a], solids.first_vertex[b]
    p = solids.vertex[base_a + solids.edge[edge_a, 0]]
    q = solids.vertex[base_a + solids.edge[edge_a, 1]]
    r = solids.vertex[base_b + solids.edge[edge_b, 0]]
    s = solids.vertex[base_b + solids.edge[edge_b, 1]]
    u0, u1, u2 = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    w0, w1, w2 = s[0] - r[0], s[1] - r[1], s[2] - r[2]
    x0, x1, x2 = r[0] - p[0], r[1] - p[1], r[2] - p[2]
    c0, c1, c2 = cross(u0, u1, u2, w0, w1, w2)
    squares = c0 * c0 + c1 * c1 + c2 * c2
    lengths = (u0 * u0 + u1 * u1 + u2 * u2) * (w0 * w0 + w1 * w1 + w2 * w2)
    if squares <= PARALLEL_EDGES**2 * lengths:
        return False
    y0, y1, y2 = cross(x0, x1, x2, w0, w1, w2)
    crossing[0] = (y0 * c0 + y1 * c1 + y2 * c2) / squares
    y0, y1, y2 = cross(x0, x1, x2, u0, u1, u2)
    crossing[1] = (y0 * c0 + y1 * c1 + y2 * c2) / squares
    scale = 1.0 / np.sqrt(squares)
    if c0 * towards[0] + c1 * towards[1] + c2 * towards[2] < 0.0:
        scale = -scale
    crossing[2] = -scale * (c0 * x0 + c1 * x1 + c2 * x2)
    crossing[3], crossing[4], crossing[5] = c0 * scale, c1 * scale, c2 * scale
    crossing[6] = p[0] + crossing[0] * u0
    crossing[7] = p[1] + crossing[0] * u1
    crossing[8] = p[2] + crossing[0] * u2
    return True
