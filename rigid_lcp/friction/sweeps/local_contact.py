"""One contact, solved exactly: ``u = W r + q`` under Coulomb's law with the full block W.

A contact is open, it sticks, or it slides (section 6).  Open: ``q_N >= 0`` and ``r = 0``.  Stick:
``W r = -q`` with r in the cone.  Slide along the unit vector d: ``r = r_N (1, -mu d)`` and
``u = (0, kappa d)`` with ``kappa >= 0``, that is

    r_N = -q_N / D,   D = W_NN - mu W_NT . d,   lambda d = g + G d,   lambda = kappa D,
    g = W_NN q_T - q_N W_TN,   G = mu (q_N W_TT - q_T W_NT)

In 2D d is one of two signs.  In 3D the component across d has to vanish, ``d_perp . (g + G d) =
0``: a quartic in the tangent of half the angle.  Newton's method finds one root from the last
direction; bisection between the roots of its derivatives finds all.  Updating the two tangents one
after the other instead is wrong: where W_TT is not diagonal such a sweep has another fixed point.

W need be neither symmetric nor regular.  Where several answers exist (a strong coupling W_NT)
the order is open, stick, slide; where none exists (Painleve) the status says so.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

from rigid_lcp.arrays import Floats, Ints


@dataclass(frozen=True)
class LocalNumbers:
    """One contact: round-off, blocks that can be inverted, Newton's steps."""

    round_off: float = 1e-14  # of a difference of the data [-]: ties on the edge of the cone
    singular_pivot: float = 1e-13  # of a block, over its greatest entry [-], or less
    least_determinant: float = 1e-8
    """Of a block that is inverted, over the product of its diagonal [-]."""
    most_coupling: float = 0.999
    """``mu |W_NT| / W_NN`` [-] with which the sign of sliding is known without a test."""
    newton_steps: int = 8  # for a direction near the last, at most [-]


LOCAL = LocalNumbers()
ROUND_OFF, SINGULAR_PIVOT, NEWTON_STEPS = LOCAL.round_off, LOCAL.singular_pivot, LOCAL.newton_steps


@njit(cache=True)
def find_direction_near(
    g_1: float, g_2: float, b_11: float, b_12: float, b_21: float, b_22: float,
    d_1: float, d_2: float,
) -> tuple[float, float, bool]:  # fmt: skip
    """Newton's method on the angle of d for ``d_perp . (g + G d) = 0``; False if it stalls."""
    length = np.sqrt(d_1 * d_1 + d_2 * d_2)
    if length == 0.0:
        return d_1, d_2, False
    d_1, d_2 = d_1 / length, d_2 / length
    scale = abs(g_1) + abs(g_2) + abs(b_11) + abs(b_12) + abs(b_21) + abs(b_22)
    for _ in range(NEWTON_STEPS):
        v_1 = g_1 + b_11 * d_1 + b_12 * d_2
        v_2 = g_2 + b_21 * d_1 + b_22 * d_2
        across = d_1 * v_2 - d_2 * v_1
        if abs(across) <= 1e-16 * scale:
            return d_1, d_2, True
        across_bend = d_1 * (b_22 * d_1 - b_21 * d_2) - d_2 * (b_12 * d_1 - b_11 * d_2)
        slope = across_bend - (d_1 * v_1 + d_2 * v_2)
        if abs(across) >= abs(slope):
            return d_1, d_2, False
        turn = -across / slope
        length = np.sqrt(1.0 + turn * turn)
        d_1, d_2 = (d_1 - turn * d_2) / length, (d_2 + turn * d_1) / length
        if abs(turn) <= 1e-9:  # the next error is its square
            return d_1, d_2, True
    return d_1, d_2, False


@njit(cache=True)
def find_all_directions(
    g_1: float, g_2: float, b_11: float, b_12: float, b_21: float, b_22: float, size: float
) -> tuple[Floats, int]:
    """Every d of length one with ``d_perp . (g + G d) = 0``: (directions (9, 2), their count).

    With ``d = (c, s)`` in axes turned so that the function is far from zero at their back, and
    ``t = tan(angle / 2)``, it is a quartic in t.  Of a function that is zero everywhere any d will
    do: the axes themselves are returned.  ``size``: see `find_sliding_force`.
    """
    found = np.zeros((9, 2))
    best, e_1, e_2 = 0.0, 1.0, 0.0
    for k in range(5):
        c, s = np.cos(0.4 * np.pi * k), np.sin(0.4 * np.pi * k)
        across = c * (g_2 + b_21 * c + b_22 * s) - s * (g_1 + b_11 * c + b_12 * s)
        if abs(across) > best:
            best, e_1, e_2 = abs(across), -c, -s
    if best <= ROUND_OFF * size:
        for k in range(4):
            found[k, 0], found[k, 1] = (1.0 - k, 0.0) if k % 2 == 0 else (0.0, 2.0 - k)
        return found, 4
    f_1, f_2 = -e_2, e_1
    h_1, h_2 = e_1 * g_1 + e_2 * g_2, f_1 * g_1 + f_2 * g_2
    v_1, v_2 = b_11 * e_1 + b_12 * e_2, b_21 * e_1 + b_22 * e_2
    w_1, w_2 = b_11 * f_1 + b_12 * f_2, b_21 * f_1 + b_22 * f_2
    skew = (f_1 * w_1 + f_2 * w_2) - (e_1 * v_1 + e_2 * v_2)
    below, above = f_1 * v_1 + f_2 * v_2, e_1 * w_1 + e_2 * w_2
    quartic = np.array([
        h_2 + below, 2.0 * (skew - h_1), -2.0 * below - 4.0 * above, -2.0 * (h_1 + skew),
        below - h_2,
    ])  # fmt: skip
    roots, count = find_real_roots(quartic)
    for k in range(count):
        t = roots[k]
        c, s = (1.0 - t * t) / (1.0 + t * t), 2.0 * t / (1.0 + t * t)
        d_1, d_2 = c * e_1 + s * f_1, c * e_2 + s * f_2
        p_1, p_2, better = find_direction_near(g_1, g_2, b_11, b_12, b_21, b_22, d_1, d_2)
        near = p_1 * d_1 + p_2 * d_2 > 1.0 - 1e-10
        found[k, 0], found[k, 1] = (p_1, p_2) if better and near else (d_1, d_2)
    return found, count


@njit(cache=True)
def find_real_roots(quartic: Floats) -> tuple[Floats, int]:
    """Real roots of ``sum quartic[k] t^k`` (quartic[4] not zero): (roots (9,), their count).

    Between the roots of its derivative a polynomial has one root or none: so from the constant
    up, each derivative's roots are bracketed by those of the next.  A double root is the root of
    the derivative where the polynomial is zero but for rounding.
    """
    bound = 1.0 + np.abs(quartic[:4]).max() / abs(quartic[4])  # Cauchy
    roots, count = np.zeros(9), 0
    for degree in range(1, 5):
        p = np.zeros(degree + 1)
        for k in range(degree + 1):
            p[k] = quartic[4 - degree + k]
            for j in range(4 - degree):
                p[k] *= 4 - degree + k - j
        found, number, low = np.zeros(9), 0, -bound
        for k in range(count + 1):
            high = bound if k == count else roots[k]
            at_low, at_high = evaluate_polynomial(p, low), evaluate_polynomial(p, high)
            if k < count and abs(at_high) <= 1e-15 * evaluate_polynomial(np.abs(p), abs(high)):
                found[number], number = high, number + 1
            elif at_low * at_high < 0.0:
                found[number], number = find_root_between(p, low, high), number + 1
            low = high
        roots, count = found, number
    return roots, count


@njit(cache=True)
def evaluate_polynomial(p: Floats, t: float) -> float:
    """``sum p[k] t^k`` by Horner's rule."""
    value = 0.0
    for k in range(len(p) - 1, -1, -1):
        value = value * t + p[k]
    return value


@njit(cache=True)
def find_root_between(p: Floats, low: float, high: float) -> float:
    """The root of a polynomial that changes sign in ``(low, high)``, by bisection."""
    sign = evaluate_polynomial(p, low)
    for _ in range(200):
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        if evaluate_polynomial(p, middle) * sign > 0.0:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


OPEN, STICK, SLIDE, NONE = 0, 1, 2, 3


@njit(cache=True)
def solve_contacts_apart(local: Floats, offset: Floats, friction: Floats) -> tuple[Floats, Ints]:
    """Contacts that feel no other: forces (nc, dim) and statuses (nc,) of W's blocks ``local``."""
    force, status = np.zeros_like(offset), np.zeros(len(offset), dtype=np.int64)
    for c in range(len(offset)):
        w, q, mu = local[c], offset[c], friction[c]
        if len(q) == 2:
            force[c, 0], force[c, 1], status[c] = solve_contact_2d(w, q[0], q[1], mu)
        else:
            r_n, r_1, r_2, status[c] = solve_contact_3d(w, q[0], q[1], q[2], mu, 0.0, 0.0)
            force[c, 0], force[c, 1], force[c, 2] = r_n, r_1, r_2
    return force, status


@njit(cache=True)
def solve_contact_2d(w: Floats, q_n: float, q_t: float, mu: float) -> tuple[float, float, int]:
    """Exact force of one contact in 2D; ``w`` (2, 2).  Returns (r_N, r_T, status)."""
    if q_n >= 0.0:
        return 0.0, 0.0, OPEN
    if mu == 0.0:
        return (-q_n / w[0, 0], 0.0, SLIDE) if w[0, 0] > 0.0 else (0.0, 0.0, NONE)
    straight, crossed = w[0, 0] * w[1, 1], w[0, 1] * w[1, 0]
    determinant = straight - crossed
    if abs(determinant) > SINGULAR_PIVOT * (abs(straight) + abs(crossed)):
        r_n = (w[0, 1] * q_t - w[1, 1] * q_n) / determinant
        r_t = (w[1, 0] * q_n - w[0, 0] * q_t) / determinant
        if r_n >= 0.0 and abs(r_t) <= mu * r_n:
            return r_n, r_t, STICK
    elif w[0, 0] > 0.0:
        r_n = -q_n / w[0, 0]
        if abs(w[1, 0] * r_n + q_t) <= ROUND_OFF * (abs(w[1, 0] * r_n) + abs(q_t)):
            return r_n, 0.0, STICK
    g = w[0, 0] * q_t - q_n * w[1, 0]
    bend = mu * (q_n * w[1, 1] - q_t * w[0, 1])
    first = 1.0 if g >= 0.0 else -1.0
    size = abs(w[0, 0] * q_t) + mu * abs(q_t * w[0, 1]) - q_n * (abs(w[1, 0]) + mu * abs(w[1, 1]))
    for d in (first, -first):
        denominator = w[0, 0] - mu * w[0, 1] * d
        if denominator > 0.0 and d * g + bend >= -ROUND_OFF * size:
            r_n = -q_n / denominator
            return r_n, -mu * r_n * d, SLIDE
    return 0.0, 0.0, NONE


@njit(cache=True)
def solve_contact_3d(
    w: Floats, q_n: float, q_1: float, q_2: float, mu: float, d_1: float, d_2: float
) -> tuple[float, float, float, int]:
    """Exact force of one contact in 3D; ``w`` (3, 3).  Returns (r_N, r_1, r_2, status).

    ``(d_1, d_2)``: a sliding direction to start from, of any length; zeros if none is known.
    """
    if q_n >= 0.0:
        return 0.0, 0.0, 0.0, OPEN
    if mu == 0.0:
        return (-q_n / w[0, 0], 0.0, 0.0, SLIDE) if w[0, 0] > 0.0 else (0.0, 0.0, 0.0, NONE)
    r_n, r_1, r_2, found = find_sticking_force(w, q_n, q_1, q_2)
    if found and r_n >= 0.0 and r_1 * r_1 + r_2 * r_2 <= (mu * r_n) ** 2:
        return r_n, r_1, r_2, STICK
    g_1 = w[0, 0] * q_1 - q_n * w[1, 0]
    g_2 = w[0, 0] * q_2 - q_n * w[2, 0]
    b_11 = mu * (q_n * w[1, 1] - q_1 * w[0, 1])
    b_12 = mu * (q_n * w[1, 2] - q_1 * w[0, 2])
    b_21 = mu * (q_n * w[2, 1] - q_2 * w[0, 1])
    b_22 = mu * (q_n * w[2, 2] - q_2 * w[0, 2])
    size = (w[0, 0] + mu * (abs(w[0, 1]) + abs(w[0, 2]))) * (abs(q_1) + abs(q_2)) - q_n * (
        abs(w[1, 0]) + abs(w[2, 0])
        + mu * (abs(w[1, 1]) + abs(w[1, 2]) + abs(w[2, 1]) + abs(w[2, 2]))
    )  # fmt: skip
    for start in range(2):  # from the last direction; then from that of uncoupled tangents
        if start == 1 or (d_1 == 0.0 and d_2 == 0.0):
            d_1, d_2 = g_1, g_2
        d_1, d_2, found = find_direction_near(g_1, g_2, b_11, b_12, b_21, b_22, d_1, d_2)
        if found:
            r_n = find_sliding_force(w, q_n, mu, g_1, g_2, b_11, b_12, b_21, b_22, d_1, d_2, size)
            if r_n > 0.0:
                return r_n, -mu * r_n * d_1, -mu * r_n * d_2, SLIDE
    directions, count = find_all_directions(g_1, g_2, b_11, b_12, b_21, b_22, size)
    for k in range(count):
        d_1, d_2 = directions[k, 0], directions[k, 1]
        r_n = find_sliding_force(w, q_n, mu, g_1, g_2, b_11, b_12, b_21, b_22, d_1, d_2, size)
        if r_n > 0.0:
            return r_n, -mu * r_n * d_1, -mu * r_n * d_2, SLIDE
    return 0.0, 0.0, 0.0, NONE


@njit(cache=True)
def find_sticking_force(
    w: Floats, q_n: float, q_1: float, q_2: float
) -> tuple[float, float, float, bool]:
    """Solve ``W r = -q`` by elimination with the greatest pivots; False if there is no solution.

    Of a singular block's solutions this is the one with zeros in the eliminated directions; the
    sliding directions hold those on the edge of the cone.
    """
    c_00 = w[1, 1] * w[2, 2] - w[1, 2] * w[2, 1]
    c_01 = w[1, 2] * w[2, 0] - w[1, 0] * w[2, 2]
    c_02 = w[1, 0] * w[2, 1] - w[1, 1] * w[2, 0]
    determinant = w[0, 0] * c_00 + w[0, 1] * c_01 + w[0, 2] * c_02
    trace = abs(w[0, 0]) + abs(w[1, 1]) + abs(w[2, 2])
    if abs(determinant) <= 1e-8 * trace * trace * trace:
        return find_sticking_force_pivoted(w, q_n, q_1, q_2)
    c_10 = w[0, 2] * w[2, 1] - w[0, 1] * w[2, 2]
    c_11 = w[0, 0] * w[2, 2] - w[0, 2] * w[2, 0]
    c_12 = w[0, 1] * w[2, 0] - w[0, 0] * w[2, 1]
    c_20 = w[0, 1] * w[1, 2] - w[0, 2] * w[1, 1]
    c_21 = w[0, 2] * w[1, 0] - w[0, 0] * w[1, 2]
    c_22 = w[0, 0] * w[1, 1] - w[0, 1] * w[1, 0]
    inverse = -1.0 / determinant
    r_n = (c_00 * q_n + c_10 * q_1 + c_20 * q_2) * inverse
    r_1 = (c_01 * q_n + c_11 * q_1 + c_21 * q_2) * inverse
    r_2 = (c_02 * q_n + c_12 * q_1 + c_22 * q_2) * inverse
    return r_n, r_1, r_2, True


@njit(cache=True)
def find_sticking_force_pivoted(
    w: Floats, q_n: float, q_1: float, q_2: float
) -> tuple[float, float, float, bool]:
    """`find_sticking_force` for blocks that are nearly or quite singular."""
    a = w.copy()
    b = np.array([-q_n, -q_1, -q_2])
    columns = np.array([0, 1, 2])
    greatest = np.abs(a).max()
    size = np.abs(b).max()
    rank = 0
    for k in range(3):
        pivot, row, column = 0.0, k, k
        for i in range(k, 3):
            for j in range(k, 3):
                if abs(a[i, j]) > pivot:
                    pivot, row, column = abs(a[i, j]), i, j
        if pivot <= SINGULAR_PIVOT * greatest:
            break
        rank += 1
        for j in range(3):
            a[k, j], a[row, j] = a[row, j], a[k, j]
        b[k], b[row] = b[row], b[k]
        for i in range(3):
            a[i, k], a[i, column] = a[i, column], a[i, k]
        columns[k], columns[column] = columns[column], columns[k]
        for i in range(k + 1, 3):
            factor = a[i, k] / a[k, k]
            for j in range(k, 3):
                a[i, j] -= factor * a[k, j]
            b[i] -= factor * b[k]
    for k in range(rank, 3):
        if abs(b[k]) > SINGULAR_PIVOT * size:
            return 0.0, 0.0, 0.0, False
    r = np.zeros(3)
    for i in range(rank - 1, -1, -1):
        value = b[i]
        for j in range(i + 1, rank):
            value -= a[i, j] * r[columns[j]]
        r[columns[i]] = value / a[i, i]
    return r[0], r[1], r[2], True


@njit(cache=True)
def find_sliding_force(
    w: Floats, q_n: float, mu: float, g_1: float, g_2: float,
    b_11: float, b_12: float, b_21: float, b_22: float, d_1: float, d_2: float, size: float,
) -> float:  # fmt: skip
    """r_N of a contact that slides along ``(d_1, d_2)``; -1 if D or kappa has the wrong sign.

    ``size``: sum of the magnitudes that g and G are made of, the measure of their rounding.
    """
    denominator = w[0, 0] - mu * (w[0, 1] * d_1 + w[0, 2] * d_2)
    kappa = d_1 * (g_1 + b_11 * d_1 + b_12 * d_2) + d_2 * (g_2 + b_21 * d_1 + b_22 * d_2)
    if denominator <= 0.0 or kappa < -ROUND_OFF * size:
        return -1.0
    return -q_n / denominator
