"""A ring of tetrahedra that closes on itself."""

from __future__ import annotations

import numpy as np

from qdem_fem.mesh.generation import make_box_mesh
from qdem_fem.mesh.tetrahedra import TetMesh


def make_ring_mesh(
    inner: float, outer: float, height: float, cells: tuple[int, int, int]
) -> TetMesh:
    """A ring around the z-axis between two radii [m], from z = 0 to ``height`` [m].

    ``cells``: along the radius, around, and along the axis; circles are polygons, without a seam.
    """
    nx, ny, nz = cells
    box = make_box_mesh((outer - inner, 2 * np.pi, height), cells, origin=(inner, 0.0, 0.0))
    radius, angle, z = box.nodes.reshape(nz + 1, ny + 1, nx + 1, 3)[:, :-1].reshape(-1, 3).T
    k, j, i = np.unravel_index(box.elements, (nz + 1, ny + 1, nx + 1))
    nodes = np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=1)
    return TetMesh(nodes, np.ravel_multi_index((k, j % ny, i), (nz + 1, ny, nx + 1)))
