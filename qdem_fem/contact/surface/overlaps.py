"""The compiled contact of faces by the exact area of their overlaps, and of faces with walls.

See `qdem_fem.contact.surface.clip` for the energy of an overlap.  Friction is one spring a pair of
faces, of ``p_t`` times the area: where the area grows, what is new comes without a force, and where
it shrinks, what leaves loses its energy; both count as work of friction.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from qdem_fem.contact.spheres import image_less, put_row, row, series, slider
from qdem_fem.contact.surface.clip import (
    COLUMNS,
    CORNERS,
    OPPOSED,
    RIM,
    cut,
    overlap_forces,
    polygon_sums,
    triangle_normal,
)
from qdem_fem.contact.surface.geometry import dot, less, scaled, velocity_of
from qdem_fem.kernel import exact, inlined

TURN = 0.2
"""Angle that the normals of two faces may turn by before they are looked at again."""


@inlined
def corners_of(x: Any, face: Any, f: int) -> Any:  # pragma: no cover
    """The three corners of a face [m]."""
    return row(x, face[f, 0]), row(x, face[f, 1]), row(x, face[f, 2])


@exact
def height_of(a: Any, double: float) -> float:  # pragma: no cover
    """Least height of a triangle of twice the area ``double`` [m^2]."""
    longest = 0.0
    for k in range(3):
        side = less(a[k], a[k - 1])
        longest = max(longest, dot(side, side))
    return double / np.sqrt(longest)


@exact
def way_free(a: Any, b: Any, reach: float) -> float:  # pragma: no cover
    """Way [m] that two triangles are short of overlapping by zero to ``reach`` at least.

    One lies before the plane of the other by so much, or their boxes are apart by more than what
    they may have of ``reach`` along an axis, or they do not oppose each other.  The last two hold
    while their normals turn by less than `TURN`: no more than `TURN` / 2 of the heights is free.
    """
    n_a, double_a = triangle_normal(a)
    n_b, double_b = triangle_normal(b)
    before_a, before_b = np.inf, np.inf
    for k in range(3):
        before_a = min(before_a, dot(less(b[k], a[0]), n_a))
        before_b = min(before_b, dot(less(a[k], b[0]), n_b))
    most = 0.5 * TURN * min(height_of(a, double_a), height_of(b, double_b))
    if dot(n_a, n_b) > 2.0 * TURN - OPPOSED:
        return max(most, before_a, before_b)
    length = np.sqrt(2.0 - 2.0 * dot(n_a, n_b))
    far = -np.inf
    for c in range(3):
        low_a, high_a = min(a[0][c], a[1][c], a[2][c]), max(a[0][c], a[1][c], a[2][c])
        low_b, high_b = min(b[0][c], b[1][c], b[2][c]), max(b[0][c], b[1][c], b[2][c])
        deep = reach * (abs(n_b[c] - n_a[c]) / length + TURN)
        far = max(far, low_a - high_b - deep, low_b - high_a - deep)
    return max(min(far, most), before_a, before_b)


@inlined
def spring_fit(spring: Any, before: float, now: float) -> Any:  # pragma: no cover
    """A spring [m] whose area [m^2] changes, and the energy lost over half its stiffness [m^4]."""
    square = dot(spring, spring)
    if before <= 0.0:
        return (0.0, 0.0, 0.0), 0.0
    if now > before:
        share = before / now
        return scaled(share, spring), before * square * (1.0 - share)
    return spring, (before - now) * square


@inlined
def pair_forces(
    c: Any, at: int, velocity: Any, step: float, moved: float, room: Any, sums: Any
) -> None:  # pragma: no cover
    """Forces of one pair of faces on their corners, its spring and its account."""
    surface, pairs, x = c.surface, c.overlaps, c.position
    pairs.account[at, 0], pairs.account[at, 1], pairs.account[at, 2] = 0.0, 0.0, 0.0
    before = pairs.area[at]
    if moved < pairs.free[at]:
        return
    f, g = pairs.faces[at, 0], pairs.faces[at, 1]
    a, b = corners_of(x, surface.face, f), corners_of(x, surface.face, g)
    a = (
        image_less(a[0], pairs.image, at), image_less(a[1], pairs.image, at),
        image_less(a[2], pairs.image, at),
    )  # fmt: skip
    if before < 0.0:
        way = way_free(a, b, c.depth)
        pairs.free[at] = 0.5 * way - moved
        if way > 0.0:
            return
    one, other = surface.face_body[f], surface.face_body[g]
    pull, own = pairs.pull[at], pairs.share[at]
    energy, deep, weight, n = overlap_forces(
        a, b, series(surface.modulus[one], surface.modulus[other]), c.depth, room, sums, pull
    )
    if deep == 0.0 and before < 0.0:
        return
    shear = series(surface.shear[one], surface.shear[other])
    now = weight * sums[7] if deep > 0.0 else 0.0
    spring, lost = spring_fit(row(pairs.spring, at), before, now)
    lost *= 0.5 * shear
    pairs.area[at] = now if deep > 0.0 else -1.0
    if deep > 0.0:
        total = sums[0] + sums[1] + sums[2]
        for k in range(6):
            own[k] = sums[k] / total
        slid = scaled(step, less(
            velocity_of(velocity, surface.place, row(surface.face, f), (own[0], own[1], own[2])),
            velocity_of(velocity, surface.place, row(surface.face, g), (own[3], own[4], own[5])),
        ))  # fmt: skip
        push = weight * series(surface.modulus[one], surface.modulus[other]) * total
        spring, slipped = slider(spring, n, slid, shear * now, c.friction * push)
        lost += slipped
        for k in range(3):
            for d in range(3):
                pull[k, d] -= own[k] * shear * now * spring[d]
                pull[3 + k, d] += own[3 + k] * shear * now * spring[d]
    else:
        spring = (0.0, 0.0, 0.0)
    put_row(pairs.spring, at, spring)
    pairs.account[at, 0] = energy + 0.5 * shear * now * dot(spring, spring)
    pairs.account[at, 1], pairs.account[at, 2] = lost, deep


@exact
def overlaps_forces(c: Any, velocity: Any, step: float, moved: float) -> float:  # pragma: no cover
    """Forces of all pairs of faces; greatest depth.  ``moved`` as of `points_forces`."""
    pairs, deepest = c.overlaps, 0.0
    room, sums = np.empty((2, CORNERS, COLUMNS)), np.empty(8)
    for at in range(pairs.area.size):
        pair_forces(c, at, velocity, step, moved, room, sums)
    for at in range(pairs.area.size):
        c.account[0] += pairs.account[at, 0]
        c.account[1] += pairs.account[at, 1]
        deepest = max(deepest, pairs.account[at, 2])
        if pairs.area[at] < 0.0:
            continue
        for side in range(2):
            for k in range(3):
                i = c.surface.face[pairs.faces[at, side], k]
                for d in range(3):
                    c.force[i, d] += pairs.pull[at, 3 * side + k, d]
    return deepest


@exact
def wall_faces_forces(c: Any, velocity: Any, step: float) -> float:  # pragma: no cover
    """Forces of the walls on faces by the part that is behind them; greatest depth.

    ``W = integral of p g^2`` over the wall, with the sign of the faces: what is behind it, as a
    volume, so that its gradient is a pressure ``2 p g`` on them.
    """
    surface, walls, x = c.surface, c.walls, c.position
    room, sums = np.empty((2, CORNERS, COLUMNS)), np.empty(8)
    deepest, first = 0.0, surface.point_area.size
    for w in range(walls.point.shape[0]):
        n, base = row(walls.normal, w), row(walls.point, w)
        total = (0.0, 0.0, 0.0)
        for f in range(surface.face.shape[0]):
            if surface.face_body[f] < 0:
                continue  # an image of another face
            at = first + f
            a, before, deep = corners_of(x, surface.face, f), walls.weight[w, at], 0.0
            for k in range(3):
                room[0, k, 6], room[0, k, 7] = dot(less(base, a[k]), n), RIM
                deep = max(deep, room[0, k, 6])
                for d in range(6):
                    room[0, k, d] = 1.0 if d % 3 == k else 0.0
            if deep == 0.0 and before < 0.0:
                continue
            n_a, double = triangle_normal(a)
            count = cut(room[0], 3, room[1], 6, RIM)
            polygon_sums(room[1], count, double, sums)
            against = max(0.0, -dot(n_a, n))
            modulus, shear = (
                2.0 * surface.modulus[surface.face_body[f]],
                2.0 * surface.shear[surface.face_body[f]],
            )
            now, deepest = against * sums[7], max(deepest, deep)
            spring, lost = spring_fit(row(walls.spring[w], at), before, now)
            lost *= 0.5 * shear
            walls.weight[w, at] = now if deep > 0.0 else -1.0
            pressed = sums[0] + sums[1] + sums[2]
            if pressed > 0.0:
                share = sums[0] / pressed, sums[1] / pressed, sums[2] / pressed
                way = scaled(
                    step, velocity_of(velocity, surface.place, row(surface.face, f), share)
                )
                limit = walls.friction[w] * modulus * pressed * against
                spring, slipped = slider(spring, n, way, shear * now, limit)
                lost += slipped
                for k in range(3):
                    for d in range(3):
                        force = -modulus * sums[k] * n_a[d] - share[k] * shear * now * spring[d]
                        c.force[surface.face[f, k], d] += force
                pull = scaled(modulus * pressed, n_a)
                total = (
                    total[0] + pull[0] + shear * now * spring[0],
                    total[1] + pull[1] + shear * now * spring[1],
                    total[2] + pull[2] + shear * now * spring[2],
                )
            else:
                spring = (0.0, 0.0, 0.0)
            put_row(walls.spring[w], at, spring)
            c.account[0] -= 0.5 * modulus * sums[6] * dot(n_a, n)
            c.account[0] += 0.5 * shear * now * dot(spring, spring)
            c.account[1] += lost
        for d in range(3):
            walls.force[w, d] += total[d]
    return deepest
