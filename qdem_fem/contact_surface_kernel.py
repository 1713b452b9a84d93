"""The compiled contact of surfaces: points in faces, edges across edges, one time step at a time.

One thread; sums in the order of the lists.  See `qdem_fem.contact_surface` for the law.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit

from qdem_fem.contact_kernel import (
    GO_ON,
    LOOK_ANEW,
    TOO_DEEP,
    exact,
    image_less,
    inlined,
    minus,
    row,
    row_put,
    slider,
)

TIE = 1e-9
"""Relative difference of squared distances below which two faces are equally near."""
FLAT = 50
"""Power of a cosine: a vertex or an edge 1 degree from flat bears under 1 %, 10 degrees, half."""
PARALLEL = 1e-6
"""Square of the sine of the angle between edges below which they do not cross."""


class Surface(NamedTuple):
    """Nodes, faces, points and sharp edges of all surfaces."""

    reference: Any
    """(c, 3) reference position of the vertices [m]"""
    place: Any
    """(c,) of its first component in the displacement"""
    force_at: Any
    """(c,) of its first component in the windows of forces"""
    face: Any
    """(f, 3) vertices, outward"""
    face_area: Any
    """(f,) [m^2]"""
    fan_first: Any
    """(c + 1,) first entry of a vertex in ``fan_face``"""
    fan_face: Any
    """the faces around every vertex"""
    point_node: Any
    """(q, 3) vertices of its face, or three times the vertex that it is"""
    point_share: Any
    """(q, 3) barycentric coordinates between them"""
    point_face: Any
    """(q,) its face; -1 for a vertex"""
    point_area: Any
    """(q,) [m^2]"""
    point_body: Any
    """(q,)"""
    edge: Any
    """(e, 2) vertices"""
    edge_opposite: Any
    """(e, 2) what is across the edge in its two faces"""
    edge_area: Any
    """(e,) [m^2]"""
    edge_body: Any
    """(e,)"""
    modulus: Any
    """(b,) p [Pa/m]"""
    shear: Any
    """(b,) p_t [Pa/m]"""


class Near(NamedTuple):
    """What may touch, and what it remembers."""

    point: Any
    """(n,) point"""
    body: Any
    """(n,) the body it is near to"""
    first: Any
    """(n + 1,) its first entry in ``face``"""
    face: Any
    """faces of that body near to it"""
    free: Any
    """(n,) way of all vertices from ``start`` up to which the point can not get in [m]"""
    weight: Any
    """(n,) area as the contact sees it, kept while it lasts [m^2]; negative: does not touch"""
    spring: Any
    """(n, 3) [m]"""
    image: Any
    """(n, 3) from the body to the image that it is near to [m]; (0,) where nothing is periodic"""
    edges: Any
    """(m, 2) pairs of edges"""
    edge_image: Any
    """(m, 3) from the second edge to its image [m]; (0,) where nothing is periodic"""
    edge_weight: Any
    """(m,) [m^2]"""
    edge_start: Any
    """(m,) depth at which it began [m]"""
    edge_spring: Any
    """(m, 3) [m]"""


class Walls(NamedTuple):
    """Rigid walls, and what each point remembers of each."""

    point: Any
    """(w, 3) [m]"""
    normal: Any
    """(w, 3)"""
    friction: Any
    """(w,)"""
    weight: Any
    """(w, q) [m^2]; negative: does not touch"""
    spring: Any
    """(w, q, 3) [m]"""
    force: Any
    """(w, 3) of the bodies on the wall [N]"""


class SurfaceTouch(NamedTuple):
    """All that a step of contact reads and writes."""

    surface: Any
    near: Any
    walls: Any
    friction: Any
    half_skin: Any
    depth: Any
    """Greatest depth [m]."""
    start: Any
    """(c, 3) positions when it was last looked what is near [m]"""
    position: Any
    """(c, 3) [m]"""
    force: Any
    """(c, 3) [N]"""
    account: Any
    """Energy in the springs now, and work that sliders took since the start [J]; looks in vain."""
    acting: Any
    """(c,) all vertices"""


@exact
def face_closest(p: Any, a: Any, b: Any, c: Any) -> Any:  # pragma: no cover
    """Barycentric coordinates of the point of triangle abc nearest to p (Ericson 2005, 5.1.5)."""
    abx, aby, abz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    acx, acy, acz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    apx, apy, apz = p[0] - a[0], p[1] - a[1], p[2] - a[2]
    d1 = abx * apx + aby * apy + abz * apz
    d2 = acx * apx + acy * apy + acz * apz
    if d1 <= 0.0 and d2 <= 0.0:
        return 1.0, 0.0, 0.0
    bpx, bpy, bpz = p[0] - b[0], p[1] - b[1], p[2] - b[2]
    d3 = abx * bpx + aby * bpy + abz * bpz
    d4 = acx * bpx + acy * bpy + acz * bpz
    if d3 >= 0.0 and d4 <= d3:
        return 0.0, 1.0, 0.0
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        v = d1 / (d1 - d3)
        return 1.0 - v, v, 0.0
    cpx, cpy, cpz = p[0] - c[0], p[1] - c[1], p[2] - c[2]
    d5 = abx * cpx + aby * cpy + abz * cpz
    d6 = acx * cpx + acy * cpy + acz * cpz
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
def dot(a: Any, b: Any) -> float:  # pragma: no cover
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inlined
def cross(a: Any, b: Any) -> Any:  # pragma: no cover
    """Vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@inlined
def scaled(factor: float, a: Any) -> Any:  # pragma: no cover
    """``factor`` times a vector."""
    return factor * a[0], factor * a[1], factor * a[2]


@inlined
def less(a: Any, b: Any) -> Any:  # pragma: no cover
    """``a - b``"""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@exact
def face_normal(position: Any, face: Any, f: int) -> Any:  # pragma: no cover
    """Unit normal of a face."""
    i, j, k = face[f, 0], face[f, 1], face[f, 2]
    n = cross(minus(position, j, position, i), minus(position, k, position, i))
    return scaled(1.0 / np.sqrt(dot(n, n)), n)


@exact
def depth_of(p: Any, position: Any, face: Any, faces: Any) -> Any:  # pragma: no cover
    """``(g, n, f, share)``: depth of p under the nearest of ``faces``, negative outside.

    Of faces equally near, as around an edge, the one whose plane is farthest tells the side.
    """
    nearest, plane, found = np.inf, 0.0, -1
    for f in faces:
        i, j, k = face[f, 0], face[f, 1], face[f, 2]
        share = face_closest(p, row(position, i), row(position, j), row(position, k))
        d = less(p, blend(position, (i, j, k), share))
        square = dot(d, d)
        if square > nearest * (1.0 + TIE):
            continue
        height = dot(less(p, row(position, i)), face_normal(position, face, f))
        if square < nearest * (1.0 - TIE) or abs(height) > abs(plane):
            nearest, plane, found = min(square, nearest), height, f
    if found < 0:
        return -np.inf, (0.0, 0.0, 0.0), -1, (0.0, 0.0, 0.0)
    i, j, k = face[found, 0], face[found, 1], face[found, 2]
    share = face_closest(p, row(position, i), row(position, j), row(position, k))
    n = face_normal(position, face, found)
    away = less(blend(position, (i, j, k), share), p)
    length = np.sqrt(dot(away, away))
    if plane >= 0.0:
        return -length, n, found, share
    if -plane < length * (1.0 - TIE):  # the nearest point is on an edge that bends inwards
        n = scaled(1.0 / length, away)
    return length, n, found, share


@inlined
def force_add(force: Any, nodes: Any, share: Any, f: Any, sign: float) -> None:  # pragma: no cover
    """Share a force out to three nodes."""
    for k in range(3):
        force[nodes[0], k] += sign * share[0] * f[k]
        force[nodes[1], k] += sign * share[1] * f[k]
        force[nodes[2], k] += sign * share[2] * f[k]


@inlined
def velocity_of(velocity: Any, place: Any, nodes: Any, share: Any) -> Any:  # pragma: no cover
    """Velocity at barycentric coordinates between three nodes [m/s]."""
    i, j, k = place[nodes[0]], place[nodes[1]], place[nodes[2]]
    a, b, c = share
    return (
        a * velocity[i] + b * velocity[j] + c * velocity[k],
        a * velocity[i + 1] + b * velocity[j + 1] + c * velocity[k + 1],
        a * velocity[i + 2] + b * velocity[j + 2] + c * velocity[k + 2],
    )


@exact
def law(
    c: Any, spring: Any, at: int, n: Any, g: float, way: Any, k_n: float, k_t: float,
    friction: float,
) -> Any:  # fmt: skip  # pragma: no cover
    """Force on the one that is inside by ``g`` along n; springs and the account are kept."""
    push = k_n * max(g, 0.0)
    s, loss = slider(row(spring, at), n, way, k_t, friction * push)
    row_put(spring, at, s)
    c.account[0] += 0.5 * push * max(g, 0.0) + 0.5 * k_t * dot(s, s)
    c.account[1] += loss
    return push * n[0] - k_t * s[0], push * n[1] - k_t * s[1], push * n[2] - k_t * s[2]


@exact
def point_weight(surface: Any, x: Any, q: int, n: Any) -> float:  # pragma: no cover
    """Area [m^2] with which point q begins to touch what has the normal n."""
    own = surface.point_face[q]
    if own >= 0:
        return surface.point_area[q] * max(0.0, -dot(face_normal(x, surface.face, own), n))
    vertex, area, flat = surface.point_node[q, 0], 0.0, 0.0
    for at in range(surface.fan_first[vertex], surface.fan_first[vertex + 1]):
        f = surface.fan_face[at]
        against = max(0.0, -dot(face_normal(x, surface.face, f), n))
        area += surface.face_area[f] / 3.0 * against
        flat = max(flat, against)
    return area * (1.0 - flat**FLAT)


@exact
def edge_flatness(surface: Any, x: Any, e: int, n: Any, sign: float) -> float:  # pragma: no cover
    """Greatest ``sign n_f n`` of the two faces of a sharp edge."""
    i, j = surface.edge[e, 0], surface.edge[e, 1]
    flat = 0.0
    for k in range(2):
        m = cross(minus(x, j, x, i), minus(x, surface.edge_opposite[e, k], x, i))
        # of either sense: the sign is that of the side the rest of the body is not on
        if dot(m, minus(x, surface.edge_opposite[e, 1 - k], x, i)) > 0.0:
            m = scaled(-1.0, m)
        flat = max(flat, sign * dot(m, n) / np.sqrt(dot(m, m)))
    return flat


@inlined
def series(one: float, other: float) -> float:  # pragma: no cover
    """`qdem_fem.contact_spheres.pair_stiffness`"""
    return 2.0 * one * other / (one + other)


@exact
def points_forces(c: Any, velocity: Any, step: float, moved: float) -> float:  # pragma: no cover
    """Forces of points in other bodies; greatest depth.

    ``moved`` [m]: greatest way of a vertex from ``start``.  A point outside by ``g`` is not in
    before it and a face have moved by ``g`` in all, each by ``moved`` then and now at most.
    """
    surface, near, x = c.surface, c.near, c.position
    deepest = 0.0
    for at in range(near.point.size):
        if moved < near.free[at]:
            continue
        q = near.point[at]
        nodes = surface.point_node[q, 0], surface.point_node[q, 1], surface.point_node[q, 2]
        share = row(surface.point_share, q)
        p = image_less(blend(x, nodes, share), near.image, at)
        faces = near.face[near.first[at] : near.first[at + 1]]
        g, n, f, below = depth_of(p, x, surface.face, faces)
        near.free[at] = -0.5 * g - moved if g > -np.inf else -1.0
        if g <= 0.0 and near.weight[at] < 0.0:
            continue
        if g > 0.0 and near.weight[at] < 0.0:
            near.weight[at] = point_weight(surface, x, q, n)
        deepest = max(deepest, g if near.weight[at] > 0.0 else 0.0)
        other = near.body[at]
        half = 0.5 * max(near.weight[at], 0.0)
        k_n = half * series(surface.modulus[surface.point_body[q]], surface.modulus[other])
        k_t = half * series(surface.shear[surface.point_body[q]], surface.shear[other])
        under = surface.face[f, 0], surface.face[f, 1], surface.face[f, 2]
        way = scaled(
            step,
            less(
                velocity_of(velocity, surface.place, nodes, share),
                velocity_of(velocity, surface.place, under, below),
            ),
        )
        force = law(c, near.spring, at, n, g, way, k_n, k_t, c.friction)
        force_add(c.force, nodes, share, force, 1.0)
        force_add(c.force, under, below, force, -1.0)
        if g <= 0.0:
            near.weight[at] = -1.0
    return deepest


@exact
def edges_forces(c: Any, velocity: Any, step: float) -> None:  # pragma: no cover
    """Forces of sharp edges across sharp edges of other bodies."""
    surface, near, x = c.surface, c.near, c.position
    for at in range(near.edges.shape[0]):
        a, b = near.edges[at, 0], near.edges[at, 1]
        i, j, k, m = surface.edge[a, 0], surface.edge[a, 1], surface.edge[b, 0], surface.edge[b, 1]
        u, v = minus(x, j, x, i), minus(x, m, x, k)
        w = image_less(minus(x, i, x, k), near.edge_image, at)
        uu, uv, vv, uw, vw = dot(u, u), dot(u, v), dot(v, v), dot(u, w), dot(v, w)
        determinant = uu * vv - uv * uv
        g, n, s, t = -1.0, (0.0, 0.0, 0.0), 0.0, 0.0
        if determinant > PARALLEL * uu * vv:
            s, t = (uv * vw - vv * uw) / determinant, (uu * vw - uv * uw) / determinant
            if 0.0 < s < 1.0 and 0.0 < t < 1.0:
                n = cross(u, v)
                n = scaled(1.0 / np.sqrt(dot(n, n)), n)
                if dot(minus(x, surface.edge_opposite[b, 0], x, k), n) > 0.0:
                    n = scaled(-1.0, n)
                # n is outward of b where both its faces fall away from it, and inward of a
                if (
                    dot(minus(x, surface.edge_opposite[b, 0], x, k), n) < 0.0
                    and dot(minus(x, surface.edge_opposite[b, 1], x, k), n) < 0.0
                    and dot(minus(x, surface.edge_opposite[a, 0], x, i), n) > 0.0
                    and dot(minus(x, surface.edge_opposite[a, 1], x, i), n) > 0.0
                ):
                    g = -dot(w, n)
                    if g > c.depth:
                        g = -1.0
        if g <= 0.0 and near.edge_weight[at] < 0.0:
            continue
        one, two = (1.0 - s, s, 0.0), (1.0 - t, t, 0.0)
        nodes, under = (i, j, i), (k, m, k)
        way = scaled(
            step,
            less(
                velocity_of(velocity, surface.place, nodes, one),
                velocity_of(velocity, surface.place, under, two),
            ),
        )
        if near.edge_weight[at] < 0.0:  # the ends of an edge are its vertices': it fades to them
            flat = edge_flatness(surface, x, a, n, -1.0) * edge_flatness(surface, x, b, n, 1.0)
            fade = 16.0 * s * (1.0 - s) * t * (1.0 - t) * (1.0 - flat**FLAT)
            near.edge_weight[at] = fade * min(surface.edge_area[a], surface.edge_area[b])
            # what slides onto an edge begins without a force
            near.edge_start[at] = 0.0 if step == 0.0 or g + dot(way, n) <= 0.0 else g
        body, other = surface.edge_body[a], surface.edge_body[b]
        k_n = near.edge_weight[at] * series(surface.modulus[body], surface.modulus[other])
        k_t = near.edge_weight[at] * series(surface.shear[body], surface.shear[other])
        g_eff = g - near.edge_start[at] if g > 0.0 else 0.0
        force = law(c, near.edge_spring, at, n, g_eff, way, k_n, k_t, c.friction)
        force_add(c.force, nodes, one, force, 1.0)
        force_add(c.force, under, two, force, -1.0)
        if g <= 0.0:
            near.edge_weight[at] = -1.0


@exact
def walls_forces(c: Any, velocity: Any, step: float) -> float:  # pragma: no cover
    """Forces of the walls on points; greatest depth."""
    surface, walls, x = c.surface, c.walls, c.position
    deepest = 0.0
    for w in range(walls.point.shape[0]):
        n = row(walls.normal, w)
        total = (0.0, 0.0, 0.0)
        for q in range(surface.point_area.size):
            nodes = surface.point_node[q, 0], surface.point_node[q, 1], surface.point_node[q, 2]
            share = row(surface.point_share, q)
            g = -dot(less(blend(x, nodes, share), row(walls.point, w)), n)
            if g <= 0.0 and walls.weight[w, q] < 0.0:
                continue
            if g > 0.0 and walls.weight[w, q] < 0.0:
                walls.weight[w, q] = point_weight(surface, x, q, n)
            deepest = max(deepest, g if walls.weight[w, q] > 0.0 else 0.0)
            weight = 2.0 * max(walls.weight[w, q], 0.0)
            k_n = weight * surface.modulus[surface.point_body[q]]
            k_t = weight * surface.shear[surface.point_body[q]]
            way = scaled(step, velocity_of(velocity, surface.place, nodes, share))
            force = law(c, walls.spring[w], q, n, g, way, k_n, k_t, walls.friction[w])
            force_add(c.force, nodes, share, force, 1.0)
            total = less(total, force)
            if g <= 0.0:
                walls.weight[w, q] = -1.0
        row_put(walls.force, w, total)
    return deepest


def surface_advance(
    c: Any, displacement: Any, velocity: Any, step: float
) -> int:  # pragma: no cover
    """Contact at the new displacement; as `qdem_fem.contact_kernel.advance`."""
    far = 0.0
    for i in range(c.position.shape[0]):
        at, moved = c.surface.place[i], 0.0
        for k in range(3):
            c.position[i, k] = c.surface.reference[i, k] + displacement[at + k]
            c.force[i, k] = 0.0
            moved += (c.position[i, k] - c.start[i, k]) ** 2
        far = max(far, moved)
    c.account[0] = 0.0
    moved = np.sqrt(far)
    deepest = max(points_forces(c, velocity, step, moved), walls_forces(c, velocity, step))
    edges_forces(c, velocity, step)
    if deepest > c.depth:
        return TOO_DEEP
    return LOOK_ANEW if far > c.half_skin**2 else GO_ON


surface_step: Any = njit(error_model="numpy", cache=True)(surface_advance)
