"""Which face parts two bodies, where several do: flush joints, level edges, passing corners.

Bodies are apart as long as one face of them parts them.  The one that parts them most is right for
most pairs, and wrong for a block that slides over flush slabs: just before a joint the end of the
next slab parts them by a millimetre and its top by nothing, and a contact with that end stops the
block.  A step keeps a pair apart along one face only, so that one is taken along which

1. a third body keeps them apart: a contact of the same normal whose gap is no greater (the slab on
   which the block lies, or on which it lands and is in by as much; where two faces are such, as
   of slabs that touch each other, rule 2 chooses between them), or else
2. they will be the farthest apart, or the least deep, if they move on as they do.

Both are exact for flush and level pieces, fixed or not.  Where two corners meet and nothing else is
near, rule 2 is a guess to the first order in the step: bodies that would pass within the way of a
step may touch, and those that touch may slide past.
"""

import numpy as np
from numba import njit

from rigid_lcp.arrays import Floats, Ints

PARALLEL = 1.0 - 1e-12
"""Cosine of two normals above which they are one [-]: 1.4e-6 rad."""


@njit(cache=True)
def project(normal: Floats, x: Floats) -> float:
    """Scalar product of two vectors (dim,)."""
    product = 0.0
    for axis in range(len(x)):
        product += normal[axis] * x[axis]
    return product


@njit(cache=True)
def find_move_along(normal: Floats, x: Floats, centre: Floats, drift: Floats) -> float:
    """How far the point ``x`` (dim,) [m] of a body moves along ``normal`` as the body drifts.

    ``drift`` (3,) or (6,): its move [m] and turn [rad]; ``centre`` (dim,): centre of mass [m].
    """
    r0, r1 = x[0] - centre[0], x[1] - centre[1]  # small arrays would cost more than all of this
    if len(x) == 2:
        return normal[0] * (drift[0] - drift[2] * r1) + normal[1] * (drift[1] + drift[2] * r0)
    r2 = x[2] - centre[2]
    return (
        normal[0] * (drift[0] + drift[4] * r2 - drift[5] * r1)
        + normal[1] * (drift[1] + drift[5] * r0 - drift[3] * r2)
        + normal[2] * (drift[2] + drift[3] * r1 - drift[4] * r0)
    )


@njit(cache=True)
def find_gap_later(
    normal: Floats, vertices_a: Floats, vertices_b: Floats, centres: Floats, drifts: Floats
) -> float:
    """Gap of two bodies along ``normal``, from b to a, once both drifted [m]."""
    low, high = np.inf, -np.inf
    for v in range(len(vertices_a)):
        x = vertices_a[v]
        low = min(low, project(normal, x) + find_move_along(normal, x, centres[0], drifts[0]))
    for v in range(len(vertices_b)):
        x = vertices_b[v]
        high = max(high, project(normal, x) + find_move_along(normal, x, centres[1], drifts[1]))
    return low - high


@njit(cache=True)
def find_gap_over(normal: Floats, offset: float, vertices: Floats, least: float) -> float:
    """Gap of ``vertices`` (v, dim) over a face [m]; below ``least`` it is looked for no further."""
    gap = np.inf
    for v in range(len(vertices)):
        gap = min(gap, project(normal, vertices[v]) - offset)
        if gap < least:
            break
    return gap


@njit(cache=True)
def is_kept_apart(
    bodies: Ints, numbers: Floats, count: int, a: int, b: int, normal: Floats, gap: float
) -> bool:
    """A contact with a third body keeps a and b apart along ``normal``, from b to a.

    Its gap is at most ``gap`` [m].  Of ``count`` contacts found so far ``bodies`` (nc, 2) and
    ``numbers`` (nc, 2 dim + 3): point, normal, gap and so on.
    """
    dim = len(normal)
    for k in range(count):
        if numbers[k, 2 * dim] > gap:
            continue
        along = project(normal, numbers[k, dim : 2 * dim])
        first, second = bodies[k, 0], bodies[k, 1]
        if along < 0.0:
            first, second, along = second, first, -along
        if along > PARALLEL and (first == a) != (second == b):
            return True
    return False


@njit(cache=True)
def choose_face(
    normals_a: Floats, offsets_a: Floats, vertices_a: Floats, normals_b: Floats, offsets_b: Floats,
    vertices_b: Floats, centres: Floats, drifts: Floats, widest: Floats, widest_gap: float,
    tie: float, depth: float, bodies: Ints, numbers: Floats, count: int, a: int, b: int,
) -> tuple[int, int]:  # fmt: skip
    """Face that stands for a pair (rules 1 and 2 above) in place of what parts it most.

    ``widest`` (dim,): normal, from b to a, along which it is parted most, by ``widest_gap`` [m].
    Rows of ``centres`` and ``drifts`` (`find_move_along`): a, b.  Lengths within ``tie`` [m] are
    equal; faces may overlap by ``depth`` [m], as they do in the midst of a step in which a body
    lands on several others.  ``count``: contacts of other pairs (`is_kept_apart`), -1 to ask only
    whether there is such a face.  Returns 0 for a's face or 1 for b's, and its number there; -1 and
    0 where what parts it most stays.
    """
    chosen, number = -1, 0
    kept = is_kept_apart(bodies, numbers, count, a, b, widest, widest_gap + tie)
    later = find_gap_later(widest, vertices_a, vertices_b, centres, drifts)
    closing = later < -tie
    for side in range(2):
        faces, offsets, vertices = normals_a, offsets_a, vertices_b
        if side == 1:
            faces, offsets, vertices = normals_b, offsets_b, vertices_a
        for face in range(len(faces)):
            gap = find_gap_over(faces[face], offsets[face], vertices, -depth)
            if gap < -depth:
                continue
            normal = faces[face] * (2.0 * side - 1.0)
            if project(normal, widest) > PARALLEL:
                continue
            supported = is_kept_apart(bodies, numbers, count, a, b, normal, gap + tie)
            if count < 0 or (supported and not kept):
                return side, face
            expected = find_gap_later(normal, vertices_a, vertices_b, centres, drifts)
            eligible = supported if kept else closing and gap >= -tie
            if eligible and expected > later + tie:
                chosen, number, later = side, face, expected
    return chosen, number
