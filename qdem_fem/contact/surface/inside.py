"""Bodies that begin in each other so deep that no contact sees it, and none would part them.

Spheres are at vertices, points of surfaces look no further than their greatest depth: what lies
deeper in another body than a sphere's radius, or that depth, feels nothing and goes on unseen.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numba import njit

from qdem_fem.contact.surface.geometry import blend, find_depth
from qdem_fem.files import ContactTooDeep, Floats
from qdem_fem.kernel import read_row

if TYPE_CHECKING:
    from qdem_fem.bodies import Body
    from qdem_fem.contact.search import PeriodicWidth


@njit(cache=True)
def find_first_inside(
    point: Any, first_point: Any, position: Any, face: Any, first_face: Any, low: Any, high: Any,
    depth: float, shift: Any,
) -> tuple[int, int, float]:  # fmt: skip  # pragma: no cover
    """Two bodies of which the first has a point below the second's faces by more than ``depth``.

    ``point`` (p, 3), ``position`` (n, 3) [m]; ``face`` (f, 3); ``first_point``, ``first_face``
    (bodies + 1,); ``low``, ``high`` (bodies, 3): boxes [m]; ``shift`` (3,) [m]: of the first body.
    Bodies and way [m]; -1: there are none.
    """
    for b in range(len(low)):
        faces = np.arange(first_face[b], first_face[b + 1])
        for a in range(len(low)):
            apart = a == b
            for k in range(3):
                apart |= low[a, k] + shift[k] > high[b, k] - depth
                apart |= high[a, k] + shift[k] < low[b, k] + depth
            if apart:
                continue
            for q in range(first_point[a], first_point[a + 1]):
                x, y, z = point[q, 0] + shift[0], point[q, 1] + shift[1], point[q, 2] + shift[2]
                outside = not low[b, 0] + depth < x < high[b, 0] - depth
                outside |= not low[b, 1] + depth < y < high[b, 1] - depth
                outside |= not low[b, 2] + depth < z < high[b, 2] - depth
                if not outside:
                    g = find_depth((x, y, z), position, face, faces)[0]
                    if g > depth:
                        return a, b, g
    return -1, -1, 0.0


@njit(cache=True)
def find_overlap(surface: Any, near: Any, x: Any) -> tuple[float, int, int]:  # pragma: no cover
    """Depth [m] of the deepest of the points that touch, the point, and the body that it is in."""
    deepest, point, other = 0.0, 0, 0
    for at in range(near.point.size):
        if near.weight[at] > 0.0:
            q = near.point[at]
            nodes = surface.point_node[q, 0], surface.point_node[q, 1], surface.point_node[q, 2]
            p = blend(x, nodes, read_row(surface.point_share, q))
            faces = near.face[near.first[at] : near.first[at + 1]]
            g = find_depth(p, x, surface.face, faces)[0]
            if g > deepest:
                deepest, point, other = g, q, near.body[at]
    return deepest, point, other


def check_inside(
    bodies: Sequence[Body], displacement: Floats, depth: float, side: PeriodicWidth | None,
    where: str,
) -> None:  # fmt: skip
    """Raise `ContactTooDeep` for bodies deeper in each other than ``depth`` [m], (n, 3) moved [m].

    What is looked for are nodes and centres of elements, of images across a width, too.
    """
    first = np.concatenate([[0], np.cumsum([len(body.nodes) for body in bodies])])
    position = np.concatenate([body.nodes for body in bodies]) + displacement
    shifts = np.zeros((1, 3))
    if side is not None:  # all bodies within one width, and their images on both sides of it
        middle = np.add.reduceat(position[:, side.number], first[:-1]) / np.diff(first)
        widths = np.repeat(np.floor(middle / side.width), np.diff(first))
        position = position - widths[:, None] * side.way
        shifts = np.array([[0.0], [-1.0], [1.0]]) * side.way
    points, faces, boxes = [], [], []
    for body, start, stop in zip(bodies, first[:-1], first[1:], strict=True):
        own = position[start:stop]
        centres = own[body.elements].mean(axis=1)
        points.append(np.concatenate([own[np.unique(body.elements)], centres]))
        faces.append(body.surface + start)
        boxes.append((points[-1].min(axis=0), points[-1].max(axis=0)))
    low, high = np.array(boxes).transpose(1, 0, 2)
    counts = [np.cumsum([0, *(len(part) for part in parts)]) for parts in (points, faces)]
    for shift in shifts:
        one, other, way = find_first_inside(
            np.concatenate(points), counts[0], position, np.concatenate(faces), counts[1],
            np.ascontiguousarray(low), np.ascontiguousarray(high), depth, shift,
        )  # fmt: skip
        if one < 0:
            continue
        across = " across the width" if shift.any() else ""
        raise ContactTooDeep(
            f"{bodies[one].name} lies {way:.3g} m below the surface of {bodies[other].name}"
            f"{across}, where no contact sees it",
            where=where, remedy="begin with bodies that do not overlap",
        )  # fmt: skip
