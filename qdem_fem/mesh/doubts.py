"""What a mesh may be and hardly is meant to be: in parts, with doubled nodes, overlapping."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from qdem_fem.files import Floats, Integers
from qdem_fem.mesh.checks import name_some

SAME_PLACE = 1e-6
"""Distance of two nodes over the size of the mesh at and below which they are at one place."""
NEIGHBOURS = 8
"""Elements nearest to the middle of one that are looked at, whether they contain it, too."""


def find_doubts(nodes: Floats, elements: Integers, gradients: Floats) -> Iterator[str]:
    """A sentence for each; ``gradients`` (m, 3, 3) [1/m] of the right-handed elements."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    count, n = len(elements), len(nodes)
    face = np.sort(elements[:, [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]].reshape(-1, 3), axis=1)
    _, edge = np.unique(face[:, 0] * n + face[:, 1], return_inverse=True)
    _, face_of = np.unique(edge * n + face[:, 2], return_inverse=True)
    owner = np.repeat(np.arange(count), 4)
    size = count + int(face_of.max()) + 1
    graph = coo_matrix((np.ones(4 * count), (owner, count + face_of)), shape=(size, size))
    parts, part = connected_components(graph, directed=False)
    used = np.unique(elements)
    reach = SAME_PLACE * float(np.ptp(nodes[used], axis=0).max())
    twins = cKDTree(nodes[used]).query_pairs(reach, output_type="ndarray")
    seam = f"; at the place of another node: {name_some('node', used[twins[:, 0]])}"
    seam *= bool(len(twins))
    if parts > 1:
        sizes = np.sort(np.bincount(part[:count]))[::-1]
        shown = ", ".join(map(str, sizes[:4])) + ", ..." * (parts > 4)
        yield (
            f"it falls into {parts} parts of {shown} elements that share no face: what holds or "
            f"loads one does nothing to the others{seam}; merge the nodes of a seam, or make each "
            "part a body"
        )
    elif seam:
        yield f"{seam[2:]}; if this is no crack, merge them"
    middle = nodes[elements].mean(axis=1)
    near = cKDTree(middle).query(middle, min(NEIGHBOURS, count))[1].reshape(count, -1)
    inside = np.zeros(count, bool)
    for other in near.T:
        share = np.einsum("mai,mi->ma", gradients[other], middle - nodes[elements[other, 0]])
        within = (share > SAME_PLACE).all(axis=1) & (share.sum(axis=1) < 1 - SAME_PLACE)
        inside |= within & (other != np.arange(count))
    if inside.any():
        shown = name_some("element", np.flatnonzero(inside))
        yield f"it overlaps and counts mass twice: inside other elements are {shown}"
