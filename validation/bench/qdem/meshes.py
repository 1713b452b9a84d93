"""Meshes that are hard on an explicit method: rough, with slivers, of sizes that differ widely."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay

from qdem_fem.mesh.generation import make_box_mesh

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

EDGES = np.array([(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)])


def measure_edges(nodes: Floats, elements: Integers) -> Floats:
    """Longest edge of each element [m], (m,)."""
    corner = nodes[elements]
    edges = corner[:, EDGES[:, 0]] - corner[:, EDGES[:, 1]]
    return np.asarray(np.linalg.norm(edges, axis=2).max(axis=1))


def make_delaunay(count: int, seed: int, shape: float = 0.02) -> tuple[Floats, Integers]:
    """Delaunay tetrahedra of random points in the unit cube: nodes (n, 3) [m], elements (m, 4).

    Elements whose ``6 V / longest edge^3`` is below ``shape`` are left out, so the body has
    pores and a rough surface, and a few nodes may belong to no element.
    """
    nodes = np.random.default_rng(seed).uniform(size=(count, 3))
    elements = Delaunay(nodes).simplices.astype(np.int64)
    corner = nodes[elements]
    six_volumes = np.linalg.det(corner[:, 1:] - corner[:, :1])
    left = six_volumes < 0
    elements[left] = elements[left][:, [0, 1, 3, 2]]
    return nodes, elements[abs(six_volumes) > shape * measure_edges(nodes, elements) ** 3]


def make_slivers(altitude: float, cells: int = 4) -> tuple[Floats, Integers]:
    """A unit cube of Kuhn tetrahedra, some of them flattened to ``altitude`` times their own [-].

    The middle node is pushed towards the face opposite to it in one of its elements; four of
    them share that plane.  Returns nodes (n, 3) [m] and elements (m, 4).
    """
    mesh = make_box_mesh((1.0, 1.0, 1.0), (cells, cells, cells))
    nodes = mesh.nodes.copy()
    node = int(np.argmin(np.linalg.norm(nodes - 0.5, axis=1)))
    corners = mesh.elements[np.flatnonzero((mesh.elements == node).any(axis=1))[0]]
    face = nodes[corners[corners != node]]
    normal = np.cross(face[1] - face[0], face[2] - face[0])
    normal /= np.linalg.norm(normal)
    height = (nodes[node] - face[0]) @ normal
    nodes[node] -= (1 - altitude) * height * normal
    return nodes, mesh.elements


SLIVER_STEP = {0.3: 0.83, 0.1: 0.51, 0.03: 0.28, 0.01: 0.16}
"""Critical step of `make_slivers` over that of the undisturbed mesh, by altitude."""


def make_graded(ratio: float, cells: int = 12) -> tuple[Floats, Integers]:
    """A unit cube whose cells shrink towards the corner at the origin.

    Shells ``max(x, y, z) = s`` of a regular mesh are moved to ``ratio^((s - 1)/(1 - 1/cells))``:
    from 1/ratio, the innermost cube, to 1, each by the same factor.  Kuhn's tetrahedra do not
    cross the planes between the sides of the shells, so none is turned over.
    """
    mesh = make_box_mesh((1.0, 1.0, 1.0), (cells, cells, cells))
    shell = mesh.nodes.max(axis=1)
    inside = shell > 0
    moved = np.zeros_like(shell)
    moved[inside] = ratio ** ((shell[inside] - 1) / (1 - 1 / cells)) / shell[inside]
    return mesh.nodes * moved[:, None], mesh.elements
