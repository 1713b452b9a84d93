"""Which spheres may touch: a cell list, and the tangential history carried from list to list.

A list holds all pairs of different bodies nearer than the sum of radii plus a skin; it is good
until a vertex has moved half the skin.  Pairs stand in the order of their two numbers: how
`qdem_fem.contact.search.cells` comes on them changes nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from qdem_fem.contact.search.cells import find_pairs, sort_rows
from qdem_fem.files import Floats, Integers

if TYPE_CHECKING:
    from qdem_fem.contact.search.periodic import PeriodicWidth


class Pairs(NamedTuple):
    """Pairs i < j by row i, and what each remembers."""

    first: Any  # first pair of every sphere, and the end, (c + 1,)
    second: Any  # (p,) sphere j of the pair
    back_first: Any  # first entry in ``back_pair`` of every sphere, and the end, (c + 1,)
    back_pair: Any  # (p,) the pairs in which a sphere is the second
    touching: Any  # (p,) uint8, whether the spheres touched when they were last looked at
    spring: Any  # (p, 3) tangential spring s, of i against j [m]
    pull: Any  # (p, 3) force on i [N]
    acting: Any  # (a,) the spheres to look at: those in a pair or near a wall
    image: Any  # (p, 3) from j to the image of it that i meets [m]; (0,) where nothing is periodic
    wall_first: Any  # first entry in ``wall`` of every sphere, and the end, (c + 1,)
    wall: Any  # the walls that each sphere is near


SEARCH = 12.0
"""What looking for the pairs of a sphere costs, over passing by a pair that does not touch in a
step.  Measured on heaps of 5,700 grains, where the step's optimum is flat."""


def choose_skin(
    skin: float, lasted: int, idle: int, spheres: int, least: float, most: float
) -> float:
    """Skin of the next list [m], from one of ``skin`` [m] with ``idle`` pairs that do not touch.

    That was good for the steps that it ``lasted``, and so cost ``SEARCH spheres/lasted`` in a step
    for the search and ``idle`` for passing by.  As both go with the skin, one down, one up, their
    sum is least where they are equal.  The skin is changed by a factor of two at most, within
    ``least`` and ``most`` [m]; forces do not depend on it.  No steps: something else asked for the
    list, and the skin stays.
    """
    if lasted == 0:
        return min(skin, most)
    factor = np.sqrt(SEARCH * spheres / (lasted * max(idle, 1)))
    return float(np.clip(skin * np.clip(factor, 0.5, 2.0), least, most))


def find_near_pairs(
    position: Floats, radius: Floats, body: Integers, skin: float
) -> tuple[Integers, Integers]:
    """Rows ``first`` (c + 1,) and ``second`` (p,) of all pairs nearer than their reach.

    ``position`` (c, 3) [m], ``radius`` (c,) [m], ``body`` (c,); a pair is of two bodies.
    """
    one, other = find_pairs(position, radius, body, skin)
    first, order = sort_rows(one, other, len(position))
    return first, other[order]


def find_periodic_pairs(
    position: Floats, radius: Floats, body: Integers, skin: float, side: PeriodicWidth
) -> tuple[Integers, Integers, Floats]:
    """As `find_near_pairs`, of spheres i and the nearest images of others j: also ``n W e`` (p, 3)
    [m].

    Positions are wrapped into one width, for the search alone; spheres near its lower side are
    there a second time, beyond its upper one.
    """
    axis, width, count = side.number, side.width, len(position)
    times = np.floor(position[:, axis] / width)
    wrapped = position.copy()
    wrapped[:, axis] -= times * width
    ghost = np.flatnonzero(wrapped[:, axis] <= 2 * radius.max(initial=0.0) + skin)
    own = np.concatenate([np.arange(count), ghost])
    wrapped = wrapped[own]
    wrapped[count:, axis] += width
    times = times[own]
    times[count:] -= 1
    one, other = find_pairs(wrapped, radius[own], body[own], skin)
    once = one < count  # two that are both there a second time are a pair already
    one, other = one[once], other[once]
    i, j, image = own[one], own[other], times[one] - times[other]
    image[i > j] *= -1
    i, j = np.minimum(i, j), np.maximum(i, j)
    first, order = sort_rows(i, j, count)
    return first, j[order], image[order, None] * side.way


@njit(cache=True)
def carry_history(old: Any, new: Any) -> None:  # pragma: no cover
    """Take what the pairs of ``old`` remember over to the same pairs of ``new``."""
    for i in range(old.first.size - 1):
        q = new.first[i]
        for p in range(old.first[i], old.first[i + 1]):
            if not old.touching[p]:
                continue
            while q < new.first[i + 1] and new.second[q] < old.second[p]:
                q += 1
            if q < new.first[i + 1] and new.second[q] == old.second[p]:
                new.touching[q] = old.touching[p]
                new.spring[q] = old.spring[p]
                new.pull[q] = old.pull[p]


NO_IMAGE: Floats = np.zeros(0)


def find_near_walls(
    position: Floats, radius: Floats, point: Floats, normal: Floats, way: float
) -> NDArray[np.bool_]:
    """Which spheres (c,) touch which walls (w,), or will on a ``way`` [m]; (c, w)."""
    near = [  # no BLAS between windows, as in `Assembly.kinetic`
        np.einsum("ck,k->c", position - p, n) - radius < way
        for p, n in zip(point, normal, strict=True)
    ]
    return np.array(near, dtype=bool).reshape(-1, len(position)).T


def make_pairs(
    first: Integers, second: Integers, walls: NDArray[np.bool_], image: Floats = NO_IMAGE
) -> Pairs:
    """Pairs without a history, from their rows; ``walls`` (c, w) that spheres are near."""
    count, size = len(second), len(first) - 1
    back_first, back_pair = sort_rows(second, np.arange(count), size)
    return Pairs(
        first,
        second,
        back_first,
        back_pair,
        np.zeros(count, np.uint8),
        np.zeros((count, 3)),
        np.zeros((count, 3)),
        np.flatnonzero((np.diff(first) > 0) | (np.diff(back_first) > 0) | walls.any(axis=1)),
        image,
        np.concatenate([[0], np.cumsum(walls.sum(axis=1))]),
        np.ascontiguousarray(np.nonzero(walls)[1]),
    )


def renew_pairs(
    old: Pairs | None, position: Floats, radius: Floats, body: Integers, skin: float,
    walls: NDArray[np.bool_], side: PeriodicWidth | None = None,
) -> Pairs:  # fmt: skip
    """The list for spheres at ``position`` (c, 3) [m], with the history of the ``old`` one."""
    if side is None:
        new = make_pairs(*find_near_pairs(position, radius, body, skin), walls)
    else:
        first, second, image = find_periodic_pairs(position, radius, body, skin, side)
        new = make_pairs(first, second, walls, image)
    if old is not None:
        carry_history(old, new)
    return new
