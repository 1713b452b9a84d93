"""The directions in which one contact in 3D can slide: ``lambda d = g + G d``, d of length one.

The component across d has to vanish, ``d_perp . (g + G d) = 0``: a quartic in the tangent of half
the angle.  Newton's method finds one root from the last direction; bisection between the roots of
its derivatives finds all.  g and G are those of `rigid_lcp.friction.sweeps.local_contact`.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from rigid_lcp.arrays import Floats

TIE_ROUND_OFF = 1e-14
"""Relative size below which a difference of the data is rounding: ties on the edge of the cone."""
NEWTON_STEPS = 8


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
    do: the axes themselves are returned.  ``size``: see `force_sliding`.
    """
    found = np.zeros((9, 2))
    best, e_1, e_2 = 0.0, 1.0, 0.0
    for k in range(5):
        c, s = np.cos(0.4 * np.pi * k), np.sin(0.4 * np.pi * k)
        across = c * (g_2 + b_21 * c + b_22 * s) - s * (g_1 + b_11 * c + b_12 * s)
        if abs(across) > best:
            best, e_1, e_2 = abs(across), -c, -s
    if best <= TIE_ROUND_OFF * size:
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
            at_low, at_high = polynomial(p, low), polynomial(p, high)
            if k < count and abs(at_high) <= 1e-15 * polynomial(np.abs(p), abs(high)):
                found[number], number = high, number + 1
            elif at_low * at_high < 0.0:
                found[number], number = find_root_between(p, low, high), number + 1
            low = high
        roots, count = found, number
    return roots, count


@njit(cache=True)
def polynomial(p: Floats, t: float) -> float:
    """``sum p[k] t^k`` by Horner's rule."""
    value = 0.0
    for k in range(len(p) - 1, -1, -1):
        value = value * t + p[k]
    return value


@njit(cache=True)
def find_root_between(p: Floats, low: float, high: float) -> float:
    """The root of a polynomial that changes sign in ``(low, high)``, by bisection."""
    sign = polynomial(p, low)
    for _ in range(200):
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        if polynomial(p, middle) * sign > 0.0:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)
