"""Broad phase: pairs of bodies whose boxes overlap; for the plane, shapes placed and their boxes.

Boxes are rows of their lower, then their upper corner: (x0, y0, x1, y1), (x0, y0, z0, x1, y1, z1).
"""

import numpy as np
from numba import njit

from rigid_lcp.arrays import Bools, Floats, Ints

POLYGON, DISC, HALF_SPACE = 0, 1, 2
"""Kinds of shapes as the kernels know them."""
ZERO = 0
"""As ``int(ZERO)`` it is a number: numba compiles what is called with constants once more."""


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
def bound_shapes(
    first: Ints, vertices: Floats, radius: Floats, position: Floats, margin: Floats
) -> Floats:
    """Boxes around bodies of the plane or of space, swollen by their margins [m], (n, 2 dim).

    Body b has the vertices ``first[b]`` to ``first[b + 1]``, or none: it is a disc or a sphere.
    """
    bodies, dim = position.shape
    boxes = np.empty((bodies, 2 * dim))
    for body in range(bodies):
        for axis in range(dim):
            low, high = position[body, axis] - radius[body], position[body, axis] + radius[body]
            if first[body + 1] > first[body]:
                low, high = np.inf, -np.inf
            for v in range(first[body], first[body + 1]):
                low, high = min(low, vertices[v, axis]), max(high, vertices[v, axis])
            boxes[body, axis], boxes[body, dim + axis] = low - margin[body], high + margin[body]
    return boxes


@njit(cache=True)
def find_near_pairs(kind: Ints, boxes: Floats, movable: Bools) -> Ints:
    """Pairs (i < j) whose boxes overlap and every half-space with every movable body, (m, 2).

    ``boxes`` (n, 2 dim); those of half-spaces are not read.  Boxes are sorted by their lower ends
    along the axis in which the bodies spread most, and swept.
    """
    solid = np.flatnonzero(kind != HALF_SPACE)
    dim = boxes.shape[1] // 2
    sweep, widest = 0, -1.0
    for k in range(dim):
        spread = np.var(boxes[solid, k]) if len(solid) > 0 else 0.0
        if spread > widest:
            sweep, widest = k, spread
    order = solid[np.argsort(boxes[solid, sweep], kind="mergesort")]
    walls = np.flatnonzero(kind == HALF_SPACE)
    pairs = np.empty((0, 2), dtype=np.int64)
    for store in range(2):  # first count, then store
        count = 0
        for place in range(len(order)):
            i = order[place]
            for later in range(place + 1, len(order)):
                j = order[later]
                if boxes[j, sweep] > boxes[i, dim + sweep]:
                    break
                apart = not (movable[i] or movable[j])
                for k in range(dim):
                    if boxes[i, k] > boxes[j, dim + k] or boxes[j, k] > boxes[i, dim + k]:
                        apart = True
                if apart:
                    continue
                if store:
                    pairs[count, 0], pairs[count, 1] = min(i, j), max(i, j)
                count += 1
        for wall in walls:
            for i in solid:
                if movable[i]:
                    if store:
                        pairs[count, 0], pairs[count, 1] = i, wall
                    count += 1
        if not store:
            pairs = np.empty((count, 2), dtype=np.int64)
    return pairs[np.argsort(pairs[:, 0] * len(kind) + pairs[:, 1], kind="mergesort")]


@njit(cache=True)
def order_contacts(
    kind: Ints, bodies: Ints, numbers: Floats, key: Ints
) -> tuple[Ints, Ints, Floats, Floats, Floats, Ints, Floats, Floats]:
    """Contacts in the order of `find_near_pairs`, those of a pair as they come, column by column.

    ``bodies`` (nc, 2) and ``numbers`` (nc, 2 dim + 3): point, normal, gap, radii of curvature.
    Returns bodies a and b, points, normals, gaps, keys, radii of a and b.
    """
    pair, dim = np.empty(len(key), np.int64), (numbers.shape[1] - 3) // 2
    for c in range(len(key)):
        a, b = bodies[c]
        first, second = (a, b) if a < b or kind[b] == HALF_SPACE else (b, a)
        pair[c] = first * len(kind) + second
    order = np.argsort(pair, kind="mergesort")
    body, number = bodies[order].T.copy(), numbers[order].T.copy()
    point, normal = number[:dim].T.copy(), number[dim : 2 * dim].T.copy()
    gap, radius_a, radius_b = number[2 * dim :]
    return body[0], body[1], point, normal, gap, key[order], radius_a, radius_b
