"""Which spheres may touch, found on a GPU: the twin of `qdem_fem.contact.search.pairs`.

A thread goes with its sphere through the 27 cells about it twice: to count its row of pairs, and,
when it is known where rows begin, to write it.  A row is sorted while it is written, and behind
that the pairs in which a sphere is the second.  So all lists are the processor's, number by number,
in whatever order a bucket was filled (`qdem_fem.contact.cuda.cells`); so is the order of sums.

The host reads three counts, to make arrays, and nothing else.
"""

from functools import cache
from typing import Any

import numpy as np

from qdem_fem.contact.cuda.cells import find_cell_bucket, find_cells, find_entries, write_zeros
from qdem_fem.contact.search import Pairs, PeriodicWidth
from qdem_fem.contact.spheres import Contact
from qdem_fem.kernel.cuda import choose_grid, cuda, sum_before


@cuda.jit(device=True)
def compute_square_apart(at: Any, e: Any, f: Any) -> Any:
    """Square of the distance of entries e and f [m^2].

    Fused by hand, here and for walls: a compiler is free to fuse one kernel in another way than the
    next, and rows must be as long when they are written as when they were counted.
    """
    x, y, z = at[e, 0] - at[f, 0], at[e, 1] - at[f, 1], at[e, 2] - at[f, 2]
    return cuda.fma(z, z, cuda.fma(y, y, x * x))


@cache
def build_rows_kernel(filling: bool) -> Any:
    """The kernel that goes through the cells: it counts pairs, or, ``filling``, writes them."""

    @cuda.jit
    def scan_rows(
        at: Any, turn: Any, there: Any, cell: Any, start: Any, order: Any, radius: Any, body: Any,
        skin: Any, axis: Any, width: Any, counts: Any, backs: Any, first: Any, second: Any,
        image: Any,
    ) -> None:  # fmt: skip
        """Row i of all pairs i < j of two bodies nearer than their reach.

        Counting: their number in ``counts`` (c,), and in ``backs`` (c,) how often j is a second.
        Filling: from ``first`` (c + 1,) on ``second``, and ``image`` (p, 3) where ``axis`` >= 0.
        """
        i = cuda.grid(1)
        count = radius.size
        if i >= count:
            return
        found = 0
        for e in range(i, there.size, count):  # the sphere, then its image
            if there[e] == 0:
                continue
            for step in range(27):
                x = cell[e, 0] + step // 9 - 1
                y = cell[e, 1] + step // 3 % 3 - 1
                z = cell[e, 2] + step % 3 - 1
                b = find_cell_bucket(x, y, z, start.size - 1)
                for q in range(start[b], start[b + 1]):
                    f = order[q]
                    if cell[f, 0] != x or cell[f, 1] != y or cell[f, 2] != z:
                        continue  # another cell of the same bucket
                    if e >= count and f >= count:
                        continue  # two images are a pair as spheres
                    j = f % count
                    if j <= i or body[j] == body[i]:
                        continue
                    reach = radius[i] + radius[j] + skin
                    if compute_square_apart(at, e, f) > reach * reach:
                        continue
                    if filling:
                        place = first[i] + found  # rows are short: sort by insertion
                        while place > first[i] and second[place - 1] > j:
                            second[place] = second[place - 1]
                            if axis >= 0:
                                image[place, axis] = image[place - 1, axis]
                            place -= 1
                        second[place] = j
                        if axis >= 0:
                            image[place, axis] = (turn[e] - turn[f]) * width
                    else:
                        cuda.atomic.add(backs, j, 1)
                    found += 1
            if filling and axis >= 0:
                for place in range(first[i], first[i] + found):
                    image[place, (axis + 1) % 3] = 0.0
                    image[place, (axis + 2) % 3] = 0.0
        if not filling:
            counts[i] = found

    return scan_rows


@cuda.jit
def fill_backs(first: Any, second: Any, back_first: Any, backs: Any, back_pair: Any) -> None:
    """Pairs by their second sphere, in no order; ``backs`` go down to zero."""
    i = cuda.grid(1)
    if i < backs.size:
        for p in range(first[i], first[i + 1]):
            j = second[p]
            left = cuda.atomic.add(backs, j, -1)
            back_pair[back_first[j] + left - 1] = p


@cuda.jit
def sort_backs(back_first: Any, back_pair: Any) -> None:
    """The pairs in which a sphere is the second, in their order."""
    j = cuda.grid(1)
    if j >= back_first.size - 1:
        return
    for q in range(back_first[j] + 1, back_first[j + 1]):
        p, place = back_pair[q], q
        while place > back_first[j] and back_pair[place - 1] > p:
            back_pair[place] = back_pair[place - 1]
            place -= 1
        back_pair[place] = p


@cuda.jit(device=True)
def is_wall_near(
    position: Any, radius: Any, point: Any, normal: Any, way: Any, i: Any, w: Any
) -> Any:
    """Whether sphere i touches wall w, or will on a ``way`` [m]."""
    apart = (position[i, 0] - point[w, 0]) * normal[w, 0]
    apart = cuda.fma(position[i, 1] - point[w, 1], normal[w, 1], apart)
    apart = cuda.fma(position[i, 2] - point[w, 2], normal[w, 2], apart)
    return apart - radius[i] < way


@cuda.jit
def count_walls(
    position: Any, radius: Any, point: Any, normal: Any, walls: Any, way: Any, first: Any,
    back_first: Any, near: Any, acts: Any,
) -> None:  # fmt: skip
    """How many walls each sphere is ``near`` (c,), and whether it ``acts`` (c,)."""
    i = cuda.grid(1)
    if i >= radius.size:
        return
    count = 0
    for w in range(walls):
        if is_wall_near(position, radius, point, normal, way, i, w):
            count += 1
    near[i] = count
    paired = first[i + 1] > first[i] or back_first[i + 1] > back_first[i]
    acts[i] = 1 if paired or count > 0 else 0


@cuda.jit
def fill_walls(
    position: Any, radius: Any, point: Any, normal: Any, walls: Any, way: Any, wall_first: Any,
    acting_first: Any, wall: Any, acting: Any,
) -> None:  # fmt: skip
    """The walls that each sphere is near, and the spheres to look at."""
    i = cuda.grid(1)
    if i >= radius.size:
        return
    place = wall_first[i]
    for w in range(walls):
        if is_wall_near(position, radius, point, normal, way, i, w):
            wall[place] = w
            place += 1
    if acting_first[i + 1] > acting_first[i]:
        acting[acting_first[i]] = i


@cuda.jit
def carry_history(
    old_first: Any, old_second: Any, old_touching: Any, old_spring: Any, old_pull: Any,
    first: Any, second: Any, touching: Any, spring: Any, pull: Any,
) -> None:  # fmt: skip
    """What the pairs of the old list remember, and nothing for the others."""
    i = cuda.grid(1)
    if i >= first.size - 1:
        return
    p, end = old_first[i], old_first[i + 1]
    for q in range(first[i], first[i + 1]):
        while p < end and old_second[p] < second[q]:
            p += 1
        held = p < end and old_second[p] == second[q] and old_touching[p] != 0
        touching[q] = 1 if held else 0
        for c in range(3):
            spring[q, c] = old_spring[p, c] if held else 0.0
            pull[q, c] = old_pull[p, c] if held else 0.0


def renew_pairs(
    c: Contact, position: Any, skin: float, largest: float, walls: int,
    side: PeriodicWidth | None,
) -> tuple[Pairs, int]:  # fmt: skip
    """`qdem_fem.contact.search.renew_pairs` for the spheres of ``c`` at (c, 3) [m].

    All arrays are on the GPU, of at least one row each.  ``largest``: greatest radius [m];
    ``walls``: how many there are.  Returns the pairs, and how many spheres are acting.
    """
    old, radius, body = c.pairs, c.spheres.radius, c.spheres.body
    count = radius.size
    axis, width = (-1, 1.0) if side is None else (side.number, side.width)
    entries = find_entries(position, 2 * largest + skin, side)
    cells = find_cells(entries, 2 * largest + skin)
    counts, backs = (cuda.device_array(count, np.int64) for _ in range(2))
    write_zeros[choose_grid(count)](backs)
    looked = (*entries, *cells, radius, body, skin, axis, width, counts, backs)
    build_rows_kernel(False)[choose_grid(count)](*looked, old.first, old.second, entries.at)
    first, back_first = sum_before(counts, count), sum_before(backs, count)
    rows = max(1, int(first[count]))
    second, back_pair = (cuda.device_array(rows, np.int64) for _ in range(2))
    image = old.image if side is None else cuda.device_array((rows, 3))
    build_rows_kernel(True)[choose_grid(count)](
        *looked, first, second, entries.at if side is None else image
    )
    fill_backs[choose_grid(count)](first, second, back_first, backs, back_pair)
    sort_backs[choose_grid(count)](back_first, back_pair)

    planes = position, radius, c.planes.point, c.planes.normal, walls, skin
    near, acts = (cuda.device_array(count, np.int64) for _ in range(2))
    count_walls[choose_grid(count)](*planes, first, back_first, near, acts)
    wall_first, acting_first = sum_before(near, count), sum_before(acts, count)
    actors = int(acting_first[count])
    wall = cuda.device_array(max(1, int(wall_first[count])), np.int64)
    acting = cuda.device_array(max(1, actors), np.int64)
    fill_walls[choose_grid(count)](*planes, wall_first, acting_first, wall, acting)

    touching = cuda.device_array(rows, np.uint8)
    spring, pull = (cuda.device_array((rows, 3)) for _ in range(2))
    carry_history[choose_grid(count)](
        old.first, old.second, old.touching, old.spring, old.pull, first, second, touching,
        spring, pull,
    )  # fmt: skip
    return Pairs(
        first, second, back_first, back_pair, touching, spring, pull, acting, image, wall_first,
        wall,
    ), actors  # fmt: skip
