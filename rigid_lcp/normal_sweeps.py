"""Gauss-Seidel with momentum for contacts without friction: normal forces only."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Indices = NDArray[np.int32]

GROWTH = 1.5
"""Momentum starts again when a sweep goes so many times as far as the shortest since it did."""


@njit(cache=True)
def normal_sweeps(
    start: Indices, index: Indices, value: Floats, b: Floats, f: Floats, sweeps: int,
    at_once: int, few: int,
) -> int:  # fmt: skip
    """Sweeps of ``f_c = max(f_c - a_c / A_cc, 0)`` with momentum (`rigid_lcp.gauss_seidel`).

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
        if product > 0.0 or square > GROWTH**2 * least:
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
