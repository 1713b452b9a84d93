"""The compiled solution of one line: block elimination, and which sleepers bear."""

from typing import Any

import numpy as np
from numba import njit

from track_line.arrays import Bools, Floats

SOLVED, UNDECIDED, BROKEN = 0, 1, 2
"""Status of a solution: found; the turns ran out; the rail has too few seats to stand on."""
FREE_TURNS = 30
"""Turns that choose all sleepers at once; later ones choose one, which can not go round."""
TIE = 1e-15
"""Distance from a bed within which a sleeper stays as it was [m]: 1e-8 N."""
SINGULAR = 1e-12
"""Least pivot over that of the rail by itself [-]: below, the rail turns about one sleeper."""

compiled: Any = njit(cache=True, nogil=True, error_model="numpy")


@compiled
def eliminate(
    diagonal: Floats, upper: Floats, weight: Floats, load: Floats, sleeper_weight: float,
    series: Floats, rest: Floats, bears: Bools, work: Floats, rail: Floats,
) -> int:  # fmt: skip
    """Deflections ``rail`` (n,) where just the sleepers of ``bears`` bear: the block tridiagonal
    system, 2 by 2, from one end to the other and back."""
    n = load.size
    c11 = c12 = c21 = c22 = z1 = z2 = 0.0
    for i in range(n):
        d11, d12, d22 = diagonal[i, 0], diagonal[i, 1], diagonal[i, 2]
        y1, y2 = load[i] + weight[i, 0], weight[i, 1]
        if bears[i]:
            d11 += series[i]
            y1 += rest[i]
        else:
            y1 += sleeper_weight
        if i > 0:
            u11, u12, u21, u22 = upper[i - 1]
            d11 -= u11 * c11 + u21 * c21
            d12 -= u11 * c12 + u21 * c22
            d22 -= u12 * c12 + u22 * c22
            y1 -= u11 * z1 + u21 * z2
            y2 -= u12 * z1 + u22 * z2
        pivot = d11 * d22 - d12 * d12
        if not pivot > SINGULAR * diagonal[i, 0] * diagonal[i, 2]:
            return BROKEN
        one = 1.0 / pivot
        z1, z2 = (d22 * y1 - d12 * y2) * one, (d11 * y2 - d12 * y1) * one
        work[i, 4], work[i, 5] = z1, z2
        if i < n - 1:
            u11, u12, u21, u22 = upper[i]
            c11, c12 = (d22 * u11 - d12 * u21) * one, (d22 * u12 - d12 * u22) * one
            c21, c22 = (d11 * u21 - d12 * u11) * one, (d11 * u22 - d12 * u12) * one
            work[i, 0], work[i, 1], work[i, 2], work[i, 3] = c11, c12, c21, c22
    x1, x2 = work[n - 1, 4], work[n - 1, 5]
    rail[n - 1] = x1
    for i in range(n - 2, -1, -1):
        x1, x2 = (
            work[i, 4] - work[i, 0] * x1 - work[i, 1] * x2,
            work[i, 5] - work[i, 2] * x1 - work[i, 3] * x2,
        )
        rail[i] = x1
    return SOLVED


@compiled
def choose_bearing(rail: Floats, lifted: Floats, bears: Bools, most: int) -> int:
    """Let sleepers bear that lie above no gap, and others hang; at most ``most`` change.

    ``lifted`` (n,): deflection of the rail at which a sleeper leaves its bed [m].
    """
    changed = 0
    for i in range(rail.size):
        above = rail[i] - lifted[i]
        if (above < -TIE) if bears[i] else (above > TIE):
            bears[i] = not bears[i]
            changed += 1
            if changed == most:
                break
    return changed


@compiled
def pass_comb(
    diagonal: Floats, upper: Floats, weight: Floats, sleeper_weight: float, period: int,
    turns: int, wheels: Floats, series: Floats, rest: Floats, lifted: Floats, bears: Bools,
    level: Floats, force: Floats,
) -> int:  # fmt: skip
    """Deflection and force of each seat while its wheel is on it, wheels at every ``period``-th.

    ``wheels`` (b, n) [N], as ``series``, ``rest``, ``lifted``, ``level``, ``force``; ``bears``
    (b, period, n), kept for the next time.  Returns a status.
    """
    lines, n = series.shape
    rail, load, work = np.empty(n), np.zeros(n), np.empty((n, 6))
    for line in range(lines):
        for first in range(min(period, n)):
            load[:] = 0.0
            load[first::period] = wheels[line, first::period]
            mine = bears[line, first]
            turn = 0
            while True:
                status = eliminate(
                    diagonal, upper, weight, load, sleeper_weight, series[line], rest[line], mine,
                    work, rail,
                )  # fmt: skip
                if status != SOLVED:
                    return status
                turn += 1
                if choose_bearing(rail, lifted[line], mine, n if turn < FREE_TURNS else 1) == 0:
                    break
                if turn == turns:
                    return UNDECIDED
            for i in range(first, n, period):
                level[line, i] = rail[i]
                bearing = series[line, i] * rail[i] - rest[line, i] + sleeper_weight
                force[line, i] = bearing if mine[i] else 0.0
    return SOLVED
