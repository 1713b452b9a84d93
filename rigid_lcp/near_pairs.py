"""Broad phase in the plane: shapes placed, boxes around them, pairs whose boxes overlap."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

POLYGON, DISC, HALF_SPACE = 0, 1, 2
"""Kinds of shapes as the kernels know them."""


@njit(cache=True)
def place_shapes(
    kind: Ints, first: Ints, vertices: Floats, normals: Floats, position: Floats, angle: Floats
) -> tuple[Floats, Floats]:
    """Vertices and face normals in the frame of the scene; half-spaces are there already."""
    placed, turned = vertices.copy(), normals.copy()
    for body in range(len(kind)):
        if kind[body] != POLYGON:
            continue
        c, s = np.cos(angle[body]), np.sin(angle[body])
        for v in range(first[body], first[body + 1]):
            placed[v, 0] = position[body, 0] + c * vertices[v, 0] - s * vertices[v, 1]
            placed[v, 1] = position[body, 1] + s * vertices[v, 0] + c * vertices[v, 1]
            turned[v, 0] = c * normals[v, 0] - s * normals[v, 1]
            turned[v, 1] = s * normals[v, 0] + c * normals[v, 1]
    return placed, turned


@njit(cache=True)
def bounding_boxes(
    kind: Ints, first: Ints, vertices: Floats, radius: Floats, position: Floats, margin: Floats
) -> Floats:
    """Boxes (x0, x1, y0, y1) around polygons and discs, swollen by their margins, (n, 4)."""
    boxes = np.empty((len(kind), 4))
    for body in range(len(kind)):
        if kind[body] == POLYGON:
            boxes[body, 0::2], boxes[body, 1::2] = np.inf, -np.inf
            for v in range(first[body], first[body + 1]):
                for axis in range(2):
                    boxes[body, 2 * axis] = min(boxes[body, 2 * axis], vertices[v, axis])
                    boxes[body, 2 * axis + 1] = max(boxes[body, 2 * axis + 1], vertices[v, axis])
        else:
            for axis in range(2):
                boxes[body, 2 * axis] = position[body, axis] - radius[body]
                boxes[body, 2 * axis + 1] = position[body, axis] + radius[body]
        boxes[body, 0::2] -= margin[body]
        boxes[body, 1::2] += margin[body]
    return boxes


@njit(cache=True)
def near_pairs(kind: Ints, boxes: Floats, movable: Bools) -> Ints:
    """Pairs (i < j) whose boxes overlap and every half-space with every movable body, (m, 2).

    Boxes sorted by their left ends, swept from left to right.
    """
    solid = np.flatnonzero(kind != HALF_SPACE)
    order = solid[np.argsort(boxes[solid, 0], kind="mergesort")]
    pairs = np.empty((0, 2), dtype=np.int64)
    for store in range(2):  # first count, then store
        count = 0
        for place in range(len(order)):
            i = order[place]
            for later in range(place + 1, len(order)):
                j = order[later]
                if boxes[j, 0] > boxes[i, 1]:
                    break
                if boxes[i, 2] > boxes[j, 3] or boxes[j, 2] > boxes[i, 3]:
                    continue
                if not (movable[i] or movable[j]):
                    continue
                if store:
                    pairs[count, 0], pairs[count, 1] = min(i, j), max(i, j)
                count += 1
        for wall in np.flatnonzero(kind == HALF_SPACE):
            for i in solid:
                if movable[i]:
                    if store:
                        pairs[count, 0], pairs[count, 1] = i, wall
                    count += 1
        if not store:
            pairs = np.empty((count, 2), dtype=np.int64)
    size = len(kind)
    return pairs[np.argsort(pairs[:, 0] * size + pairs[:, 1], kind="mergesort")]
