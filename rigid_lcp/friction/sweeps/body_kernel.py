"""Sweeps in body space, plane and solid: momentum, visit and judgement of a contact in one pass.

A visit reads the velocities ``w = B^T y`` of two bodies (`rigid_lcp.friction.sweeps.blocks`),
solves its contact exactly and changes them.  A sweep with momentum begins at
``y = r + part (r - r before)``; as w is linear in y, w is carried ahead for all contacts at once,
and y itself is made contact by contact when it is needed; what a visit reads lies in one row: so a
sweep goes through the memory once, not four times.

Where W_cc can be inverted safely (`invert_blocks`), what sticks is ``r = y - W_cc^-1 u``, and what
slides in the plane has one sign only: with ``mu |W_NT| < W_NN`` the contact alone has one answer
(its matrix is a P-matrix for both signs), so it slides as it would without friction.  All else is
left to `rigid_lcp.friction.sweeps.local_contact`.
"""

import numpy as np
from numba import njit

from rigid_lcp.arrays import Floats, Ints
from rigid_lcp.friction.sweeps.local_contact import LOCAL, NONE, solve_contact_2d, solve_contact_3d

LEAST_DETERMINANT, MOST_COUPLING = LOCAL.least_determinant, LOCAL.most_coupling


@njit(cache=True)
def invert_blocks(local: Floats, friction: Floats) -> Floats:
    """W_cc^-1 of every block (nc, dim, dim); zeros where the general solution has to be used."""
    found = np.zeros_like(local)
    for c in range(len(local)):
        w = local[c]
        if w.shape[0] == 2:
            determinant = w[0, 0] * w[1, 1] - w[0, 1] * w[1, 0]
            safe = friction[c] * abs(w[0, 1]) < MOST_COUPLING * w[0, 0]
            if not (safe and w[0, 0] > 0.0 and determinant > LEAST_DETERMINANT * w[0, 0] * w[1, 1]):
                continue
            found[c, 0, 0], found[c, 1, 1] = w[1, 1] / determinant, w[0, 0] / determinant
            found[c, 0, 1], found[c, 1, 0] = -w[0, 1] / determinant, -w[1, 0] / determinant
            continue
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            for m in range(3):
                n, o = (m + 1) % 3, (m + 2) % 3
                found[c, m, i] = w[j, n] * w[k, o] - w[j, o] * w[k, n]
        determinant = w[0, 0] * found[c, 0, 0] + w[0, 1] * found[c, 1, 0] + w[0, 2] * found[c, 2, 0]
        if w[0, 0] > 0.0 and determinant > LEAST_DETERMINANT * w[0, 0] * w[1, 1] * w[2, 2]:
            found[c] /= determinant
        else:
            found[c] = 0.0
    return found


@njit(cache=True)
def pack_contacts(block: Floats, local: Floats, offset: Floats, friction: Floats) -> Floats:
    """All that a visit reads of a contact, in one row.

    In 2D (nc, 21): B_N of both bodies (6), B_T (6), q (2), W_cc as NN, NT, TT, its inverse in the
    same order, mu; in 3D (nc, 52): B_N, B_1, B_2 of both bodies (36), q (3), the upper triangles
    of W_cc and of its inverse by rows (6 each), mu.  W_cc = B B^T is symmetric.
    """
    contacts, dim = offset.shape
    size, upper = block.shape[3], dim * (dim + 1) // 2
    inverse = invert_blocks(local, friction)
    packed = np.empty((contacts, 2 * dim * size + dim + 2 * upper + 1))
    for c in range(contacts):
        at = 0
        for i in range(dim):
            for side in range(2):
                for m in range(size):
                    packed[c, at] = block[c, side, i, m]
                    at += 1
        for i in range(dim):
            packed[c, at] = offset[c, i]
            at += 1
        for i in range(dim):
            for j in range(i, dim):
                packed[c, at], packed[c, at + upper] = local[c, i, j], inverse[c, i, j]
                at += 1
        packed[c, at + upper] = friction[c]
    return packed


@njit(cache=True)
def sweep_bodies_2d(
    body: Ints, packed: Floats, local: Floats, force: Floats, last: Floats, velocity: Floats,
    part: float, visit: Ints,
) -> tuple[int, float, float]:  # fmt: skip
    """A sweep in the plane from y; changes ``force`` and the bodies' ``velocity`` (in: of y).

    ``body`` (nc, 2) holds rows of ``velocity``, ``packed`` is that of `pack_contacts`; ``last``
    becomes the forces before the sweep.  Returns how many contacts found no force and kept that
    of y, ``(y - r) . (r - r before)`` and ``|y - r|^2`` with the weights diag W: the first is
    positive if the sweep went against the way made.
    """
    stuck, product, square = 0, 0.0, 0.0
    for place in visit:
        c = np.uint64(place)  # a number without a sign is not tested for counting from the end
        a, b, p = np.uint64(body[c, 0]), np.uint64(body[c, 1]), packed[c]
        x_n, x_t = force[c, 0], force[c, 1]
        y_n, y_t = x_n + part * (x_n - last[c, 0]), x_t + part * (x_t - last[c, 1])
        a_0, a_1, a_2 = velocity[a, 0], velocity[a, 1], velocity[a, 2]
        b_0, b_1, b_2 = velocity[b, 0], velocity[b, 1], velocity[b, 2]
        u_n = p[0] * a_0 + p[1] * a_1 + p[2] * a_2 + p[3] * b_0 + p[4] * b_1 + p[5] * b_2 + p[12]
        u_t = p[6] * a_0 + p[7] * a_1 + p[8] * a_2 + p[9] * b_0 + p[10] * b_1 + p[11] * b_2 + p[13]
        mu, w_nn, w_nt, w_tt = p[20], p[14], p[15], p[16]
        q_n = u_n - w_nn * y_n - w_nt * y_t
        r_n, r_t = 0.0, 0.0
        if p[17] == 0.0:
            r_n, r_t, status = solve_contact_2d(local[c], q_n, u_t - w_nt * y_n - w_tt * y_t, mu)
            if status == NONE:
                stuck += 1
                r_n, r_t = y_n, y_t
        elif q_n < 0.0:
            r_n, r_t = y_n - p[17] * u_n - p[18] * u_t, y_t - p[18] * u_n - p[19] * u_t
            if r_n < 0.0 or abs(r_t) > mu * r_n:
                if w_nn * (u_t - w_nt * y_n - w_tt * y_t) < q_n * w_nt:
                    mu = -mu
                r_n = -q_n / (w_nn - mu * w_nt)
                r_t = -mu * r_n
        force[c, 0], force[c, 1], last[c, 0], last[c, 1] = r_n, r_t, x_n, x_t
        d_n, d_t = r_n - y_n, r_t - y_t
        product -= w_nn * d_n * (r_n - x_n) + w_tt * d_t * (r_t - x_t)
        square += w_nn * d_n * d_n + w_tt * d_t * d_t
        if d_n != 0.0 or d_t != 0.0:
            velocity[a, 0] += p[0] * d_n + p[6] * d_t
            velocity[a, 1] += p[1] * d_n + p[7] * d_t
            velocity[a, 2] += p[2] * d_n + p[8] * d_t
            velocity[b, 0] += p[3] * d_n + p[9] * d_t
            velocity[b, 1] += p[4] * d_n + p[10] * d_t
            velocity[b, 2] += p[5] * d_n + p[11] * d_t
    return stuck, product, square


@njit(cache=True)
def sweep_bodies_3d(
    body: Ints, packed: Floats, local: Floats, force: Floats, last: Floats, velocity: Floats,
    part: float, visit: Ints,
) -> tuple[int, float, float]:  # fmt: skip
    """`sweep_bodies_2d` in space."""
    stuck, product, square = 0, 0.0, 0.0
    for place in visit:
        c = np.uint64(place)
        a, b, p = np.uint64(body[c, 0]), np.uint64(body[c, 1]), packed[c]
        x_n, x_1, x_2 = force[c, 0], force[c, 1], force[c, 2]
        y_n, y_1 = x_n + part * (x_n - last[c, 0]), x_1 + part * (x_1 - last[c, 1])
        y_2 = x_2 + part * (x_2 - last[c, 2])
        u_n, u_1, u_2 = p[36], p[37], p[38]
        for k in range(6):
            v_a, v_b = velocity[a, k], velocity[b, k]
            u_n += p[k] * v_a + p[6 + k] * v_b
            u_1 += p[12 + k] * v_a + p[18 + k] * v_b
            u_2 += p[24 + k] * v_a + p[30 + k] * v_b
        w_nn, w_n1, w_n2, w_11, w_12, w_22 = p[39], p[40], p[41], p[42], p[43], p[44]
        q_n = u_n - w_nn * y_n - w_n1 * y_1 - w_n2 * y_2
        r_n, r_1, r_2 = 0.0, 0.0, 0.0
        if q_n < 0.0:
            mu = p[51]
            if p[45] > 0.0:
                r_n = y_n - p[45] * u_n - p[46] * u_1 - p[47] * u_2
                r_1 = y_1 - p[46] * u_n - p[48] * u_1 - p[49] * u_2
                r_2 = y_2 - p[47] * u_n - p[49] * u_1 - p[50] * u_2
            if p[45] == 0.0 or r_n < 0.0 or r_1 * r_1 + r_2 * r_2 > (mu * r_n) ** 2:
                q_1 = u_1 - w_n1 * y_n - w_11 * y_1 - w_12 * y_2
                q_2 = u_2 - w_n2 * y_n - w_12 * y_1 - w_22 * y_2
                r_n, r_1, r_2, status = solve_contact_3d(local[c], q_n, q_1, q_2, mu, -y_1, -y_2)
                if status == NONE:
                    stuck += 1
                    r_n, r_1, r_2 = y_n, y_1, y_2
        force[c, 0], force[c, 1], force[c, 2] = r_n, r_1, r_2
        last[c, 0], last[c, 1], last[c, 2] = x_n, x_1, x_2
        d_n, d_1, d_2 = r_n - y_n, r_1 - y_1, r_2 - y_2
        product -= w_nn * d_n * (r_n - x_n) + w_11 * d_1 * (r_1 - x_1) + w_22 * d_2 * (r_2 - x_2)
        square += w_nn * d_n * d_n + w_11 * d_1 * d_1 + w_22 * d_2 * d_2
        if d_n != 0.0 or d_1 != 0.0 or d_2 != 0.0:
            for k in range(6):
                velocity[a, k] += p[k] * d_n + p[12 + k] * d_1 + p[24 + k] * d_2
            for k in range(6):
                velocity[b, k] += p[6 + k] * d_n + p[18 + k] * d_1 + p[30 + k] * d_2
    return stuck, product, square
