"""Compiled kernels of overlaps.

A *row* is one pair of grains, or one grain and a wall.  Row c names grain ``first[c]`` and
``second[c]``: another grain, or wall w as -1 - w, where the planes come first and the cylinder
last.  ``normal[c]`` is a unit vector that points at the first grain; ``overlap[c]`` delta [m] is
positive in contact.
"""

import numpy as np
from numba import njit

from adapters.bed.container import GOLDEN_ANGLE
from adapters.bed.state import BoolArray, FloatArray, IntArray

_COINCIDENT = 1e-9
"""Centres nearer than this share of the radii have no direction: one is made up."""


Geometry = tuple[FloatArray, FloatArray, FloatArray, float, FloatArray]
"""Of `adapters.bed.container.Walls`."""


@njit(cache=True)
def find_cylinder_contact(
    x: FloatArray, radius: float, cylinder: float, normal: FloatArray
) -> float:
    """Overlap [m] of a grain at ``x`` with a ``cylinder`` of that radius [m]; fills ``normal``."""
    from_axis = np.hypot(x[0], x[1])
    normal[:] = 0.0
    if from_axis > 0.0:
        normal[0], normal[1] = -x[0] / from_axis, -x[1] / from_axis
    else:
        normal[0] = -1.0
    return from_axis + radius - cylinder


@njit(cache=True)
def find_wall_contact(
    x: FloatArray, radius: float, wall: int, walls: Geometry, behind: BoolArray, normal: FloatArray
) -> float:
    """Overlap [m] of a grain at ``x`` with a wall; fills ``normal``, its direction at the grain.

    A plane that ends at a reach [m] from the z axis, or at edges, is a thin plate: grains that
    started ``behind`` it (p,) stay behind it, and beyond its rim the nearest point of that counts.
    """
    points, normals, reaches, cylinder, all_edges = walls
    if wall == len(reaches):
        return find_cylinder_contact(x, radius, cylinder, normal)
    point, plane_normal, reach = points[wall], normals[wall], reaches[wall]
    height = 0.0
    for a in range(3):
        height += (x[a] - point[a]) * plane_normal[a]
    edges = all_edges[wall]
    if reach == np.inf and edges[1] == np.inf and edges[3] == np.inf:
        normal[:] = plane_normal
        return radius - height
    if reach == np.inf:
        gap_x = x[0] - min(max(x[0], edges[0]), edges[1])
        gap_y = x[1] - min(max(x[1], edges[2]), edges[3])
        beyond = np.hypot(gap_x, gap_y)
    else:
        from_axis = np.hypot(x[0], x[1])
        beyond = from_axis - reach
        gap_x, gap_y = beyond * (x[0] / from_axis), beyond * (x[1] / from_axis)
    if beyond <= 0.0:
        side = -1.0 if behind[wall] else 1.0
        normal[:] = side * plane_normal
        return radius - side * height
    distance = np.hypot(beyond, height)
    for a in range(3):
        normal[a] = ((gap_x, gap_y, 0.0)[a] + height * plane_normal[a]) / distance
    return radius - distance


@njit(cache=True)
def fill_rows(
    position: FloatArray, radius: FloatArray, first: IntArray, second: IntArray, walls: Geometry,
    behind: BoolArray, normal: FloatArray, overlap: FloatArray,
) -> None:  # fmt: skip
    """Fill ``normal`` (m, 3) and ``overlap`` [m] (m,) of all rows; ``behind`` is (n, p)."""
    for c in range(len(first)):
        i, j = first[c], second[c]
        if j < 0:
            overlap[c] = find_wall_contact(
                position[i], radius[i], -1 - j, walls, behind[i], normal[c]
            )
            continue
        square = 0.0
        for a in range(3):
            normal[c, a] = position[i, a] - position[j, a]
            square += normal[c, a] ** 2
        distance = np.sqrt(square)
        reach = radius[i] + radius[j]
        overlap[c] = reach - distance
        if distance > _COINCIDENT * reach:
            normal[c] /= distance
        else:
            turn, z = GOLDEN_ANGLE * c, 2.0 * ((c * 0.6180339887498949) % 1.0) - 1.0
            level = np.sqrt(1.0 - z * z)
            normal[c, 0], normal[c, 1], normal[c, 2] = (
                level * np.cos(turn),
                level * np.sin(turn),
                z,
            )


@njit(cache=True)
def find_wall_rows(
    position: FloatArray, radius: FloatArray, walls: Geometry, behind: BoolArray, gap: float
) -> tuple[IntArray, IntArray]:
    """``first`` and ``second`` of all grains nearer than ``gap`` [m] to a wall."""
    count = len(walls[2]) + (1 if walls[3] < np.inf else 0)
    first = np.empty(len(radius) * count, np.int64)
    second = np.empty(len(radius) * count, np.int64)
    normal = np.empty(3)
    m = 0
    for i in range(len(radius)):
        for wall in range(count):
            if find_wall_contact(position[i], radius[i], wall, walls, behind[i], normal) > -gap:
                first[m], second[m] = i, -1 - wall
                m += 1
    return first[:m].copy(), second[:m].copy()
