"""The compiled contact of surfaces: points in faces, edges across edges, one time step at a time.

One thread; sums in the order of the lists.  See `qdem_fem.contact.surface.options` for the law.
"""

from typing import Any

import numpy as np
from numba import njit

from qdem_fem import kernel as compiling
from qdem_fem.contact.spheres import (
    GO_ON,
    LOOK_AGAIN,
    TOO_DEEP,
    add_in_series,
    slide_spring,
    subtract_rows,
    write_row,
)
from qdem_fem.contact.spheres import law as contact_kernel
from qdem_fem.contact.surface import geometry as contact_surface_geometry
from qdem_fem.contact.surface.geometry import (
    blend,
    blend_velocity,
    compute_face_normal,
    compute_segments_apart,
    divide_by_inertia,
    find_arms,
    find_depth,
    scale,
    subtract,
)
from qdem_fem.kernel import cross, digest_sources, dot, exact, inlined, read_row

FLATNESS_POWER = 50
"""Power of a cosine: a vertex or an edge 1 degree from flat bears under 1 %, 10 degrees, half."""
PARALLEL_EDGES = 1e-6
"""Square of the sine of the angle between edges below which they do not cross."""
SOURCES = compiling, contact_kernel, contact_surface_geometry


@inlined
def add_force(force: Any, nodes: Any, share: Any, f: Any, sign: float) -> None:  # pragma: no cover
    """Share a force out to three nodes."""
    for k in range(3):
        force[nodes[0], k] += sign * share[0] * f[k]
        force[nodes[1], k] += sign * share[1] * f[k]
        force[nodes[2], k] += sign * share[2] * f[k]


@inlined
def apply_law(
    c: Any, spring: Any, at: int, n: Any, g: float, way: Any, k_n: float, k_t: float,
    friction: float,
) -> Any:  # fmt: skip  # pragma: no cover
    """Force on the one that is inside by ``g`` along n; springs and the account are kept."""
    push = k_n * max(g, 0.0)
    s, loss = slide_spring(read_row(spring, at), n, way, k_t, friction * push)
    write_row(spring, at, s)
    c.account[0] += 0.5 * push * max(g, 0.0) + 0.5 * k_t * dot(s, s)
    c.account[1] += loss
    return push * n[0] - k_t * s[0], push * n[1] - k_t * s[1], push * n[2] - k_t * s[2]


@exact
def push_pair(
    c: Any, velocity: Any, step: float, spring: Any, at: int, own: Any, other: Any, ring: Any,
    n: Any, g: float, k_n: float, k_t: float,
) -> None:  # fmt: skip  # pragma: no cover
    """Forces of a point that is inside by ``g`` along n, and of what it is in.

    ``own``, ``other``: nodes and shares of the point and of the nearest one of the other surface,
    d apart.  Both forces act at the point: the other surface follows it with the spin of its
    ``ring`` of three nodes, and what ``d x F`` lacks is a couple on them.  So moment is kept with
    friction, and two that turn as one have no slip.
    """
    x, place = c.position, c.surface.place
    d = subtract(blend(x, own[0], own[1]), blend(x, other[0], other[1]))
    arms, turning = find_arms(x, ring), (0.0, 0.0, 0.0)
    for k in range(3):
        at_node = place[ring[k]]
        v = velocity[at_node], velocity[at_node + 1], velocity[at_node + 2]
        turning = subtract(turning, cross(v, arms[k]))
    slip = subtract(
        blend_velocity(velocity, place, own[0], own[1]),
        blend_velocity(velocity, place, other[0], other[1]),
    )
    slip = subtract(slip, cross(divide_by_inertia(arms, turning), d))
    force = apply_law(c, spring, at, n, g, scale(step, slip), k_n, k_t, c.friction)
    add_force(c.force, own[0], own[1], force, 1.0)
    add_force(c.force, other[0], other[1], force, -1.0)
    couple = divide_by_inertia(arms, cross(force, d))
    for k in range(3):
        f = cross(couple, arms[k])
        for i in range(3):
            c.force[ring[k], i] += f[i]


@exact
def compute_point_weight(surface: Any, x: Any, q: int, n: Any) -> float:  # pragma: no cover
    """Area [m^2] with which point q begins to touch what has the normal n."""
    own = surface.point_face[q]
    if own >= 0:
        return surface.point_area[q] * max(0.0, -dot(compute_face_normal(x, surface.face, own), n))
    vertex, area, flat = surface.point_node[q, 0], 0.0, 0.0
    for at in range(surface.fan_first[vertex], surface.fan_first[vertex + 1]):
        f = surface.fan_face[at]
        against = max(0.0, -dot(compute_face_normal(x, surface.face, f), n))
        area += surface.face_area[f] / 3.0 * against
        flat = max(flat, against)
    return area * (1.0 - flat**FLATNESS_POWER)


@exact
def compute_edge_flatness(
    surface: Any, x: Any, e: int, n: Any, sign: float
) -> float:  # pragma: no cover
    """Greatest ``sign n_f n`` of the two faces of a sharp edge."""
    i, j = surface.edge[e, 0], surface.edge[e, 1]
    flat = 0.0
    for k in range(2):
        m = cross(subtract_rows(x, j, x, i), subtract_rows(x, surface.edge_opposite[e, k], x, i))
        # of either sense: the sign is that of the side the rest of the body is not on
        if dot(m, subtract_rows(x, surface.edge_opposite[e, 1 - k], x, i)) > 0.0:
            m = scale(-1.0, m)
        flat = max(flat, sign * dot(m, n) / np.sqrt(dot(m, m)))
    return flat


@exact
def compute_points_forces(
    c: Any, velocity: Any, step: float, moved: float
) -> float:  # pragma: no cover
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
        share = read_row(surface.point_share, q)
        p = blend(x, nodes, share)
        faces = near.face[near.first[at] : near.first[at + 1]]
        g, n, f, below = find_depth(p, x, surface.face, faces)
        near.free[at] = -0.5 * g - moved if g > -np.inf else -1.0
        if g <= 0.0 and near.weight[at] < 0.0:
            continue
        if g > 0.0 and near.weight[at] < 0.0:
            near.weight[at] = compute_point_weight(surface, x, q, n)
        if near.weight[at] > 0.0:  # what has no area has no force, and no friction to remember
            deepest = max(deepest, g)
            own, other, half = surface.point_body[q], near.body[at], 0.5 * near.weight[at]
            k_n = half * add_in_series(surface.modulus[own], surface.modulus[other])
            k_t = half * add_in_series(surface.shear[own], surface.shear[other])
            under = surface.face[f, 0], surface.face[f, 1], surface.face[f, 2]
            push_pair(
                c, velocity, step, near.spring, at, (nodes, share), (under, below), under, n, g,
                k_n, k_t,
            )  # fmt: skip
        if g <= 0.0:
            near.weight[at] = -1.0
    return deepest


@exact
def compute_edges_forces(
    c: Any, velocity: Any, step: float, moved: float
) -> None:  # pragma: no cover
    """Forces of sharp edges across sharp edges of other bodies.

    ``moved`` as of `compute_points_forces`: what touches is no farther apart than the depth.
    """
    surface, near, x = c.surface, c.near, c.position
    for at in range(near.edges.shape[0]):
        if moved < near.edge_free[at]:
            continue
        a, b = near.edges[at, 0], near.edges[at, 1]
        i, j, k, m = surface.edge[a, 0], surface.edge[a, 1], surface.edge[b, 0], surface.edge[b, 1]
        u, v = subtract_rows(x, j, x, i), subtract_rows(x, m, x, k)
        w = subtract_rows(x, i, x, k)
        uu, uv, vv, uw, vw = dot(u, u), dot(u, v), dot(v, v), dot(u, w), dot(v, w)
        determinant = uu * vv - uv * uv
        g, n, s, t = -1.0, (0.0, 0.0, 0.0), 0.0, 0.0
        if determinant > PARALLEL_EDGES * uu * vv:
            s, t = (uv * vw - vv * uw) / determinant, (uu * vw - uv * uw) / determinant
            if 0.0 < s < 1.0 and 0.0 < t < 1.0:
                n = cross(u, v)
                n = scale(1.0 / np.sqrt(dot(n, n)), n)
                if dot(subtract_rows(x, surface.edge_opposite[b, 0], x, k), n) > 0.0:
                    n = scale(-1.0, n)
                # n is outward of b where both its faces fall away from it, and inward of a
                if (
                    dot(subtract_rows(x, surface.edge_opposite[b, 0], x, k), n) < 0.0
                    and dot(subtract_rows(x, surface.edge_opposite[b, 1], x, k), n) < 0.0
                    and dot(subtract_rows(x, surface.edge_opposite[a, 0], x, i), n) > 0.0
                    and dot(subtract_rows(x, surface.edge_opposite[a, 1], x, i), n) > 0.0
                ):
                    g = -dot(w, n)
                    if g > c.depth:
                        g = -1.0
        near.edge_free[at] = -1.0
        if g <= 0.0 and near.edge_weight[at] < 0.0:
            near.edge_free[at] = 0.5 * (compute_segments_apart(w, u, v) - c.depth) - moved
            continue
        one, two = (1.0 - s, s, 0.0), (1.0 - t, t, 0.0)
        nodes, under = (i, j, i), (k, m, k)
        if near.edge_weight[at] < 0.0:  # the ends of an edge are its vertices': it fades to them
            flat = compute_edge_flatness(surface, x, a, n, -1.0) * compute_edge_flatness(
                surface, x, b, n, 1.0
            )
            fade = 16.0 * s * (1.0 - s) * t * (1.0 - t) * (1.0 - flat**FLATNESS_POWER)
            near.edge_weight[at] = fade * min(surface.edge_area[a], surface.edge_area[b])
            # what slides onto an edge begins without a force
            apart = subtract(
                blend_velocity(velocity, surface.place, nodes, one),
                blend_velocity(velocity, surface.place, under, two),
            )
            near.edge_start[at] = 0.0 if step == 0.0 or g + step * dot(apart, n) <= 0.0 else g
        if near.edge_weight[at] > 0.0:
            body, other = surface.edge_body[a], surface.edge_body[b]
            weight = near.edge_weight[at]
            k_n = weight * add_in_series(surface.modulus[body], surface.modulus[other])
            k_t = weight * add_in_series(surface.shear[body], surface.shear[other])
            g_eff = g - near.edge_start[at] if g > 0.0 else 0.0
            push_pair(
                c, velocity, step, near.edge_spring, at, (nodes, one), (under, two),
                (k, m, surface.edge_opposite[b, 0]), n, g_eff, k_n, k_t,
            )  # fmt: skip
        if g <= 0.0:
            near.edge_weight[at] = -1.0


@exact
def compute_walls_forces(c: Any, velocity: Any, step: float) -> float:  # pragma: no cover
    """Forces of the walls on points; greatest depth."""
    surface, walls, x = c.surface, c.walls, c.position
    deepest = 0.0
    for w in range(walls.point.shape[0]):
        n = read_row(walls.normal, w)
        total = (0.0, 0.0, 0.0)
        for q in range(surface.point_area.size):
            nodes = surface.point_node[q, 0], surface.point_node[q, 1], surface.point_node[q, 2]
            share = read_row(surface.point_share, q)
            g = -dot(subtract(blend(x, nodes, share), read_row(walls.point, w)), n)
            if g <= 0.0 and walls.weight[w, q] < 0.0:
                continue
            if g > 0.0 and walls.weight[w, q] < 0.0:
                walls.weight[w, q] = compute_point_weight(surface, x, q, n)
            if walls.weight[w, q] > 0.0:
                deepest = max(deepest, g)
                k_n = 2.0 * walls.weight[w, q] * surface.modulus[surface.point_body[q]]
                k_t = 2.0 * walls.weight[w, q] * surface.shear[surface.point_body[q]]
                way = scale(step, blend_velocity(velocity, surface.place, nodes, share))
                force = apply_law(c, walls.spring[w], q, n, g, way, k_n, k_t, walls.friction[w])
                add_force(c.force, nodes, share, force, 1.0)
                total = subtract(total, force)
            if g <= 0.0:
                walls.weight[w, q] = -1.0
        write_row(walls.force, w, total)
    return deepest


def build_surface_step(made_from: str) -> Any:
    """One step; ``made_from`` makes the sources it calls a part of its key on disk."""

    @njit(error_model="numpy", cache=True)
    def advance_surface(
        c: Any, displacement: Any, velocity: Any, step: float
    ) -> int:  # pragma: no cover
        """Contact at the new displacement; as `qdem_fem.contact.spheres.law.build_advance`."""
        stamp = made_from  # noqa: F841  (makes it a part of the key)
        far = 0.0
        for i in range(c.position.shape[0]):
            at, moved = c.surface.place[i], 0.0
            for k in range(3):
                c.position[i, k] = c.surface.reference[i, k] + displacement[at + k]
                c.force[i, k] = 0.0
                moved += (c.position[i, k] - c.start[i, k]) ** 2
            far = max(far, moved)
        if far > c.half_skin**2:
            return LOOK_AGAIN
        c.account[0] = 0.0
        moved = np.sqrt(far)
        deepest = max(
            compute_points_forces(c, velocity, step, moved), compute_walls_forces(c, velocity, step)
        )
        compute_edges_forces(c, velocity, step, moved)
        return TOO_DEEP if deepest > c.depth else GO_ON

    return advance_surface


advance_surfaces: Any = build_surface_step(digest_sources(__file__, *SOURCES))
