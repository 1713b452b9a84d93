"""All point contacts of two polyhedra: the features that keep them apart say which.

The greatest separation along the normal of a face, or across two edges, is the distance, and these
features make the contacts (`rigid_lcp.contact.manifold`), unless corners are nearest: then it is
less than the distance, no candidate is as near as it says, and the nearest corner makes one too
(`rigid_lcp.contact.corners`).
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rigid_lcp.contact.corners import find_corner_candidates
from rigid_lcp.contact.manifold import (
    EDGES,
    SAME_CONTACT,
    TIE_IN_SPACE,
    add_candidate,
    find_face_candidates,
    keep_outer,
    least_gap,
)
from rigid_lcp.contact.separation import (
    NEARLY_OPPOSITE,
    Solids,
    cross_edges,
    dot,
    find_near_edges,
    separate_edges,
    separate_faces,
)

Floats = NDArray[np.float64]


@njit(cache=True)
def find_solid_contacts(
    solids: Solids, a: int, b: int, box_a: Floats, box_b: Floats, margin: float, size: float,
    found: Floats,
) -> int:  # fmt: skip
    """Point contacts of two polyhedra with a gap up to ``margin`` [m]; returns how many.

    ``box_a``, ``box_b``: bounding boxes, swollen or not; ``size``: the smaller reach of the
    two [m].  Rows of ``found`` as `CANDIDATE_COLUMNS` says.
    """
    face_a, gap_a = separate_faces(solids, a, b, margin)
    if gap_a > margin:
        return 0
    face_b, gap_b = separate_faces(solids, b, a, margin)
    if gap_b > margin:
        return 0
    near_a, near_b = (
        find_near_edges(solids, a, box_b, margin),
        find_near_edges(solids, b, box_a, margin),
    )
    edge_a, edge_b, gap_edges = separate_edges(solids, a, b, near_a, near_b, margin)
    if gap_edges > margin:
        return 0
    own_is_b = gap_b >= gap_a - TIE_IN_SPACE * size
    face, own, other = (face_b, b, a) if own_is_b else (face_a, a, b)
    crossing = np.empty(9)
    towards = solids.normal[face] * (1.0 if own_is_b else -1.0)
    # The normal is on the outer side of b's edge; grains with sharp edges may have it at more than
    # a right angle to that of the face.
    crosses = (
        edge_a >= 0
        and cross_edges(solids, a, edge_a, b, edge_b, solids.bisector[edge_b], crossing)
        and -TIE_IN_SPACE <= crossing[0] <= 1.0 + TIE_IN_SPACE
        and -TIE_IN_SPACE <= crossing[1] <= 1.0 + TIE_IN_SPACE
    )
    faces = max(gap_a, gap_b)
    alone = (
        crosses
        and gap_edges > faces + TIE_IN_SPACE * size
        and dot(crossing[3:6], towards) < np.cos(NEARLY_OPPOSITE)
    )
    count = 0
    if not alone:
        near = near_a if own_is_b else near_b
        count = find_face_candidates(solids, face, own, other, own_is_b, near, margin, size, found)
    least = least_gap(found, count)
    apart, missing = max(faces, gap_edges), least > gap_edges + TIE_IN_SPACE * size
    deep = count == 0 and apart < -TIE_IN_SPACE * size
    if alone or (crosses and missing and (gap_edges == apart or deep)):
        count = add_candidate(
            found, count, EDGES, edge_a - solids.first_edge[a], edge_b - solids.first_edge[b],
            crossing[2], crossing[3:6], 1.0, crossing[6:9], SAME_CONTACT * size,
        )  # fmt: skip
        least = least_gap(found, count)
    if apart > -TIE_IN_SPACE * size and least > apart + TIE_IN_SPACE * size:
        within = min(margin, least - TIE_IN_SPACE * size)
        count = find_corner_candidates(
            solids, a, b, near_a, near_b, within, size, towards, found, count
        )
    return keep_outer(found, count, size)
