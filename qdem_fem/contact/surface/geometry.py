"""Compiled geometry of triangles and edges: nearest points, depths, normals.

Vectors are tuples of three numbers.
"""

from typing import Any

import numpy as np

from qdem_fem.contact.spheres import subtract_rows
from qdem_fem.kernel import cross, dot, exact, inlined, read_row

TIE = 1e-9
"""Relative difference of squared distances below which two faces are equally near."""


@exact
def find_closest_on_face(p: Any, a: Any, b: Any, c: Any) -> Any:  # pragma: no cover
    """Barycentric coordinates of the point of triangle abc nearest to p (Ericson 2005, 5.1.5)."""
    ab, ac, ap = subtract(b, a), subtract(c, a), subtract(p, a)
    d1, d2 = dot(ab, ap), dot(ac, ap)
    if d1 <= 0.0 and d2 <= 0.0:
        return 1.0, 0.0, 0.0
    bp = subtract(p, b)
    d3, d4 = dot(ab, bp), dot(ac, bp)
    if d3 >= 0.0 and d4 <= d3:
        return 0.0, 1.0, 0.0
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        v = d1 / (d1 - d3)
        return 1.0 - v, v, 0.0
    cp = subtract(p, c)
    d5, d6 = dot(ab, cp), dot(ac, cp)
    if d6 >= 0.0 and d5 <= d6:
        return 0.0, 0.0, 1.0
    vb = d5 * d2 - d1 * d6
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        w = d2 / (d2 - d6)
        return 1.0 - w, 0.0, w
    va = d3 * d6 - d5 * d4
    if va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        return 0.0, 1.0 - w, w
    inverse = 1.0 / (va + vb + vc)
    return 1.0 - (vb + vc) * inverse, vb * inverse, vc * inverse


@inlined
def blend(field: Any, nodes: Any, share: Any) -> Any:  # pragma: no cover
    """A field (c, 3) at barycentric coordinates between three nodes."""
    i, j, k = nodes
    a, b, c = share
    return (
        a * field[i, 0] + b * field[j, 0] + c * field[k, 0],
        a * field[i, 1] + b * field[j, 1] + c * field[k, 1],
        a * field[i, 2] + b * field[j, 2] + c * field[k, 2],
    )


@inlined
def blend_velocity(velocity: Any, place: Any, nodes: Any, share: Any) -> Any:  # pragma: no cover
    """Velocity at barycentric coordinates between three nodes [m/s]."""
    i, j, k = place[nodes[0]], place[nodes[1]], place[nodes[2]]
    a, b, c = share
    return (
        a * velocity[i] + b * velocity[j] + c * velocity[k],
        a * velocity[i + 1] + b * velocity[j + 1] + c * velocity[k + 1],
        a * velocity[i + 2] + b * velocity[j + 2] + c * velocity[k + 2],
    )


@inlined
def scale(factor: float, a: Any) -> Any:  # pragma: no cover
    """``factor`` times a vector."""
    return factor * a[0], factor * a[1], factor * a[2]


@inlined
def subtract(a: Any, b: Any) -> Any:  # pragma: no cover
    """``a - b``"""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@exact
def find_arms(x: Any, ring: Any) -> Any:  # pragma: no cover
    """Way [m] from the middle of three nodes to each."""
    third = 1.0 / 3.0
    middle = blend(x, ring, (third, third, third))
    return (
        subtract(read_row(x, ring[0]), middle),
        subtract(read_row(x, ring[1]), middle),
        subtract(read_row(x, ring[2]), middle),
    )


@exact
def divide_by_inertia(arms: Any, m: Any) -> Any:  # pragma: no cover
    """``J^-1 m``, ``J = sum of r^2 1 - r r^T`` over three ``arms`` r: a spin of what turns as one.

    With ``m`` the sum of ``r x v`` it is the spin of three nodes; and forces ``(J^-1 m) x r`` on
    them have no sum and the moment ``m``.
    """
    a, b, c = arms
    xx, yy, zz = (a[0] ** 2 + b[0] ** 2 + c[0] ** 2, a[1] ** 2 + b[1] ** 2 + c[1] ** 2,
                  a[2] ** 2 + b[2] ** 2 + c[2] ** 2)  # fmt: skip
    r = -(a[1] * a[2] + b[1] * b[2] + c[1] * c[2])
    s = -(a[0] * a[2] + b[0] * b[2] + c[0] * c[2])
    t = -(a[0] * a[1] + b[0] * b[1] + c[0] * c[1])
    one, two, three = (yy + zz, t, s), (t, xx + zz, r), (s, r, xx + yy)
    p, q, w = cross(two, three), cross(three, one), cross(one, two)
    return scale(1.0 / dot(one, p), (dot(p, m), dot(q, m), dot(w, m)))


@exact
def compute_segments_apart(w: Any, u: Any, v: Any) -> float:  # pragma: no cover
    """Distance [m] of the segments ``w + s u`` and ``t v``, s and t from 0 to 1 (Ericson 2005)."""
    uu, uv, vv, uw, vw = dot(u, u), dot(u, v), dot(v, v), dot(u, w), dot(v, w)
    determinant = uu * vv - uv * uv
    s = 0.0
    if determinant > 0.0:
        s = min(1.0, max(0.0, (uv * vw - vv * uw) / determinant))
    t = (uv * s + vw) / vv
    if t < 0.0:
        t, s = 0.0, min(1.0, max(0.0, -uw / uu))
    elif t > 1.0:
        t, s = 1.0, min(1.0, max(0.0, (uv - uw) / uu))
    d = subtract(w, subtract(scale(t, v), scale(s, u)))
    return np.sqrt(dot(d, d))


@exact
def compute_face_normal(position: Any, face: Any, f: int) -> Any:  # pragma: no cover
    """Unit normal of a face."""
    i, j, k = face[f, 0], face[f, 1], face[f, 2]
    n = cross(subtract_rows(position, j, position, i), subtract_rows(position, k, position, i))
    return scale(1.0 / np.sqrt(dot(n, n)), n)


@exact
def find_depth(p: Any, position: Any, face: Any, faces: Any) -> Any:  # pragma: no cover
    """``(g, n, f, share)``: depth of p under the nearest of ``faces``, negative outside.

    Of faces equally near, as around an edge, the one whose plane is farthest tells the side.
    """
    nearest, plane, found = np.inf, 0.0, -1
    for f in faces:
        i, j, k = face[f, 0], face[f, 1], face[f, 2]
        share = find_closest_on_face(
            p, read_row(position, i), read_row(position, j), read_row(position, k)
        )
        d = subtract(p, blend(position, (i, j, k), share))
        square = dot(d, d)
        if square > nearest * (1.0 + TIE):
            continue
        height = dot(subtract(p, read_row(position, i)), compute_face_normal(position, face, f))
        if square < nearest * (1.0 - TIE) or abs(height) > abs(plane):
            nearest, plane, found = min(square, nearest), height, f
    if found < 0:
        return -np.inf, (0.0, 0.0, 0.0), -1, (0.0, 0.0, 0.0)
    i, j, k = face[found, 0], face[found, 1], face[found, 2]
    share = find_closest_on_face(
        p, read_row(position, i), read_row(position, j), read_row(position, k)
    )
    n = compute_face_normal(position, face, found)
    away = subtract(blend(position, (i, j, k), share), p)
    length = np.sqrt(dot(away, away))
    if plane >= 0.0:
        return -length, n, found, share
    if -plane < length * (1.0 - TIE):  # the nearest point is on an edge that bends inwards
        n = scale(1.0 / length, away)
    return length, n, found, share
