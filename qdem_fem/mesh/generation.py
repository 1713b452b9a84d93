"""Boxes cut into tetrahedra."""

from typing import Literal

import numpy as np

from qdem_fem.files import MeshError
from qdem_fem.mesh.tetrahedra import TetMesh

Pattern = Literal["kuhn", "five"]
Triple = tuple[float, float, float]

KUHN = [[0, 1, 3, 7], [0, 1, 7, 5], [0, 2, 7, 3], [0, 2, 6, 7], [0, 4, 5, 7], [0, 4, 7, 6]]
PATTERNS = {
    "kuhn": np.array([KUHN, KUHN]),
    "five": np.array([
        [[0, 3, 6, 5], [7, 3, 5, 6], [4, 0, 6, 5], [2, 0, 3, 6], [1, 0, 5, 3]],
        [[1, 2, 4, 7], [6, 2, 7, 4], [5, 1, 4, 7], [3, 1, 7, 2], [0, 1, 2, 4]],
    ]),
}  # fmt: skip
"""Right-handed tetrahedra of a cell and of its neighbours, by corners numbered i + 2 j + 4 k."""


def make_box_mesh(
    size: Triple, cells: tuple[int, int, int], pattern: Pattern = "kuhn", origin: Triple = (0, 0, 0)
) -> TetMesh:
    """A box of ``size`` (lx, ly, lz) [m] with its lowest corner at ``origin`` [m].

    Each of the ``cells`` (nx, ny, nz) is cut

    ``kuhn``  into six tetrahedra around its diagonal, all cells alike (Kuhn 1960);
    ``five``  into a regular one (for cubes) and four at its corners, neighbours mirrored.

    Node i + (nx + 1) (j + (ny + 1) k) is at the grid point (i, j, k).  Node sets: ``x-min``,
    ``x-max``, ``y-min``, ... ``z-max``.

    Raises `MeshError` for a size, a number of cells or a pattern that makes no box.
    """
    whole = len(cells) == 3 and all(int(n) == n and n >= 1 for n in cells)
    if not (whole and all(0 < length < np.inf for length in size) and pattern in PATTERNS):
        raise MeshError(
            f"a box of size {tuple(size)}, cells {tuple(cells)}, pattern {pattern!r}",
            where="make_box_mesh",
            remedy="give lengths in metres, three numbers of cells, kuhn or five",
        )  # fmt: skip
    nx, ny, nz = (int(n) for n in cells)
    axes = [
        start + length * np.arange(count + 1) / count
        for start, length, count in zip(origin, size, (nx, ny, nz), strict=True)
    ]
    z, y, x = np.meshgrid(axes[2], axes[1], axes[0], indexing="ij")
    nodes = np.stack([x.reshape(-1), y.reshape(-1), z.reshape(-1)], axis=1)
    grid = np.arange(len(nodes)).reshape(x.shape)
    corners = grid[:2, :2, :2].reshape(-1)  # of the first cell, and from any cell's first node on
    odd = np.indices((nz, ny, nx)).sum(axis=0).reshape(-1) % 2
    elements = grid[:-1, :-1, :-1].reshape(-1)[:, None, None] + corners[PATTERNS[pattern]][odd]
    sets = {}
    for axis, letter in enumerate("xyz"):
        sides = np.moveaxis(grid, 2 - axis, 0)
        sets[f"{letter}-min"] = np.sort(sides[0].reshape(-1))
        sets[f"{letter}-max"] = np.sort(sides[-1].reshape(-1))
    return TetMesh(nodes, elements.reshape(-1, 4), node_sets=sets)
