"""Tetrahedra of a grain: cones of its coarse faces, each cut into eight.

A grain of M corners has 4 M - 6 nodes on its surface (corners, then middles of edges), one apex
inside, and one in the middle of each spoke from the apex to a corner: 5 M - 5 nodes in this order,
8 (2 M - 4) tetrahedra.  With M = 8 that is 35 nodes, as many as in the paper on average.  The
tetrahedra fill the polyhedron of the surface and nothing else.
"""

import numpy as np

from qdem_fem.files import Floats, Integers, MeshError
from qdem_fem.grains.measures import find_surface_edges, integrate_polyhedron
from qdem_fem.mesh import TetMesh, name_some

SPOKE = 0.5
"""Where on a spoke from the apex its node lies."""
CORNERS = np.array([[0, 3, 6, 5], [3, 1, 7, 4], [5, 4, 8, 2], [6, 7, 9, 8]])
"""Four of the eight tetrahedra of a cone: nodes 0 1 2 of its face, middles 3 4 5 of the edges 01,
12, 20, middles 6 7 8 of the spokes of 0 1 2, apex 9."""
DIAGONALS = np.array([
    [[3, 8, 5, 4], [3, 8, 6, 5], [3, 8, 7, 6], [3, 8, 4, 7]],
    [[4, 6, 3, 5], [4, 6, 5, 8], [4, 6, 8, 7], [4, 6, 7, 3]],
    [[5, 7, 4, 3], [5, 7, 3, 6], [5, 7, 6, 8], [5, 7, 8, 4]],
])  # fmt: skip
"""The other four, around one of the three diagonals of the octahedron that is left."""


def find_radius_ratios(nodes: Floats, elements: Integers) -> Floats:
    """Three times the radius of the inscribed over that of the circumscribed sphere, (m,).

    1 for a regular tetrahedron, 0 for a flat one, negative where left-handed; ``nodes`` (n, 3) [m],
    ``elements`` (m, 4).
    """
    x = nodes[elements]
    e = x[:, 1:] - x[:, :1]
    across = [np.cross(e[:, k - 2], e[:, k - 1]) for k in range(3)]  # e1 x e2, e2 x e0, e0 x e1
    sixfold = np.einsum("mi,mi->m", e[:, 0], across[0])
    faces = [*reversed(across), np.cross(x[:, 2] - x[:, 1], x[:, 3] - x[:, 1])]
    twice = sum(np.linalg.norm(face, axis=1) for face in faces)
    squares = (e**2).sum(axis=2)
    centre = sum(squares[:, k, None] * across[k] for k in range(3))
    # inscribed: 3 V/A = sixfold/twice; circumscribed: |centre|/(12 V)
    size = 6 * sixfold**2 / (twice * np.linalg.norm(centre, axis=1))
    return np.asarray(size * np.sign(sixfold))


def place_apex_and_spokes(nodes: Floats, faces: Integers, corners: int) -> Floats:
    """The inner nodes (M + 1, 3) [m] of a surface: its centroid, and one on each spoke."""
    _, apex = integrate_polyhedron(nodes, faces)
    return np.vstack([apex, apex + SPOKE * (nodes[:corners] - apex)])


def make_grain_elements(nodes: Floats, corner_faces: Integers) -> Integers:
    """Tetrahedra (8 (2 M - 4), 4) of a grain with ``nodes`` (5 M - 5, 3), right-handed.

    Of the three diagonals of each cone's octahedron the one that leaves the best worst
    `find_radius_ratios`.
    """
    corners = int(corner_faces.max()) + 1
    middle = corners + find_surface_edges(corner_faces).number
    apex = 4 * corners - 6
    local = np.column_stack(
        [corner_faces, middle, apex + 1 + corner_faces, np.full(len(corner_faces), apex)]
    )
    choices = local[:, DIAGONALS]
    worst = find_radius_ratios(nodes, choices.reshape(-1, 4)).reshape(*choices.shape[:3]).min(2)
    best = choices[np.arange(len(local)), worst.argmax(axis=1)]
    return np.concatenate([local[:, CORNERS], best], axis=1).reshape(-1, 4)


def make_grain_tetrahedra(nodes: Floats, corner_faces: Integers) -> TetMesh:
    """The mesh of a grain of all its ``nodes`` (5 M - 5, 3) [m]; node set ``surface``.

    Raises `MeshError` if the apex does not see the whole surface from inside.
    """
    corners = int(corner_faces.max()) + 1
    elements = make_grain_elements(nodes, corner_faces)
    bad = np.flatnonzero(find_radius_ratios(nodes, elements) <= 0)
    if len(bad):
        raise MeshError(
            f"the surface is not seen from its centroid: {name_some('element', bad)} inside out",
            where="grain", remedy="draw another shape",
        )  # fmt: skip
    return TetMesh(nodes, elements, node_sets={"surface": np.arange(4 * corners - 6)})
