"""Separating axes of two convex polyhedra: how far apart they are, and along which normal.

Along the outward normal of a face, or across two edges, the gap of two polyhedra that are apart
is a lower bound of their distance; the greatest of them is the distance itself unless the nearest
features are corners (Gregorius, The separating axis test, GDC 2013).  The axes are features, as
eq. 9 wants them, so normals and gaps are exact to round-off, which those of GJK and EPA are not.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit

from rigid_lcp.arrays import Floats, Ints
from rigid_lcp.shapes import vectors


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
        u = vectors.subtract(solids.vertex[base_a + solids.edge[e, 1]], p)
        length_a = vectors.dot(u, u)
        for f in near_b:
            r = solids.vertex[base_b + solids.edge[f, 0]]
            w = vectors.subtract(solids.vertex[base_b + solids.edge[f, 1]], r)
            c = vectors.cross(u, w)
            to_a, to_b = vectors.dot(c, solids.bisector[e]), vectors.dot(c, solids.bisector[f])
            if to_a * to_b > 0.0 and solids.seen[e] > 0.0:  # it leaves both: no root yet
                continue
            squares = vectors.dot(c, c)
            if squares <= PARALLEL_EDGES**2 * length_a * vectors.dot(w, w):
                continue
            scale = (-1.0 if to_b < 0.0 else 1.0) / np.sqrt(squares)
            if to_b * scale < solids.seen[f] or -to_a * scale < solids.seen[e]:
                continue
            gap = scale * vectors.dot(c, vectors.subtract(p, r))
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
    r = solids.vertex[base_b + solids.edge[edge_b, 0]]
    u = vectors.subtract(solids.vertex[base_a + solids.edge[edge_a, 1]], p)
    w = vectors.subtract(solids.vertex[base_b + solids.edge[edge_b, 1]], r)
    x, c = vectors.subtract(r, p), vectors.cross(u, w)
    squares = vectors.dot(c, c)
    if squares <= PARALLEL_EDGES**2 * (vectors.dot(u, u) * vectors.dot(w, w)):
        return False
    crossing[0] = vectors.dot(vectors.cross(x, w), c) / squares
    crossing[1] = vectors.dot(vectors.cross(x, u), c) / squares
    scale = 1.0 / np.sqrt(squares)
    if vectors.dot(c, towards) < 0.0:
        scale = -scale
    crossing[2] = -scale * vectors.dot(c, x)
    for axis in range(3):
        crossing[3 + axis] = c[axis] * scale
        crossing[6 + axis] = p[axis] + crossing[0] * u[axis]
    return True
