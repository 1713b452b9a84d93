"""Meshes that are hard on an explicit method: rough, with slivers, of sizes that differ widely."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import Delaunay

from qdem_fem.files import Floats, Integers
from qdem_fem.mesh.generation import make_box_mesh
from qdem_fem.mesh.surface import find_surface_faces
from qdem_fem.mesh.tetrahedra import TetMesh, find_altitudes, find_gradients

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


def jitter_nodes(mesh: TetMesh, fraction: float, seed: int) -> TetMesh:
    """Move the interior nodes at random, to make a mesh as irregular as a generator's.

    Each goes uniformly into a ball around it whose radius is ``fraction`` of the smallest
    altitude of its elements; nodes of the surface stay.  Below a fraction of 1/4 no element can
    be turned inside out: a tetrahedron is at least half its smallest altitude wide, and four
    nodes that reach a common plane must together cross that width.
    """
    gradients, _ = find_gradients(mesh.nodes, mesh.elements)
    reach = np.full(len(mesh.nodes), np.inf)
    for corner in mesh.elements.T:
        np.minimum.at(reach, corner, find_altitudes(gradients))
    reach[find_surface_faces(mesh.elements).reshape(-1)] = 0
    reach[~np.isfinite(reach)] = 0

    generator = np.random.default_rng(seed)
    move = generator.standard_normal(mesh.nodes.shape)
    move /= np.linalg.norm(move, axis=1)[:, None]
    radius = fraction * reach * np.cbrt(generator.random(len(mesh.nodes)))
    return replace(mesh, nodes=mesh.nodes + move * radius[:, None])
