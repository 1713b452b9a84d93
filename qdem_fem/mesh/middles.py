"""Nodes amid the edges of a mesh of tetrahedra, for quadratic elements."""

import numpy as np

from qdem_fem.files import Integers

EDGES = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])
"""Corners of an element that its nodes 4 to 9 lie between."""
_SIDES = ((0, 1), (1, 2), (2, 0))


def find_middles(elements: Integers, first: int) -> tuple[Integers, Integers]:
    """Corners of each edge of a mesh (k, 2), and the ten nodes of each element (m, 10).

    ``elements`` (m, 4); node ``first + i`` lies amid edge i.
    """
    pairs = np.sort(elements[:, EDGES].reshape(-1, 2), axis=1)
    keys, edge = np.unique(pairs[:, 0] * first + pairs[:, 1], return_inverse=True)
    middles = first + edge.reshape(-1, len(EDGES))
    return np.stack(np.divmod(keys, first), axis=1), np.hstack([elements, middles])


def split_faces(faces: Integers, edges: Integers, first: int) -> Integers:
    """Four triangles of each face (k, 3), at the nodes amid its edges, (4 k, 3), as outward."""
    keys = edges[:, 0] * first + edges[:, 1]
    sides = np.sort(faces[:, _SIDES], axis=2)
    middle = first + np.searchsorted(keys, sides[..., 0] * first + sides[..., 1])
    (a, b, c), (ab, bc, ca) = faces.T, middle.T
    four = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return np.stack([np.stack(one, axis=1) for one in four], axis=1).reshape(-1, 3)
