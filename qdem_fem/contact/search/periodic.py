"""Bodies with periodic faces, and a width that contact repeats in.

A layer of width W stands for endless copies of itself, W apart along one axis.  Coordinates are
never wrapped: a body may leave the width any number of times.  What is periodic is contact: of a
vertex i and the images ``x_j + n W e`` of a vertex j, i meets the nearest,

    d = x_i - x_j - n W e,

and n is found when pairs are looked for, and kept with them.  So a force depends on ``d`` alone,
wherever the side is, and a spring does not know that its bodies cross it.

Where a body and its own image would touch, contact of a body with itself would be needed, which is
not computed: such a body is refused, and so is one whose faces `find_partners` has joined along the
axis.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from qdem_fem.files import ConditionError, Floats, Integers, is_real

if TYPE_CHECKING:
    from qdem_fem.bodies import Body


WHERE = "contact, periodic"
NEAR = 1e-6
"""Share of the width within which joined nodes do not lie apart along the axis.  Mesh files keep
single precision or a few digits."""


@dataclass(frozen=True)
class PeriodicWidth:
    """The layer repeats along ``axis`` every ``width`` [m].  Raises `ConditionError`."""

    axis: Literal["x", "y", "z"]
    width: float

    def __post_init__(self) -> None:
        if self.axis not in ("x", "y", "z"):
            raise ConditionError(f"there is no axis {self.axis!r}; x, y, z are", where=WHERE)
        if not (is_real(self.width) and np.isfinite(self.width) and self.width > 0):
            raise ConditionError(f"a width of {self.width!r} m", where=WHERE)

    @property
    def number(self) -> int:
        """0, 1, 2 for x, y, z."""
        return "xyz".index(self.axis)

    @property
    def way(self) -> Floats:
        """``W e`` [m], (3,): from an image to the next."""
        return np.asarray(self.width * np.eye(3)[self.number])


def find_partners(
    nodes: Floats, a: Integers, b: Integers, tolerance: float, name: str
) -> tuple[Integers, Integers]:
    """Pairs ``(a[i], b[j])`` of nodes that differ by the shift between the two faces.

    ``nodes`` (n, 3) [m]; ``tolerance`` over the size of the body [-].  Raises `ConditionError`
    naming a node without a partner.
    """
    from scipy.spatial import cKDTree

    if not (is_real(tolerance) and tolerance >= 0):
        raise ConditionError(f"a tolerance of {tolerance!r}", where="periodic", remedy="take 1e-6")
    if both := np.intersect1d(a, b).tolist():
        raise ConditionError(
            f"node {both[0]} of {name} is named on both faces", where="periodic",
            remedy="name two opposite faces",
        )  # fmt: skip
    if len(a) != len(b):
        raise ConditionError(
            f"{len(a)} nodes on one face of {name} and {len(b)} on the other",
            where="periodic", remedy="mesh both faces alike",
        )  # fmt: skip
    shift = nodes[b].mean(axis=0) - nodes[a].mean(axis=0)
    distance, place = cKDTree(nodes[b]).query(nodes[a] + shift)
    size = np.ptp(nodes, axis=0).max()
    worst = int(np.argmax(distance))
    if distance[worst] > tolerance * size or len(np.unique(place)) != len(place):
        raise ConditionError(
            f"node {a[worst]} of {name} has no partner: the nearest, {b[place[worst]]}, is "
            f"{distance[worst]:.3g} m from where it should be",
            where="periodic", remedy="mesh both faces alike, or give a larger tolerance",
        )  # fmt: skip
    return a, b[place]


def check_joined(body: Body, master: Integers, side: PeriodicWidth, where: str) -> None:
    """Raise `ConditionError` for faces that are joined along the axis."""
    apart = body.nodes[:, side.number] - body.nodes[master, side.number]
    most = float(np.abs(apart).max(initial=0.0))
    if most > NEAR * side.width:
        raise ConditionError(
            f"faces of {body.name} are joined over {most:.4g} m along {side.axis}, where contact "
            f"repeats every {side.width:.4g} m",
            where=where, remedy="do not join it along this axis",
        )  # fmt: skip


def find_extents(along: Floats, first: Integers) -> Floats:
    """Extent of each body along an axis [m], (bodies,).

    ``along`` (c,): coordinates of the vertices of all bodies [m]; ``first`` (bodies + 1,): first
    vertex of each body, and the end.
    """
    each = np.flatnonzero(np.diff(first))
    size = np.zeros(len(first) - 1)
    low, high = (extreme.reduceat(along, first[each]) for extreme in (np.minimum, np.maximum))
    size[each] = high - low
    return size


def check_extents(
    bodies: Sequence[Body], size: Floats, reach: float, side: PeriodicWidth, where: str
) -> float:
    """Raise `ConditionError` for a body that comes within ``reach`` [m] of its own image.

    ``size``: `find_extents` of the bodies along the axis [m].  Returns by how much the reach could
    be more [m].
    """
    room = side.width / 2 - reach
    if room <= 0:
        raise ConditionError(
            f"a width of {side.width:.4g} m is less than two reaches of a contact, of "
            f"{reach:.4g} m each",
            where=where, remedy="take a wider layer",
        )  # fmt: skip
    left = side.width - reach - size
    if (left <= 0).any():
        at = int(np.argmin(left))
        raise ConditionError(
            f"{bodies[at].name} is {size[at]:.4g} m long along {side.axis}: with a reach of "
            f"contact of {reach:.4g} m it would touch its own image, {side.width:.4g} m from it",
            where=where, remedy="take a wider layer",
        )  # fmt: skip
    return min(room, float(left.min()))
