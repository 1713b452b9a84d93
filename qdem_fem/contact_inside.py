"""Bodies that begin in each other so deep that no contact sees it, and none would part them.

Spheres are at vertices, points of surfaces look no further than their greatest depth: what lies
deeper in another body than a sphere's radius, or that depth, feels nothing and goes on unseen.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from qdem_fem.contact_kernel import row
from qdem_fem.contact_surface_geometry import depth_of
from qdem_fem.errors import ContactTooDeep

if TYPE_CHECKING:
    from qdem_fem.body import Body

Floats = NDArray[np.float64]


@njit(cache=True)
def first_inside(
    point: Any, first_point: Any, position: Any, face: Any, first_face: Any, low: Any, high: Any,
    depth: float,
) -> tuple[int, int, float]:  # fmt: skip  # pragma: no cover
    """Two bodies of which the first has a point below the second's faces by more than ``depth``.

    ``point`` (p, 3), ``position`` (n, 3) [m]; ``face`` (f, 3); ``first_point``, ``first_face``
    (bodies + 1,); ``low``, ``high`` (bodies, 3): boxes [m].  Bodies and way [m]; -1: there are
    none.
    """
    for b in range(len(low)):
        faces = np.arange(first_face[b], first_face[b + 1])
        for a in range(len(low)):
            apart = a == b
            for k in range(3):
                apart |= low[a, k] > high[b, k] - depth or high[a, k] < low[b, k] + depth
            if apart:
                continue
            for q in range(first_point[a], first_point[a + 1]):
                outside = False
                for k in range(3):
                    outside |= not low[b, k] + depth < point[q, k] < high[b, k] - depth
                if not outside:
                    g = depth_of(row(point, q), position, face, faces)[0]
                    if g > depth:
                        return a, b, g
    return -1, -1, 0.0


def inside_check(bodies: Sequence[Body], displacement: Floats, depth: float, where: str) -> None:
    """Raise `ContactTooDeep` for bodies deeper in each other than ``depth`` [m], (n, 3) moved [m].

    What is looked for are nodes and centres of elements; not for images across a width.
    """
    first = np.concatenate([[0], np.cumsum([len(body.nodes) for body in bodies])])
    position = np.concatenate([body.nodes for body in bodies]) + displacement
    points, faces, boxes = [], [], []
    for body, start, stop in zip(bodies, first[:-1], first[1:], strict=True):
        own = position[start:stop]
        centres = own[body.elements].mean(axis=1)
        points.append(np.concatenate([own[np.unique(body.elements)], centres]))
        faces.append(body.surface + start)
        boxes.append((points[-1].min(axis=0), points[-1].max(axis=0)))
    low, high = np.array(boxes).transpose(1, 0, 2)
    counts = [np.cumsum([0, *(len(part) for part in parts)]) for parts in (points, faces)]
    one, other, way = first_inside(
        np.concatenate(points), counts[0], position, np.concatenate(faces), counts[1],
        np.ascontiguousarray(low), np.ascontiguousarray(high), depth,
    )  # fmt: skip
    if one >= 0:
        raise ContactTooDeep(
            f"{bodies[one].name} lies {way:.3g} m below the surface of {bodies[other].name}, where "
            "no contact sees it",
            where=where,
            remedy="begin with bodies that do not overlap",
        )
