"""Algebra of the Lorentz cone ``x_0 >= |x_1:|``, one cone a row of an (nc, dim) array.

Jordan product, distance to the boundary, and the scaling of Nesterov and Todd, which maps a pair
x, s inside the cone onto one point, ``W x = W^-1 s``.  After Vandenberghe, The CVXOPT linear and
quadratic cone program solvers (2010), sections 2 and 4.
"""

import numpy as np
from numba import njit

from rigid_lcp.arrays import Floats

BOUNDARY = 1e-30
"""Least determinant over x_0^2: round-off may put a point onto the boundary."""


@njit(cache=True)
def find_determinant(x: Floats) -> float:
    """``x_0^2 - |x_1:|^2`` of one vector, positive inside."""
    squares = 0.0
    for k in range(1, len(x)):
        squares += x[k] ** 2
    length = np.sqrt(squares)
    return max((x[0] - length) * (x[0] + length), BOUNDARY * x[0] ** 2)


@njit(cache=True)
def multiply_cones(a: Floats, b: Floats) -> Floats:
    """Jordan product ``a o b = (a.b, a_0 b_1: + b_0 a_1:)`` of each row."""
    product = np.empty_like(a)
    for c in range(a.shape[0]):
        inner = a[c, 0] * b[c, 0]
        for k in range(1, a.shape[1]):
            inner += a[c, k] * b[c, k]
            product[c, k] = a[c, 0] * b[c, k] + b[c, 0] * a[c, k]
        product[c, 0] = inner
    return product


@njit(cache=True)
def divide_cones(a: Floats, b: Floats) -> Floats:
    """The x with ``a o x = b`` of each row, a inside its cone."""
    quotient = np.empty_like(a)
    for c in range(a.shape[0]):
        inner = 0.0
        for k in range(1, a.shape[1]):
            inner += a[c, k] * b[c, k]
        quotient[c, 0] = (a[c, 0] * b[c, 0] - inner) / find_determinant(a[c])
        for k in range(1, a.shape[1]):
            quotient[c, k] = (b[c, k] - quotient[c, 0] * a[c, k]) / a[c, 0]
    return quotient


@njit(cache=True)
def find_cone_step(x: Floats, direction: Floats) -> float:
    """Greatest t with every row of ``x + t direction`` in its cone; 1e30 if there is none."""
    step = 1e30
    for c in range(x.shape[0]):
        # det(x + t d) = det x + 2 b t + a t^2; its least positive root, without cancellation
        a, b = direction[c, 0] ** 2, x[c, 0] * direction[c, 0]
        for k in range(1, x.shape[1]):
            a -= direction[c, k] ** 2
            b -= x[c, k] * direction[c, k]
        inside = find_determinant(x[c])
        if direction[c, 0] < 0.0:
            step = min(step, -x[c, 0] / direction[c, 0])
        discriminant = b * b - a * inside
        if discriminant >= 0.0:
            root = np.sqrt(discriminant)
            if root > b:
                step = min(step, inside / (root - b))
            if -root > b:
                step = min(step, inside / (-root - b))
    return step


@njit(cache=True)
def find_scaling(x: Floats, s: Floats) -> tuple[Floats, Floats]:
    """Scale eta (nc,) and point w (nc, dim) of the scaling ``W = eta (2 v v^T - J)``.

    v is ``(w + e) / sqrt(2 (w_0 + 1))``, J is diag(1, -1, ...), and ``W^2 x = s``.
    """
    nc, dim = x.shape
    eta, point = np.empty(nc), np.empty((nc, dim))
    for c in range(nc):
        size_x, size_s = np.sqrt(find_determinant(x[c])), np.sqrt(find_determinant(s[c]))
        eta[c] = np.sqrt(size_s / size_x)
        inner = 0.0
        for k in range(dim):
            inner += (x[c, k] / size_x) * (s[c, k] / size_s)
        gamma = np.sqrt(0.5 * (1.0 + inner))
        point[c, 0] = 0.5 * (s[c, 0] / size_s + x[c, 0] / size_x) / gamma
        for k in range(1, dim):
            point[c, k] = 0.5 * (s[c, k] / size_s - x[c, k] / size_x) / gamma
    return eta, point


@njit(cache=True)
def scale_cones(eta: Floats, point: Floats, z: Floats, inverse: bool) -> Floats:
    """``W z`` of each row, or ``W^-1 z``, which is ``J W J z / eta^2``."""
    scaled = np.empty_like(z)
    sign = -1.0 if inverse else 1.0
    for c in range(z.shape[0]):
        inner = 0.0
        for k in range(1, z.shape[1]):
            inner += point[c, k] * z[c, k]
        inner = z[c, 0] + sign * inner / (point[c, 0] + 1.0)
        factor = 1.0 / eta[c] if inverse else eta[c]
        scaled[c, 0] = factor * (inner * (point[c, 0] + 1.0) - z[c, 0])
        for k in range(1, z.shape[1]):
            scaled[c, k] = factor * (z[c, k] + sign * inner * point[c, k])
    return scaled


@njit(cache=True)
def square_scaling(eta: Floats, point: Floats) -> Floats:
    """``W^2 = eta^2 (2 w w^T - J)`` of each row, (nc, dim, dim): maps x to s."""
    nc, dim = point.shape
    square = np.empty((nc, dim, dim))
    for c in range(nc):
        for i in range(dim):
            for j in range(dim):
                square[c, i, j] = eta[c] ** 2 * 2.0 * point[c, i] * point[c, j]
            square[c, i, i] += eta[c] ** 2 * (-1.0 if i == 0 else 1.0)
    return square
