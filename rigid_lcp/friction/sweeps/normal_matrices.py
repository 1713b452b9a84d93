"""The normal part of W, and what of it belongs to the contacts that carry: kernels.

Matrices by rows, as scipy's CSR: ``start`` (rows + 1,), ``index`` and ``value`` (entries,).
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rigid_lcp.arrays import Floats
from rigid_lcp.friction.sweeps.contact_kernel import CHANGE_GROWTH

Indices = NDArray[np.int32]

MIRROR_ROUND_OFF = 1e-13
"""Difference of an entry and its mirror image that is none, over the largest entry [-]."""


@njit(cache=True)
def multiply_normals(
    start: Indices, index: Indices, value: Floats, mass_start: Indices, mass_index: Indices,
    inverse_mass: Floats, freedoms: int,
) -> tuple[Indices, Indices, Floats]:  # fmt: skip
    """``A = J M^-1 J^T``: J (nc, freedoms) and M^-1 by rows, M symmetric."""
    nc = len(start) - 1
    at = np.zeros(freedoms + 1, np.int32)  # J by columns: contacts at[k]:at[k + 1] move freedom k
    for k in index:
        at[k + 1] += 1
    at = np.cumsum(at).astype(np.int32)
    contact, entry, free = np.empty(len(index), np.int32), np.empty(len(index)), at[:-1].copy()
    for c in range(nc):
        for k in range(start[c], start[c + 1]):
            contact[free[index[k]]], entry[free[index[k]]] = c, value[k]
            free[index[k]] += 1
    product_start = np.zeros(nc + 1, np.int32)
    product_index, product = np.empty(16 * nc, np.int32), np.empty(16 * nc)
    end, place = 0, np.full(nc, -1, np.int64)
    for c in range(nc):
        first = end
        for k in range(start[c], start[c + 1]):
            for j in range(mass_start[index[k]], mass_start[index[k] + 1]):
                part = value[k] * inverse_mass[j]
                for i in range(at[mass_index[j]], at[mass_index[j] + 1]):
                    if place[contact[i]] < first:
                        if end == len(product):
                            product_index = np.concatenate((product_index, product_index))
                            product = np.concatenate((product, product))
                        place[contact[i]] = end
                        product_index[end], product[end] = contact[i], 0.0
                        end += 1
                    product[place[contact[i]]] += part * entry[i]
        product_start[c + 1] = end
    return product_start, product_index[:end].copy(), product[:end].copy()


@njit(cache=True)
def find_bandwidth(start: Indices, index: Indices, inside: Indices) -> int:
    """Greatest distance from the diagonal of an entry of the matrix with these rows, in order."""
    rank = np.full(len(start) - 1, -1, np.int64)
    for k in range(len(inside)):
        rank[inside[k]] = k
    width = 0
    for k in range(len(inside)):
        for j in range(start[inside[k]], start[inside[k] + 1]):
            if rank[index[j]] >= 0:
                width = max(width, k - rank[index[j]])
    return width


@njit(cache=True)
def build_band(
    start: Indices, index: Indices, value: Floats, inside: Indices, shift: float, width: int
) -> tuple[Floats, bool]:
    """Rows and columns ``inside`` of a matrix, in order, with ``shift`` on the diagonal.

    Its columns from the diagonal down (n, width + 1), and whether it is symmetric.
    """
    rank = np.full(len(start) - 1, -1, np.int64)
    for k in range(len(inside)):
        rank[inside[k]] = k
    band = np.zeros((len(inside), width + 1))
    other = 0.0  # what is above the diagonal and not below
    largest = 0.0
    for k in range(len(inside)):
        band[k, 0] = shift
        largest = max(largest, shift)
    for k in range(len(inside)):
        for j in range(start[inside[k]], start[inside[k] + 1]):
            below = k - rank[index[j]]
            if 0 <= below <= k:
                band[k - below, below] += value[j]
                largest = max(largest, abs(value[j]))
    for k in range(len(inside)):
        for j in range(start[inside[k]], start[inside[k] + 1]):
            above = rank[index[j]] - k
            if above > 0:
                other = max(other, abs(band[k, above] - value[j]))
    return band, other <= MIRROR_ROUND_OFF * largest


@njit(cache=True)
def sweep_normals(
    start: Indices, index: Indices, value: Floats, b: Floats, f: Floats, sweeps: int,
    at_once: int, few: int,
) -> int:  # fmt: skip
    """Sweeps of ``f_c = max(f_c - a_c / A_cc, 0)`` with momentum
    (`rigid_lcp.friction.methods.gauss_seidel`).

    A by rows: ``start`` (nc + 1,), ``index`` and ``value`` (entries,) as in scipy's CSR; ``b`` and
    the forces ``f`` (nc,), which it changes.  Ends after ``sweeps``, or when no more than ``few``
    contacts changed sides in ``at_once`` of them; returns how many were made.
    """
    nc = len(b)
    diagonal = np.zeros(nc)
    for c in range(nc):
        for k in range(start[c], start[c + 1]):
            if index[k] == c:
                diagonal[c] += value[k]
    last, origin, carries = f.copy(), f.copy(), f > 0.0
    time, least = 1.0, math.inf
    for sweep in range(1, sweeps + 1):
        later = 0.5 * (1.0 + math.sqrt(1.0 + 4.0 * time**2))
        part, time = (time - 1.0) / later, later
        for c in range(nc):
            now = f[c]
            f[c] = origin[c] = now + part * (now - last[c])
            last[c] = now
        product = square = 0.0
        for c in range(nc):
            if diagonal[c] <= 0.0:
                continue
            a = b[c]
            for k in range(start[c], start[c + 1]):
                a += value[k] * f[index[k]]
            f[c] = max(f[c] - a / diagonal[c], 0.0)
            back = origin[c] - f[c]
            product += diagonal[c] * back * (f[c] - last[c])
            square += diagonal[c] * back * back
        least = min(least, square)
        if product > 0.0 or square > CHANGE_GROWTH**2 * least:
            time, least = 1.0, math.inf
        if sweep % at_once == 0:
            changed = 0
            for c in range(nc):
                if (f[c] > 0.0) != carries[c]:
                    changed += 1
                    carries[c] = not carries[c]
            if changed <= few:
                return sweep
    return sweeps
