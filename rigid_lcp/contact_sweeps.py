"""One sweep over the contacts, each solved exactly while the others are held: three kernels.

In body space, plane and solid, where a visit reads and changes the velocities of two bodies, and
by the rows of W.  A contact that has no solution keeps its force.  Arrays: `contact_blocks`.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rigid_lcp.local_contact import NONE, contact_2d, contact_3d

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@njit(cache=True)
def sweep_bodies_2d(
    body: Integers, block: Floats, local: Floats, offset: Floats, friction: Floats,
    force: Floats, velocity: Floats, visit: Integers,
) -> int:  # fmt: skip
    """A sweep in the plane, in body space; changes ``force`` and the bodies' ``velocity``.

    ``body`` (nc, 2) holds rows of ``velocity``.  Returns how many contacts found no force and
    kept theirs.
    """
    stuck = 0
    for c in visit:
        a, b = body[c, 0], body[c, 1]
        r_n, r_t = force[c, 0], force[c, 1]
        q_n = offset[c, 0] - local[c, 0, 0] * r_n - local[c, 0, 1] * r_t
        q_t = offset[c, 1] - local[c, 1, 0] * r_n - local[c, 1, 1] * r_t
        for k in range(3):
            v_a, v_b = velocity[a, k], velocity[b, k]
            q_n += block[c, 0, 0, k] * v_a + block[c, 1, 0, k] * v_b
            q_t += block[c, 0, 1, k] * v_a + block[c, 1, 1, k] * v_b
        new_n, new_t, status = contact_2d(local[c], q_n, q_t, friction[c])
        if status == NONE:
            stuck += 1
            continue
        force[c, 0], force[c, 1] = new_n, new_t
        d_n, d_t = new_n - r_n, new_t - r_t
        if d_n != 0.0 or d_t != 0.0:
            for k in range(3):
                velocity[a, k] += block[c, 0, 0, k] * d_n + block[c, 0, 1, k] * d_t
            for k in range(3):
                velocity[b, k] += block[c, 1, 0, k] * d_n + block[c, 1, 1, k] * d_t
    return stuck


@njit(cache=True)
def sweep_bodies_3d(
    body: Integers, block: Floats, local: Floats, offset: Floats, friction: Floats,
    force: Floats, velocity: Floats, visit: Integers,
) -> int:  # fmt: skip
    """`sweep_bodies_2d` in space."""
    stuck = 0
    for c in visit:
        a, b, w = body[c, 0], body[c, 1], local[c]
        r_n, r_1, r_2 = force[c, 0], force[c, 1], force[c, 2]
        q_n = offset[c, 0] - w[0, 0] * r_n - w[0, 1] * r_1 - w[0, 2] * r_2
        q_1 = offset[c, 1] - w[1, 0] * r_n - w[1, 1] * r_1 - w[1, 2] * r_2
        q_2 = offset[c, 2] - w[2, 0] * r_n - w[2, 1] * r_1 - w[2, 2] * r_2
        for k in range(6):
            v_a, v_b = velocity[a, k], velocity[b, k]
            q_n += block[c, 0, 0, k] * v_a + block[c, 1, 0, k] * v_b
            q_1 += block[c, 0, 1, k] * v_a + block[c, 1, 1, k] * v_b
            q_2 += block[c, 0, 2, k] * v_a + block[c, 1, 2, k] * v_b
        new_n, new_1, new_2, status = contact_3d(w, q_n, q_1, q_2, friction[c], -r_1, -r_2)
        if status == NONE:
            stuck += 1
            continue
        force[c, 0], force[c, 1], force[c, 2] = new_n, new_1, new_2
        d_n, d_1, d_2 = new_n - r_n, new_1 - r_1, new_2 - r_2
        if d_n != 0.0 or d_1 != 0.0 or d_2 != 0.0:
            for k in range(6):
                velocity[a, k] += (
                    block[c, 0, 0, k] * d_n + block[c, 0, 1, k] * d_1 + block[c, 0, 2, k] * d_2
                )
            for k in range(6):
                velocity[b, k] += (
                    block[c, 1, 0, k] * d_n + block[c, 1, 1, k] * d_1 + block[c, 1, 2, k] * d_2
                )
    return stuck


@njit(cache=True)
def sweep_matrix(
    start: Integers, column: Integers, block: Floats, local: Floats, offset: Floats,
    friction: Floats, force: Floats, visit: Integers,
) -> int:  # fmt: skip
    """A sweep with the rows of W, in blocks; changes ``force``; returns as `sweep_bodies_2d`."""
    stuck, dim = 0, force.shape[1]
    q = np.zeros(3)
    for c in visit:
        for i in range(dim):
            q[i] = offset[c, i]
        for entry in range(start[c], start[c + 1]):
            other = column[entry]
            if other != c:
                for i in range(dim):
                    for j in range(dim):
                        q[i] += block[entry, i, j] * force[other, j]
        if dim == 2:
            r_n, r_1, status = contact_2d(local[c], q[0], q[1], friction[c])
            r_2 = 0.0
        else:
            r_n, r_1, r_2, status = contact_3d(
                local[c], q[0], q[1], q[2], friction[c], -force[c, 1], -force[c, 2]
            )
        if status == NONE:
            stuck += 1
            continue
        force[c, 0], force[c, 1] = r_n, r_1
        if dim == 3:
            force[c, 2] = r_2
    return stuck
