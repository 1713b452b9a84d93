"""Compiled kernels of relaxation, on the rows of `adapters.bed.overlap_kernel`.

Moving the first grain of row c by dx changes its overlap by -normal.dx, moving the second by
+normal.dx: these are the rows of the matrix J below.
"""

import numpy as np
from numba import njit

from adapters.bed import GOLDEN_ANGLE, BoolArray, FloatArray, IntArray

_PROPORTION = 1.0
"""Share of the gradient on the bounds above which a bound is let go (Dostal's Gamma)."""


@njit(cache=True)
def add_hertz_energy(
    first: IntArray, second: IntArray, normal: FloatArray, overlap: FloatArray,
    stiffness: FloatArray, gradient: FloatArray,
) -> float:  # fmt: skip
    """Sum of psi = lambda/(gamma + 1) delta^(gamma + 1), gamma = 3/2 [J]; adds its gradient [N].

    ``stiffness`` lambda = 4/3 E* sqrt(R*) [N/m^1.5] of each row, ``gradient`` (n, 3).
    """
    energy = 0.0
    for c in range(len(first)):
        delta = overlap[c]
        if delta > 0.0:
            force = stiffness[c] * delta * np.sqrt(delta)
            energy += 0.4 * force * delta
            for a in range(3):
                gradient[first[c], a] -= force * normal[c, a]
                if second[c] >= 0:
                    gradient[second[c], a] += force * normal[c, a]
    return energy


@njit(cache=True)
def fill_moves(
    first: IntArray, second: IntArray, normal: FloatArray, height_share: float,
    multiplier: FloatArray, move: FloatArray,
) -> None:  # fmt: skip
    """Fill ``move`` = -J^T mu (n, 3); the last multiplier is that of the mean height."""
    move[:, :2], move[:, 2] = 0.0, -height_share * multiplier[-1]
    for c in range(len(first)):
        mu = multiplier[c]
        if mu != 0.0:
            i, j = first[c], second[c]
            x, y, z = mu * normal[c, 0], mu * normal[c, 1], mu * normal[c, 2]
            move[i, 0] += x
            move[i, 1] += y
            move[i, 2] += z
            if j >= 0:
                move[j, 0] -= x
                move[j, 1] -= y
                move[j, 2] -= z


@njit(cache=True)
def fill_changes(
    first: IntArray, second: IntArray, normal: FloatArray, height_share: float, move: FloatArray,
    change: FloatArray,
) -> None:  # fmt: skip
    """Fill ``change`` = J move (m + 1,): of the overlaps [m], and of the mean height last."""
    for c in range(len(first)):
        i, j = first[c], second[c]
        x, y, z = move[i, 0], move[i, 1], move[i, 2]
        if j >= 0:
            x -= move[j, 0]
            y -= move[j, 1]
            z -= move[j, 2]
        change[c] = -(normal[c, 0] * x + normal[c, 1] * y + normal[c, 2] * z)
    height = 0.0
    for i in range(len(move)):
        height += move[i, 2]
    change[len(first)] = height_share * height


@njit(cache=True)
def _apply(first, second, normal, height_share, slack, multiplier, move, out):  # type: ignore[no-untyped-def]
    """``out`` = (J J^T + slack) mu."""
    fill_moves(first, second, normal, height_share, multiplier, move)
    fill_changes(first, second, normal, height_share, move, out)
    for c in range(len(out)):
        out[c] = -out[c] + slack * multiplier[c]


@njit(cache=True)
def _split(multiplier, gradient, two_sided, step, free, chopped):  # type: ignore[no-untyped-def]
    """Free and chopped gradient; (reduced free . free, chopped . chopped, greatest entry)."""
    reduced, square, greatest = 0.0, 0.0, 0.0
    for c in range(len(gradient)):
        free[c], chopped[c] = gradient[c], 0.0
        if not two_sided[c]:
            if multiplier[c] <= 0.0:
                free[c], chopped[c] = 0.0, min(gradient[c], 0.0)
            reduced += free[c] * min(multiplier[c] / step, free[c])
        else:
            reduced += free[c] ** 2
        square += chopped[c] ** 2
        greatest = max(greatest, abs(free[c]), abs(chopped[c]))
    return reduced, square, greatest


@njit(cache=True, fastmath=True)
def _dot(a, b):  # type: ignore[no-untyped-def]
    """Scalar product, without a temporary array."""
    total = 0.0
    for c in range(len(a)):
        total += a[c] * b[c]
    return total


@njit(cache=True)
def _subtract(a, length, b):  # type: ignore[no-untyped-def]
    """a -= length b, without a temporary array."""
    for c in range(len(a)):
        a[c] -= length * b[c]


@njit(cache=True)
def estimate_norm(
    first: IntArray, second: IntArray, normal: FloatArray, height_share: float, grains: int,
    iterations: int,
) -> float:  # fmt: skip
    """Estimate of the greatest eigenvalue of J J^T, from below (power iteration)."""
    m = len(first)
    vector = np.empty(m + 1)
    for c in range(m + 1):
        vector[c] = 1.0 + 0.5 * np.sin(GOLDEN_ANGLE * c)
    out, move = np.empty(m + 1), np.empty((grains, 3))
    norm = 1.0
    for _ in range(iterations):
        vector /= np.sqrt(_dot(vector, vector))
        _apply(first, second, normal, height_share, 0.0, vector, move, out)
        norm = np.sqrt(_dot(out, out))
        if norm == 0.0:
            return 1.0
        vector[:] = out
    return norm


@njit(cache=True)
def solve_multipliers(
    first: IntArray, second: IntArray, normal: FloatArray, height_share: float, slack: float,
    two_sided: BoolArray, right: FloatArray, norm: float, tolerance: float, products_max: int,
    grains: int, multiplier: FloatArray,
) -> tuple[int, float]:  # fmt: skip
    """Minimise 1/2 mu.(J J^T + slack) mu - right.mu, with mu >= 0 where not ``two_sided``.

    Conjugate gradients on the free multipliers, with reduced-gradient projections where a bound
    is met and proportioning where one is let go: MPRGP, Dostal and Schoeberl, Comput. Optim.
    Appl. 30 (2005) 23.  ``multiplier`` (m + 1,) holds the start and the result.  Returns the
    products with J J^T and the greatest violated entry [m] of the optimality conditions.
    """
    size = len(multiplier)
    move, applied = np.empty((grains, 3)), np.empty(size)
    gradient, free, chopped = np.empty(size), np.empty(size), np.empty(size)
    step = 1.0 / (norm + slack)
    for c in range(size):
        if not two_sided[c]:
            multiplier[c] = max(multiplier[c], 0.0)
    _apply(first, second, normal, height_share, slack, multiplier, move, applied)
    gradient[:] = applied - right
    products = 1
    reduced, square, greatest = _split(multiplier, gradient, two_sided, step, free, chopped)
    direction = free.copy()
    while greatest > tolerance and products < products_max:
        if square > _PROPORTION**2 * reduced:
            _apply(first, second, normal, height_share, slack, chopped, move, applied)
            products += 1
            length = _dot(gradient, chopped) / _dot(chopped, applied)
            _subtract(multiplier, length, chopped)
            _subtract(gradient, length, applied)
            reduced, square, greatest = _split(multiplier, gradient, two_sided, step, free, chopped)
            direction[:] = free
            continue
        _apply(first, second, normal, height_share, slack, direction, move, applied)
        products += 1
        curvature = _dot(direction, applied)
        length = _dot(gradient, direction) / curvature
        feasible = np.inf
        for c in range(size):
            if not two_sided[c] and direction[c] > 0.0:
                feasible = min(feasible, multiplier[c] / direction[c])
        _subtract(multiplier, min(length, feasible), direction)
        _subtract(gradient, min(length, feasible), applied)
        reduced, square, greatest = _split(multiplier, gradient, two_sided, step, free, chopped)
        if length <= feasible:
            turn = _dot(free, applied) / curvature
            for c in range(size):
                direction[c] = free[c] - turn * direction[c]
            continue
        _subtract(multiplier, step, free)
        for c in range(size):
            if not two_sided[c]:
                multiplier[c] = max(multiplier[c], 0.0)
        _apply(first, second, normal, height_share, slack, multiplier, move, applied)
        products += 1
        gradient[:] = applied - right
        reduced, square, greatest = _split(multiplier, gradient, two_sided, step, free, chopped)
        direction[:] = free
    return products, greatest
