"""Discs and spheres poured one by one: each rolls down those before it till they hold it.

A grain dropped at a random place slides without friction to the lowest point it can reach nearby,
where two (2D) or three (3D) grains or walls hold it (Visscher and Bolsterli, Nature 239 (1972)
504).  So a bed has two or three contacts a grain, is dense, and costs some 50 us a grain; it is no
equilibrium of the whole yet, which `validation.bench.rigid.packings` mends.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@njit(cache=True)
def pour_grains(radius: Floats, width: float, drop: Floats) -> Floats:
    """Centres (n, 3) [m] of grains poured in order into a box; a planar bed has y = 0.

    ``radius`` (n,) [m]; ``drop`` (n, 2): where each is dropped, as parts of the free width, the
    second -1 in the plane.  The box is ``width`` wide [m] from zero in x and y, its floor z = 0.
    """
    count, planar = len(radius), drop[0, 1] < 0
    centre = np.zeros((count, 3))
    cell = 3.0 * radius.max()  # the sum of two radii and two strides
    across = max(1, int(width / cell))
    grains = np.pi * np.sum(radius**2 / width if planar else 4.0 / 3.0 * radius**3 / width**2)
    layers = 4 + int(2.5 * grains / cell)  # the height of a bed that fills 40 % of its box
    head = np.full((across, 1 if planar else across, layers), -1)
    following = np.full(count, -1)
    near = np.zeros(256, dtype=np.int64)
    top = 0.0
    for i in range(count):
        r = radius[i]
        point = np.zeros(3)
        for axis in range(1 if planar else 2):
            point[axis] = r + drop[i, axis] * (width - 2.0 * r)
        point[2] = top + 2.0 * r
        stride = 0.5 * r
        while stride > 1e-6 * r:
            reach = r + 2.0 * stride
            found = find_pairs(point, reach, radius, centre, head, following, cell, near)
            trial = point.copy()
            trial[2] -= stride
            push_out(trial, r, radius, centre, near, found, width, planar, stride)
            way = trial - point  # down the slope; as long as a stride even where it is gentle
            length = np.sqrt(np.sum(way**2))
            if length > 0.0:
                trial = point + way * (stride / length)
                push_out(trial, r, radius, centre, near, found, width, planar, stride)
            moved = np.sqrt(np.sum((trial - point) ** 2))
            if (
                length > 1e-3 * stride
                and moved < 2.0 * stride
                and trial[2] < point[2] - 1e-3 * stride
                and is_free(trial, r, radius, centre, near, found, 0.01 * stride)
            ):
                point = trial
                stride = min(1.5 * stride, 0.5 * r)
            else:
                stride *= 0.5
        centre[i] = point
        top = max(top, point[2] + r)
        x, y, z = find_cell(point, cell, head.shape)
        following[i] = head[x, y, z]
        head[x, y, z] = i
    return centre


@njit(cache=True)
def find_cell(point: Floats, cell: float, shape: tuple[int, int, int]) -> tuple[int, int, int]:
    """Cell of the grid that holds a point; beyond its rim, the cell at the rim."""
    return (
        max(0, min(int(point[0] / cell), shape[0] - 1)),
        max(0, min(int(point[1] / cell), shape[1] - 1)),
        max(0, min(int(point[2] / cell), shape[2] - 1)),
    )


@njit(cache=True)
def find_pairs(
    point: Floats, reach: float, radius: Floats, centre: Floats, head: Integers,
    following: Integers, cell: float, near: Integers,
) -> int:  # fmt: skip
    """Grains whose surface is within ``reach`` of a point: written to ``near``, their count."""
    x, y, z = find_cell(point, cell, head.shape)
    found = 0
    for a in range(max(0, x - 1), min(head.shape[0], x + 2)):
        for b in range(max(0, y - 1), min(head.shape[1], y + 2)):
            for c in range(max(0, z - 1), min(head.shape[2], z + 2)):
                j = head[a, b, c]
                while j >= 0:
                    apart = 0.0
                    for k in range(3):
                        apart += (point[k] - centre[j, k]) ** 2
                    if apart < (reach + radius[j]) ** 2 and found < len(near):
                        near[found] = j
                        found += 1
                    j = following[j]
    return found


@njit(cache=True)
def push_out(
    point: Floats, r: float, radius: Floats, centre: Floats, near: Integers, found: int,
    width: float, planar: bool, stride: float,
) -> None:  # fmt: skip
    """Push a grain out of those it overlaps and into the box, one after another and again."""
    for _ in range(30):
        much = False
        for index in range(found):
            j = near[index]
            apart = 0.0
            for k in range(3):
                apart += (point[k] - centre[j, k]) ** 2
            apart, touch = np.sqrt(apart), r + radius[j]
            if apart < touch:
                much = much or touch - apart > 1e-3 * stride
                for k in range(3):
                    point[k] += (point[k] - centre[j, k]) * (touch / apart - 1.0)
        for axis in range(1 if planar else 2):
            point[axis] = min(max(point[axis], r), width - r)
        point[2] = max(point[2], r)
        if not much:
            return


@njit(cache=True)
def is_free(
    point: Floats, r: float, radius: Floats, centre: Floats, near: Integers, found: int,
    allowed: float,
) -> bool:  # fmt: skip
    """A grain overlaps no neighbour by more than ``allowed``."""
    for index in range(found):
        j = near[index]
        apart = 0.0
        for k in range(3):
            apart += (point[k] - centre[j, k]) ** 2
        if apart < (r + radius[j] - allowed) ** 2:
            return False
    return True


@njit(cache=True)
def find_touching(
    centre: Floats, radius: Floats, width: float, planar: bool, margin: float
) -> Integers:
    """Grains nearer than ``margin`` [m] to each other or to a wall, (nc, 2), in order of the first.

    The second is -1 for the floor, -2 and -3 for the walls at x = 0 and at the width, -4 and -5
    for those in y.
    """
    count = len(radius)
    cell = 2.0 * radius.max() + margin
    shape = (
        int(width / cell) + 1, 1 if planar else int(width / cell) + 1,
        int((centre[:, 2].max() + cell) / cell) + 1,
    )  # fmt: skip
    head = np.full(shape, -1)
    behind = np.full(count, -1)
    pairs = np.zeros((count * (8 if planar else 14), 2), dtype=np.int64)
    found = 0
    near = np.zeros(512, dtype=np.int64)
    for i in range(count):
        number = find_pairs(centre[i], radius[i] + margin, radius, centre, head, behind, cell, near)
        for index in range(number):
            pairs[found, 0], pairs[found, 1] = i, near[index]
            found += 1
        if centre[i, 2] - radius[i] < margin:
            pairs[found, 0], pairs[found, 1] = i, -1
            found += 1
        for axis in range(1 if planar else 2):
            if centre[i, axis] - radius[i] < margin:
                pairs[found, 0], pairs[found, 1] = i, -2 - 2 * axis
                found += 1
            if width - centre[i, axis] - radius[i] < margin:
                pairs[found, 0], pairs[found, 1] = i, -3 - 2 * axis
                found += 1
        x, y, z = find_cell(centre[i], cell, head.shape)
        behind[i] = head[x, y, z]
        head[x, y, z] = i
    return pairs[:found]
