"""Spheres nearer than their reach: patches of bodies by a cell list, then spheres of two patches.

A sphere of a grain has some four hundred others in the cells around it, most of them of its own
body or on the far side of a neighbour.  So what is looked for first are patches that are near: all
spheres of a body in a cell of three reaches, a ballast grain as a whole.  Of two such patches only
those spheres are compared that lie in the box around the other one.  Patches are made again for
every list, from where the spheres are; their cells are hashed, so that memory goes with the number
of spheres and not with the room they are in.
"""

from typing import Any

import numpy as np
from numba import njit

PATCH = 3.0
"""Side of a patch over the greatest reach of two spheres."""
SLACK, ROUNDING = 1e-9, 1e-15
"""By which boxes are larger, over the reach and over where they are: their edges are rounded."""
MOST_CELLS = 2.0**40
"""Of one body; in more than these its patches are larger."""


@njit(cache=True)
def fill_cells(position: Any, size: float) -> tuple[Any, Any, Any]:  # pragma: no cover
    """Cells (c, 3) of side ``size`` [m], first entry of every bucket, and points by bucket."""
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
        bucket[i] = find_cell_bucket(cell[i, 0], cell[i, 1], cell[i, 2], buckets)
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
def find_cell_bucket(x: int, y: int, z: int, buckets: int) -> int:  # pragma: no cover
    """Bucket of a cell; ``buckets`` is a power of two."""
    mixed = x * 73856093 ^ y * 19349663 ^ z * 83492791
    return (mixed ^ (mixed >> 17)) & (buckets - 1)


@njit(cache=True)
def make_patches(position: Any, body: Any, side: float) -> tuple[Any, Any]:  # pragma: no cover
    """First entry (g + 1,) of every patch in ``order`` (c,), the spheres patch by patch.

    A patch: the spheres of one body in a cube of ``side`` [m], counted from the body's low corner.
    """
    count = position.shape[0]
    order = np.argsort(body, kind="mergesort")
    first = np.empty(count + 1, np.int64)
    key = np.empty(count)
    patches = begin = 0
    while begin < count:
        end = begin + 1
        while end < count and body[order[end]] == body[order[begin]]:
            end += 1
        low, cells = np.full(3, np.inf), np.ones(3)
        for c in range(3):
            high = -np.inf
            for q in range(begin, end):
                low[c] = min(low[c], position[order[q], c])
                high = max(high, position[order[q], c])
            cells[c] = np.floor((high - low[c]) / side) + 1
        size = side * max(1.0, np.cbrt(cells[0] * cells[1] * cells[2] / MOST_CELLS))
        if cells[0] * cells[1] * cells[2] > 1:
            for q in range(begin, end):
                key[q] = 0.0
                for c in range(3):
                    key[q] = cells[c] * key[q] + np.floor((position[order[q], c] - low[c]) / size)
            sorting = np.argsort(key[begin:end], kind="mergesort")
            order[begin:end] = order[begin:end][sorting]
            key[begin:end] = key[begin:end][sorting]
        else:
            key[begin:end] = 0.0
        for q in range(begin, end):
            if q == begin or key[q] != key[q - 1]:
                first[patches] = q
                patches += 1
        begin = end
    first[patches] = count
    return first[: patches + 1].copy(), order


@njit(cache=True)
def make_boxes_around(
    position: Any, radius: Any, skin: float, first: Any, order: Any
) -> tuple[Any, Any]:  # pragma: no cover
    """Low and high corners (g, 3) [m] of boxes around patches: they meet where spheres may."""
    patches = first.size - 1
    low, high = np.full((patches, 3), np.inf), np.full((patches, 3), -np.inf)
    for g in range(patches):
        for q in range(first[g], first[g + 1]):
            i = order[q]
            way = compute_half_reach(radius[i], skin)
            for c in range(3):
                room = way + ROUNDING * abs(position[i, c])
                low[g, c] = min(low[g, c], position[i, c] - room)
                high[g, c] = max(high[g, c], position[i, c] + room)
    return low, high


@njit(cache=True, inline="always")
def compute_half_reach(radius: float, skin: float) -> float:  # pragma: no cover
    """What a sphere adds to the reach of a pair [m], with slack."""
    return (1.0 + SLACK) * (radius + 0.5 * skin)


@njit(cache=True)
def collect_inside(
    position: Any, radius: Any, skin: float, mine: Any, low: Any, high: Any, found: Any
) -> int:  # pragma: no cover
    """Put those of the spheres ``mine`` into ``found`` that reach into a box; how many."""
    count = 0
    for i in mine:
        way = compute_half_reach(radius[i], skin)
        inside = True
        for c in range(3):
            room = way + ROUNDING * abs(position[i, c])
            inside &= position[i, c] + room >= low[c] and position[i, c] - room <= high[c]
        if inside:
            found[count] = i
            count += 1
    return count


@njit(cache=True)
def find_pairs(
    position: Any, radius: Any, body: Any, skin: float
) -> tuple[Any, Any]:  # pragma: no cover
    """Both spheres (p,), i < j, of all pairs nearer than their reach, in no order.

    ``position`` (c, 3) [m], ``radius`` (c,) [m], ``body`` (c,); a pair is of two bodies.
    """
    if radius.size == 0:
        return np.empty(0, np.int64), np.empty(0, np.int64)
    first, order = make_patches(position, body, PATCH * (2 * radius.max() + skin))
    low, high = make_boxes_around(position, radius, skin, first, order)
    cell, start, boxes = fill_cells(0.5 * (low + high), (high - low).max())
    buckets, longest = start.size - 1, np.diff(first).max()
    here, there = np.empty(longest, np.int64), np.empty(longest, np.int64)
    one, other, found = np.empty(1024, np.int64), np.empty(1024, np.int64), 0
    for g in range(first.size - 1):
        own = order[first[g] : first[g + 1]]
        for step in range(27):
            x = cell[g, 0] + step // 9 - 1
            y = cell[g, 1] + step // 3 % 3 - 1
            z = cell[g, 2] + step % 3 - 1
            bucket = find_cell_bucket(x, y, z, buckets)
            for entry in range(start[bucket], start[bucket + 1]):
                h = boxes[entry]
                if h <= g or body[order[first[h]]] == body[own[0]]:
                    continue
                if cell[h, 0] != x or cell[h, 1] != y or cell[h, 2] != z:
                    continue  # another cell of the same bucket
                meet = True
                for c in range(3):
                    meet &= low[g, c] <= high[h, c] and low[h, c] <= high[g, c]
                if not meet:
                    continue
                more = order[first[h] : first[h + 1]]
                ours = collect_inside(position, radius, skin, own, low[h], high[h], here)
                theirs = collect_inside(position, radius, skin, more, low[g], high[g], there)
                most = found + ours * theirs
                if most > one.size:
                    one, other = grow_array(one, most), grow_array(other, most)
                for i in here[:ours]:
                    for j in there[:theirs]:
                        reach = radius[i] + radius[j] + skin
                        apart = 0.0
                        for c in range(3):
                            apart += (position[i, c] - position[j, c]) ** 2
                        if apart <= reach * reach:
                            one[found], other[found] = min(i, j), max(i, j)
                            found += 1
    return one[:found], other[:found]


@njit(cache=True)
def grow_array(array: Any, least: int) -> Any:  # pragma: no cover
    """A copy with room for at least so many rows, and twice as many as before."""
    grown = np.empty((max(2 * len(array), least), *array.shape[1:]), array.dtype)
    grown[: len(array)] = array
    return grown


@njit(cache=True)
def sort_rows(one: Any, other: Any, count: int) -> tuple[Any, Any]:  # pragma: no cover
    """Rows ``first`` (count + 1,) of pairs in any order, and their order (p,) row by row."""
    first = np.zeros(count + 1, np.int64)
    for i in one:
        first[i + 1] += 1
    for i in range(count):
        first[i + 1] += first[i]
    end, order = first[:-1].copy(), np.empty(other.size, np.int64)
    for p in range(one.size):
        i = one[p]
        place = end[i]  # rows are short: sort by insertion
        while place > first[i] and other[order[place - 1]] > other[p]:
            order[place] = order[place - 1]
            place -= 1
        order[place] = p
        end[i] += 1
    return first, order
