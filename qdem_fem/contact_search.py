"""Which spheres may touch: a cell list, and the tangential history carried from list to list.

A list holds all pairs of different bodies nearer than the sum of radii plus the mean of their
skins; it is good until a vertex has moved half of its skin.  Cells are hashed, so that memory goes
with the number of spheres and not with the room they are in.  Pairs stand in the order of their
two numbers: where the cells lie changes nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

if TYPE_CHECKING:
    from qdem_fem.periodic import PeriodicWidth

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class Pairs(NamedTuple):
    """Pairs i < j by row i, and what each remembers."""

    first: Any
    """First pair of every sphere, and the end, (c + 1,)."""
    second: Any
    """(p,) sphere j of the pair."""
    back_first: Any
    """First entry in ``back_pair`` of every sphere, and the end, (c + 1,)."""
    back_pair: Any
    """(p,) the pairs in which a sphere is the second."""
    touching: Any
    """(p,) uint8, whether the spheres touched when they were last looked at."""
    spring: Any
    """(p, 3) tangential spring s, of i against j [m]."""
    pull: Any
    """(p, 3) force on i [N]."""
    acting: Any
    """(a,) the spheres to look at: those in a pair or near a wall."""
    image: Any
    """(p, 3) from j to the image of it that i meets [m]; (0,) where nothing is periodic."""
    wall_first: Any
    """First entry in ``wall`` of every sphere, and the end, (c + 1,)."""
    wall: Any
    """The walls that each sphere is near."""


GOOD = 40
"""Steps that a list should be good for: a look costs 10 to 40 of them, and where it is due less
often, pairs that do not touch cost more than looks."""


def skins_next(way: Floats, lasted: int, least: float, most: float) -> Floats:
    """Skins of bodies [m], (b,), that at their present speed are good for `GOOD` steps.

    ``way`` (b,) [m]: greatest of a body's vertices in the ``lasted`` steps of the list before.
    Bodies at rest have the ``least`` skin and few pairs, whatever the others do.
    """
    return np.clip(2 * GOOD / lasted * way, least, most)


def ways_of(moved: Floats, first: Integers) -> Floats:
    """Greatest way of the vertices of each body [m], (b,); ``moved`` (c, 3) [m].

    ``first`` (b + 1,): first vertex of each body, and the end.
    """
    way = np.zeros(len(first) - 1)
    each = np.flatnonzero(np.diff(first))
    way[each] = np.maximum.reduceat(np.linalg.norm(moved, axis=1), first[each])
    return way


@njit(cache=True)
def cells_fill(position: Any, size: float) -> tuple[Any, Any, Any]:  # pragma: no cover
    """Cells (c, 3) of side ``size`` [m], first entry of every bucket, and spheres by bucket."""
    count = position.shape[0]
    buckets = 16
    while buckets < 2 * count:
        buckets *= 2
    cell = np.empty((count, 3), np.int64)
    start = np.zeros(buckets + 1, np.int64)
    bucket = np.empty(count, np.int64)
    for i in range(count):
        for c in range(3):
            cell[i, c] = np.int64(np.floor(position[i, c] / size))
        bucket[i] = cell_bucket(cell[i, 0], cell[i, 1], cell[i, 2], buckets)
        start[bucket[i] + 1] += 1
    for b in range(buckets):
        start[b + 1] += start[b]
    at = start[:-1].copy()
    order = np.empty(count, np.int64)
    for i in range(count):
        order[at[bucket[i]]] = i
        at[bucket[i]] += 1
    return cell, start, order


@njit(cache=True)
def cell_bucket(x: int, y: int, z: int, buckets: int) -> int:  # pragma: no cover
    """Bucket of a cell; ``buckets`` is a power of two."""
    mixed = x * 73856093 ^ y * 19349663 ^ z * 83492791
    return (mixed ^ (mixed >> 17)) & (buckets - 1)


@njit(cache=True)
def pairs_near(
    position: Any, radius: Any, body: Any, skin: Any
) -> tuple[Any, Any]:  # pragma: no cover
    """Rows ``first`` (c + 1,) and ``second`` (p,) of all pairs nearer than their reach.

    ``position`` (c, 3) [m], ``radius``, ``skin`` (c,) [m], ``body`` (c,); a pair is of two bodies.
    """
    count = position.shape[0]
    first = np.zeros(count + 1, np.int64)
    second = np.empty(max(16, 4 * count), np.int64)
    if count == 0:
        return first, second[:0]
    size = 2 * radius.max() + skin.max()
    cell, start, order = cells_fill(position, size)
    buckets = start.size - 1
    found = 0
    for i in range(count):
        row = found
        for step in range(27):
            x = cell[i, 0] + step // 9 - 1
            y = cell[i, 1] + step // 3 % 3 - 1
            z = cell[i, 2] + step % 3 - 1
            b = cell_bucket(x, y, z, buckets)
            for q in range(start[b], start[b + 1]):
                j = order[q]
                if j <= i or body[j] == body[i]:
                    continue
                if cell[j, 0] != x or cell[j, 1] != y or cell[j, 2] != z:
                    continue  # another cell of the same bucket
                reach = radius[i] + radius[j] + 0.5 * (skin[i] + skin[j])
                apart = 0.0
                for c in range(3):
                    apart += (position[i, c] - position[j, c]) ** 2
                if apart > reach * reach:
                    continue
                if found == second.size:
                    longer = np.empty(2 * found, np.int64)
                    longer[:found] = second
                    second = longer
                at = found  # rows are short: sort by insertion
                while at > row and second[at - 1] > j:
                    second[at] = second[at - 1]
                    at -= 1
                second[at] = j
                found += 1
        first[i + 1] = found
    return first, second[:found].copy()


def pairs_periodic(
    position: Floats, radius: Floats, body: Integers, skin: Floats, side: PeriodicWidth
) -> tuple[Integers, Integers, Floats]:
    """As `pairs_near`, of spheres i and the nearest images of others j: also ``n W e`` (p, 3) [m].

    Positions are wrapped into one width, for the search alone; spheres near its lower side are
    there a second time, beyond its upper one.
    """
    axis, width, count = side.number, side.width, len(position)
    times = np.floor(position[:, axis] / width)
    wrapped = position.copy()
    wrapped[:, axis] -= times * width
    reach = 2 * radius.max(initial=0.0) + skin.max(initial=0.0)
    ghost = np.flatnonzero(wrapped[:, axis] <= reach)
    own = np.concatenate([np.arange(count), ghost])
    wrapped = wrapped[own]
    wrapped[count:, axis] += width
    times = times[own]
    times[count:] -= 1
    first, second = pairs_near(wrapped, radius[own], body[own], skin[own])
    row = np.repeat(np.arange(len(own)), np.diff(first))
    once = row < count  # two that are both there a second time are a pair already
    one, other = row[once], second[once]
    i, j, image = own[one], own[other], times[one] - times[other]
    turned = i > j
    image[turned] *= -1
    i, j = np.minimum(i, j), np.maximum(i, j)
    order = np.lexsort((j, i))
    rows = np.concatenate([[0], np.cumsum(np.bincount(i, minlength=count))])
    return rows, j[order], image[order, None] * side.way


@njit(cache=True)
def history_carry(old: Any, new: Any) -> None:  # pragma: no cover
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


def walls_near(
    position: Floats, radius: Floats, point: Floats, normal: Floats, way: Floats
) -> NDArray[np.bool_]:
    """Which spheres (c,) touch which walls (w,), or will on their ``way`` (c,) [m]; (c, w)."""
    apart = np.einsum("cwk,wk->cw", position[:, None] - point, normal)
    return np.asarray(apart < (radius + way)[:, None])


def pairs_of(
    first: Integers, second: Integers, walls: NDArray[np.bool_], image: Floats = NO_IMAGE
) -> Pairs:
    """Pairs without a history, from their rows; ``walls`` (c, w) that spheres are near."""
    count, size = len(second), len(first) - 1
    back = np.bincount(second, minlength=size)
    return Pairs(
        first,
        second,
        np.concatenate([[0], np.cumsum(back)]),
        np.argsort(second, kind="stable"),
        np.zeros(count, np.uint8),
        np.zeros((count, 3)),
        np.zeros((count, 3)),
        np.flatnonzero((np.diff(first) > 0) | (back > 0) | walls.any(axis=1)),
        image,
        np.concatenate([[0], np.cumsum(walls.sum(axis=1))]),
        np.nonzero(walls)[1],
    )


def pairs_renew(
    old: Pairs | None, position: Floats, radius: Floats, body: Integers, skin: Floats,
    walls: NDArray[np.bool_], side: PeriodicWidth | None = None,
) -> Pairs:  # fmt: skip
    """The list for spheres at ``position`` (c, 3) [m], with the history of the ``old`` one."""
    if side is None:
        new = pairs_of(*pairs_near(position, radius, body, skin), walls)
    else:
        first, second, image = pairs_periodic(position, radius, body, skin, side)
        new = pairs_of(first, second, walls, image)
    if old is not None:
        history_carry(old, new)
    return new
