"""The overlap of two faces, cut out as a polygon, and its energy as a function of six vertices.

Faces a of one body and b of another, with outward normals n_a and n_b that oppose each other, are
seen along the mean normal ``n = (n_b - n_a)/|n_b - n_a|``.  Where both are in sight and b is ahead
of a by ``g`` along n, they overlap:

    W = w(c) p/2  integral over the overlap of g^2 dA,     c = -n_a n_b

with a weight w that rises from zero at c = `OPPOSED` to one for parallel faces: what is less
opposed are the flanks of a vertex or an edge, which bear by themselves.

Sutherland and Hodgman (1974) cut the polygon; g and barycentric coordinates are linear within it,
so that the integrals are exact.  Forces are the exact gradient of W: of the depth, of the rim of
the overlap, of n and of c.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from qdem_fem.contact.surface.geometry import cross, dot, less, scaled
from qdem_fem.kernel import exact, inlined

CORNERS = 8
"""A triangle cut by four lines has up to seven corners."""
COLUMNS = 8
"""Of a corner: three coordinates in a, three in b, g [m], whose edge begins there."""
OPPOSED = 0.5
"""Cosine above which faces bear; flanks of one edge of more than 60 degrees are below it."""
EDGE_A, EDGE_B, RIM = 0.0, 1.0, 2.0
"""The edge of a polygon is one of face a, one of face b, or where the depth ends."""


@inlined
def plus(a: Any, b: Any) -> Any:  # pragma: no cover
    """``a + b``"""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@inlined
def triangle_normal(a: Any) -> Any:  # pragma: no cover
    """Unit normal of a triangle of three points, and twice its area [m^2]."""
    n = cross(less(a[1], a[0]), less(a[2], a[0]))
    twice = np.sqrt(dot(n, n))
    return scaled(1.0 / twice, n), twice


@exact
def cut(old: Any, count: int, new: Any, column: int, tag: float) -> int:  # pragma: no cover
    """The part of a polygon of ``count`` corners with ``column`` above zero; its corners' count."""
    kept = 0
    for i in range(count):
        j = i + 1 if i + 1 < count else 0
        here, there = old[i, column], old[j, column]
        if here > 0.0:
            for k in range(COLUMNS):
                new[kept, k] = old[i, k]
            kept += 1
        if (here > 0.0) != (there > 0.0):
            share = here / (here - there)
            for k in range(COLUMNS - 1):
                new[kept, k] = old[i, k] + share * (old[j, k] - old[i, k])
            new[kept, column] = 0.0
            new[kept, COLUMNS - 1] = tag if here > 0.0 else old[i, COLUMNS - 1]
            kept += 1
    return kept


@exact
def overlap_polygon(a: Any, b: Any, n: Any, one: Any, two: Any) -> int:  # pragma: no cover
    """Corners of the overlap of triangles a and b seen along n, anticlockwise, left in ``one``.

    ``one`` and ``two`` are room for (`CORNERS`, `COLUMNS`).
    """
    double = dot(n, cross(less(b[1], b[0]), less(b[2], b[0])))
    for i in range(3):
        corner = (3 - i) % 3  # a faces the other way
        x = a[corner]
        for k in range(3):
            one[i, k] = 0.0
        one[i, corner] = 1.0
        height = -dot(x, n)
        for k in range(3):
            side = cross(less(b[(k + 1) % 3], x), less(b[(k + 2) % 3], x))
            one[i, 3 + k] = dot(n, side) / double
            height += one[i, 3 + k] * dot(b[k], n)
        one[i, 6], one[i, 7] = height, EDGE_A
    count = cut(one, 3, two, 3, EDGE_B)
    count = cut(two, count, one, 4, EDGE_B)
    count = cut(one, count, two, 5, EDGE_B)
    return cut(two, count, one, 6, RIM)


@exact
def polygon_sums(polygon: Any, count: int, double: float, sums: Any) -> None:  # pragma: no cover
    """Integrals over a polygon, in ``sums`` (8,), exact for linear columns.

    ``sums[:6]`` are those of g times the coordinates in a and b [m^3], ``sums[6]`` of g^2 [m^4],
    ``sums[7]`` of 1 [m^2].  ``double`` [m^2]: twice the area of face b as n sees it.
    """
    for k in range(8):
        sums[k] = 0.0
    for i in range(1, count - 1):
        u, v, w = polygon[0], polygon[i], polygon[i + 1]
        area = 0.5 * double * (
            (v[4] - u[4]) * (w[5] - u[5]) - (v[5] - u[5]) * (w[4] - u[4])
        )  # fmt: skip
        total = u[6] + v[6] + w[6]
        for k in range(7):
            products = u[6] * u[k] + v[6] * v[k] + w[6] * w[k]
            sums[k] += area / 12.0 * (total * (u[k] + v[k] + w[k]) + products)
        sums[7] += area


@exact
def rim_forces(
    polygon: Any, count: int, b: Any, n: Any, factor: float, pull: Any
) -> None:  # pragma: no cover
    """Add ``-factor/2`` times the integral of g^2 along the edges of a and b to their corners."""
    for i in range(count):
        p, q = polygon[i], polygon[i + 1 if i + 1 < count else 0]
        if p[7] == RIM:
            continue
        along = plus(
            plus(scaled(q[3] - p[3], b[0]), scaled(q[4] - p[4], b[1])), scaled(q[5] - p[5], b[2])
        )
        outward = cross(along, n)
        first = 3.0 * p[6] * p[6] + 2.0 * p[6] * q[6] + q[6] * q[6]
        second = p[6] * p[6] + 2.0 * p[6] * q[6] + 3.0 * q[6] * q[6]
        start = 0 if p[7] == EDGE_A else 3
        for k in range(start, start + 3):
            size = -factor / 24.0 * (p[k] * first + q[k] * second)
            for c in range(3):
                pull[k, c] += size * outward[c]


@exact
def overlap_forces(
    a: Any, b: Any, modulus: float, reach: float, room: Any, sums: Any, pull: Any
) -> Any:  # pragma: no cover
    """``(W [J], depth [m], w, n)`` of two faces; forces [N] on corners of a and b in ``pull``.

    ``a``, ``b``: three corners each [m]; ``modulus`` p [Pa/m]; ``room`` (2, `CORNERS`, `COLUMNS`);
    ``sums`` (8,) as of `polygon_sums`; ``pull`` (6, 3).  A depth of zero: they do not overlap, or
    by more than ``reach`` [m] everywhere, as faces on the far sides of two bodies.
    """
    n_a, double_a = triangle_normal(a)
    n_b, double_b = triangle_normal(b)
    against = -dot(n_a, n_b)
    nothing = 0.0, 0.0, 0.0, n_b
    if against <= OPPOSED:
        return nothing
    length = np.sqrt(2.0 + 2.0 * against)
    n = scaled(1.0 / length, less(n_b, n_a))
    polygon = room[0]
    count = overlap_polygon(a, b, n, polygon, room[1])
    if count < 3:
        return nothing
    deep, shallow = 0.0, np.inf
    for i in range(count):
        deep, shallow = max(deep, polygon[i, 6]), min(shallow, polygon[i, 6])
    if shallow > reach:
        return nothing
    polygon_sums(polygon, count, double_b * dot(n, n_b), sums)
    if sums[0] + sums[1] + sums[2] <= 0.0:  # a polygon without an area, to rounding
        return nothing
    share = (against - OPPOSED) / (1.0 - OPPOSED)
    weight = share * share * (3.0 - 2.0 * share)
    factor = weight * modulus
    on_a, on_b = scaled(factor / dot(n_a, n), n_a), scaled(-factor / dot(n_b, n), n_b)
    for k in range(3):
        for c in range(3):
            pull[k, c], pull[3 + k, c] = sums[k] * on_a[c], sums[3 + k] * on_b[c]
    rim_forces(polygon, count, b, n, factor, pull)
    moment = (0.0, 0.0, 0.0)
    for k in range(3):
        moment = plus(moment, cross(less(a[k], b[0]), (pull[k, 0], pull[k, 1], pull[k, 2])))
        on = pull[3 + k, 0], pull[3 + k, 1], pull[3 + k, 2]
        moment = plus(moment, cross(less(b[k], b[0]), on))
    turn = scaled(1.0 / length, cross(moment, n))  # dW = turn (dn_b - dn_a), of the mean normal
    rise = 6.0 * share * (1.0 - share) / (1.0 - OPPOSED)  # dw/dc
    fade = 0.5 * rise * modulus * sums[6]  # dW = fade dc
    turn_a, turn_b = plus(turn, scaled(fade, n_b)), less(turn, scaled(fade, n_a))
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        slope_a = dot(turn_a, cross(n_a, less(a[j], a[i]))) / double_a
        slope_b = dot(turn_b, cross(n_b, less(b[j], b[i]))) / double_b
        for c in range(3):
            pull[k, c] -= slope_a * n_a[c]
            pull[3 + k, c] += slope_b * n_b[c]
    return 0.5 * factor * sums[6], deep, weight, n
