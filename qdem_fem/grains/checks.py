"""What the surface of a scanned stone must obey; all that is wrong is said at once."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from qdem_fem.grains.measures import edge_angles, find_surface_edges, polyhedron_integrals
from qdem_fem.mesh import (
    BoolArray,
    FloatArray,
    IntArray,
    Problem,
    face_area_vectors,
    named,
    raise_problems,
)

PAIRS_AT_ONCE = 2_000_000
"""Pairs of triangles that are looked at together."""
FLAT_TRIANGLE = 1e-12
"""Area of a triangle over its longest edge squared, at and below which it has none."""
FOLDED = 1e-6
"""Angle short of pi between the normals of two neighbours that lie upon each other [rad]."""


def check_surface(nodes: FloatArray, faces: IntArray, where: str) -> None:
    """Raise `MeshError` unless ``faces`` (k, 3) bound one body and run counter-clockwise.

    Refused: triangles without area, edges with one triangle (open) or more than two, triangles
    that run against their neighbour, two or more shells, nodes where two parts only touch, a
    surface inside out, triangles that cut through one another or are folded upon one another.
    Triangles of one plane that overlap without being neighbours are not seen.
    """
    area = np.linalg.norm(face_area_vectors(nodes, faces), axis=1)
    longest = ((nodes[faces] - nodes[np.roll(faces, 1, axis=1)]) ** 2).sum(axis=2).max(axis=1)
    flat = np.flatnonzero(~(area > FLAT_TRIANGLE * longest))
    problems: list[Problem] = []
    if len(flat):
        problems.append(
            Problem(f"no area: {named('triangle', flat)}", "remove or mend these triangles")
        )
    problems += edges_problems(faces)
    raise_problems(problems, where)
    problems += shells_problems(faces)
    volume = polyhedron_integrals(nodes, faces).volume
    if not problems and volume <= 0:
        problems.append(
            Problem(
                f"the surface is inside out: it encloses {volume:.3g} m^3",
                "turn the triangles round, or write the normals outward",
            )
        )
    raise_problems(problems, where)
    cutting = triangles_cutting(nodes, faces)
    _, angle = edge_angles(nodes, faces, edges := find_surface_edges(faces))
    folded = edges.faces[np.abs(angle) > np.pi - FOLDED]
    for pairs, how in ((cutting, "cut through"), (folded, "lie folded upon")):
        if len(pairs):
            one, other = pairs[0]
            problems.append(
                Problem(
                    f"the surface cuts itself: {len(pairs)} pairs of triangles {how} one another, "
                    f"the first {one} and {other}",
                    "mend the scan, for example with a mesh repair program",
                )
            )
    raise_problems(problems, where)


def edges_problems(faces: IntArray) -> list[Problem]:
    """Edges that do not join exactly two triangles running the same way round."""
    start, end = faces.reshape(-1), np.roll(faces, -1, axis=1).reshape(-1)
    size = int(faces.max()) + 1
    key, owner = start * size + end, np.repeat(np.arange(len(faces)), 3)
    low = np.minimum(start, end) * size + np.maximum(start, end)
    _, inverse, count = np.unique(low, return_inverse=True, return_counts=True)
    uses = count[inverse]
    problems = []
    if (uses == 1).any():
        at = np.unique(owner[uses == 1])
        problems.append(
            Problem(
                f"the surface is open: {int((uses == 1).sum())} edges have one triangle only, at "
                f"{named('triangle', at)}",
                "close the holes of the scan",
            )
        )
    if (uses > 2).any():
        at = np.unique(owner[uses > 2])
        problems.append(
            Problem(
                f"{len(np.unique(low[uses > 2]))} edges have more than two triangles, at "
                f"{named('triangle', at)}",
                "remove the triangles that are too many",
            )
        )
    _, inverse, count = np.unique(key, return_inverse=True, return_counts=True)
    against = (count[inverse] > 1) & (uses == 2)
    if against.any():
        at = np.unique(owner[against])
        problems.append(
            Problem(
                f"neighbours run against each other: {named('triangle', at)}",
                "let all triangles run counter-clockwise, seen from outside",
            )
        )
    return problems


def shells_problems(faces: IntArray) -> list[Problem]:
    """Parts that do not hang together, and nodes where two sheets only touch."""
    edges = find_surface_edges(faces)
    count = len(faces)
    one, other = edges.faces.T
    shells, _ = connected_components(
        coo_matrix((np.ones(len(one)), (one, other)), shape=(count, count)), directed=False
    )
    problems = []
    if shells > 1:
        problems.append(
            Problem(f"{shells} separate shells", "give one stone a file, without inner surfaces")
        )
    # corners (face, node) joined across the edges that leave the node: one ring for every node
    size = int(faces.max()) + 1
    key = (np.arange(count)[:, None] * size + faces).reshape(-1)
    order = np.argsort(key)
    ends = []
    for side in (0, 1):
        ends.append(
            [order[np.searchsorted(key, f * size + edges.nodes[:, side], sorter=order)]
             for f in (one, other)]
        )  # fmt: skip
    row, column = np.concatenate([pair[0] for pair in ends]), np.concatenate([p[1] for p in ends])
    rings, _ = connected_components(
        coo_matrix((np.ones(len(row)), (row, column)), shape=(len(key), len(key))), directed=False
    )
    touching = rings - len(np.unique(faces))
    if touching:
        problems.append(
            Problem(f"{touching} nodes where parts of the surface only touch", "part them there")
        )
    return problems


def triangles_cutting(nodes: FloatArray, faces: IntArray) -> IntArray:
    """Pairs of triangles (k, 2) of which an edge of one goes through the inside of the other."""
    corner = nodes[faces]
    low, high = corner.min(axis=1), corner.max(axis=1)
    order = np.argsort(low[:, 0])
    ends = np.searchsorted(low[order, 0], high[order, 0], side="right")
    reach = ends - np.arange(len(order)) - 1
    found = [np.zeros((0, 2), np.int64)]
    start = 0
    while start < len(order):
        stop = start + max(1, int(np.searchsorted(np.cumsum(reach[start:]), PAIRS_AT_ONCE)))
        rows = np.arange(start, min(stop, len(order)))
        first = np.repeat(rows, reach[rows])
        step = np.arange(len(first)) - np.repeat(np.cumsum(reach[rows]) - reach[rows], reach[rows])
        a, b = order[first], order[first + 1 + step]
        near = ((low[a, 1:] <= high[b, 1:]) & (low[b, 1:] <= high[a, 1:])).all(axis=1)
        a, b = a[near], b[near]
        cut = _pierced(nodes, faces[a], faces[b]) | _pierced(nodes, faces[b], faces[a])
        found.append(np.stack([a[cut], b[cut]], axis=1))
        start = int(rows[-1]) + 1
    return np.concatenate(found)


def _pierced(nodes: FloatArray, by: IntArray, faces: IntArray) -> BoolArray:
    """Whether an edge of ``by`` goes through ``faces`` (k, 3), (k,); not edges from their nodes."""
    a, b, c = nodes[faces].transpose(1, 0, 2)
    cut = np.zeros(len(faces), bool)
    for k in range(3):
        start, end = by[:, k], by[:, (k + 1) % 3]
        apart = (start[:, None] != faces).all(axis=1) & (end[:, None] != faces).all(axis=1)
        p, q = nodes[start], nodes[end]
        sides = _volume(a, b, c, p) * _volume(a, b, c, q) < 0
        around = np.stack([_volume(p, q, a, b), _volume(p, q, b, c), _volume(p, q, c, a)])
        inside = (around > 0).all(axis=0) | (around < 0).all(axis=0)
        cut |= apart & sides & inside
    return cut


def _volume(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> FloatArray:
    """Six times the signed volume of tetrahedra [m^3], (k,)."""
    return np.einsum("ki,ki->k", np.cross(b - a, c - a), d - a)
