"""Contact of a sphere with another sphere, a half-space or a polyhedron, in closed form."""

from __future__ import annotations

import numpy as np
from numba import njit

from rigid_lcp.arrays import Floats
from rigid_lcp.contact.manifold import within_face
from rigid_lcp.contact.separation import Solids, dot


@njit(cache=True)
def touch_sphere_sphere(x: Floats, radius: float, y: Floats, other: float, row: Floats) -> int:
    """Eq. 8 for centres x (sphere a) and y (b); concentric ones are parted along z.

    Fills ``row`` as `touch_sphere_solid` does; returns 0, the only feature a sphere has.
    """
    _fill_round(row, x, radius, y[0], y[1], y[2], other)
    return 0


@njit(cache=True)
def touch_sphere_plane(solids: Solids, plane: int, x: Floats, radius: float, row: Floats) -> int:
    """Gap of a sphere over a half-space; fills ``row``, returns the feature 0."""
    face = solids.first_face[plane]
    n = solids.normal[face]
    _fill(row, x, radius, n, dot(n, x) - solids.offset[face] - radius, np.inf)
    return 0


@njit(cache=True)
def touch_sphere_solid(solids: Solids, body: int, x: Floats, radius: float, row: Floats) -> int:
    """Contact of a sphere (body a) with the nearest point of a polyhedron (body b).

    ``row`` is filled with point (3), normal (3), gap, radii of curvature of a and b, b's zero for
    a corner or an edge.  A centre inside the polyhedron leaves through the nearest face.  Returns
    the number of the feature: faces first, then edges, then corners.
    """
    first_face, first_edge = solids.first_face[body], solids.first_edge[body]
    faces, edges = (
        solids.first_face[body + 1] - first_face,
        solids.first_edge[body + 1] - first_edge,
    )
    best, separation = first_face, -np.inf
    for f in range(first_face, first_face + faces):
        distance = dot(solids.normal[f], x) - solids.offset[f]
        if distance > separation:
            best, separation = f, distance
    if separation <= 0.0 or within_face(solids, body, best, x, 0.0):
        _fill(row, x, radius, solids.normal[best], separation - radius, np.inf)
        return best - first_face
    feature, nearest = 0, np.inf
    base = solids.first_vertex[body]
    f0, f1, f2 = 0.0, 0.0, 0.0
    for e in range(first_edge, first_edge + edges):
        p, q = solids.vertex[base + solids.edge[e, 0]], solids.vertex[base + solids.edge[e, 1]]
        u0, u1, u2 = q[0] - p[0], q[1] - p[1], q[2] - p[2]
        along = u0 * (x[0] - p[0]) + u1 * (x[1] - p[1]) + u2 * (x[2] - p[2])
        place = min(max(along / (u0 * u0 + u1 * u1 + u2 * u2), 0.0), 1.0)
        y0, y1, y2 = p[0] + place * u0, p[1] + place * u1, p[2] + place * u2
        squares = (x[0] - y0) ** 2 + (x[1] - y1) ** 2 + (x[2] - y2) ** 2
        if squares < nearest:
            nearest, f0, f1, f2 = squares, y0, y1, y2
            feature = faces + e - first_edge
            if place == 0.0 or place == 1.0:
                feature = faces + edges + solids.edge[e, int(place)]
    _fill_round(row, x, radius, f0, f1, f2, 0.0)
    return feature


@njit(cache=True)
def _fill_round(
    row: Floats, x: Floats, radius: float, y0: float, y1: float, y2: float, other: float
) -> None:
    """Store the contact with a sphere, or a point of radius 0, about y; parted along z if at x."""
    away = np.empty(3)
    away[0], away[1], away[2] = x[0] - y0, x[1] - y1, x[2] - y2
    distance = np.sqrt(dot(away, away))
    if distance > 0.0:
        for axis in range(3):
            away[axis] /= distance
    else:
        away[2] = 1.0
    _fill(row, x, radius, away, distance - radius - other, other)


@njit(cache=True)
def _fill(
    row: Floats, x: Floats, radius: float, normal: Floats, gap: float, curvature: float
) -> None:
    """Store point on the sphere, normal, gap and radii of curvature."""
    for axis in range(3):
        row[axis] = x[axis] - radius * normal[axis]
        row[3 + axis] = normal[axis]
    row[6], row[7], row[8] = gap, radius, curvature
