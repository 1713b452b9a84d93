"""Every grain by its own law, cut at the 95th percentile and smoothed over its neighbours."""

import numpy as np
from scipy.spatial import cKDTree

from adapters.bed import FloatArray
from adapters.moves.contract import Jump, Move, restore_mean

CLIP_QUANTILE = 0.95
"""Moves longer than this quantile of all are cut to it."""
SMOOTHING_RADII = 2.5
"""Reach of the smoothing, in a grain's own radius."""


def find_displacement(jump: Jump) -> FloatArray:
    """Estimated displacement of every grain [m], shape (n, 3).

    1. Each grain moves by the law's increment for its own path (eqs 16 to 21).
    2. Moves longer than the `CLIP_QUANTILE` of all are cut to it: the 1 % that move most, loose
       grains and rattlers, carry half of the squared displacement and do not repeat it.
    3. Each move becomes the mean over the neighbours within `SMOOTHING_RADII` of the grain's
       own radius, with weights 1 - (d / reach)^2: neighbours that stay together do not overlap.
    4. What the mean vertical move lost is laid on as a uniform vertical strain, zero at the lowest
       grain: the mean settlement is exactly that of the law fitted to the mean path.

    On full runs of 1,085 grains the mean settlement is met within 4 % of the total so far; the
    field of single grains is nearly unknown: its error (eq. 22) is 0.86, where moving nothing has
    1, the law log grain by grain 1.2, linear 1.6.  Do not use it where grains are carried past
    their neighbours within one window.
    """
    move = clip_moves(jump.extrapolate_grains(), CLIP_QUANTILE)
    move = smooth_moves(jump.place, move, SMOOTHING_RADII * jump.radius)
    return restore_mean(jump.place, move, jump.extrapolate_mean())


def clip_moves(move: FloatArray, quantile: float) -> FloatArray:
    """Moves [m], shape (n, 3), none longer than the ``quantile`` of their lengths; 1 keeps all."""
    length = np.linalg.norm(move, axis=1)
    bound = np.quantile(length, quantile, method="lower")
    scale = np.divide(bound, length, out=np.ones_like(length), where=length > bound)
    return np.asarray(move * scale[:, None])


def smooth_moves(position: FloatArray, move: FloatArray, reach: FloatArray) -> FloatArray:
    """Weighted means of the moves [m], shape (n, 3), of all grains nearer than ``reach`` [m].

    Weights 1 - (d / reach)^2 with distances d between ``position`` [m], shape (n, 3); ``reach``
    is each grain's own, shape (n,); every grain is a neighbour of itself.
    """
    near = cKDTree(position).query_ball_point(position, reach)
    count = np.fromiter(map(len, near), int, len(near))
    grain = np.repeat(np.arange(len(near)), count)
    neighbour = np.concatenate(near).astype(int)
    distance = np.linalg.norm(position[grain] - position[neighbour], axis=1)
    weight = np.maximum(1 - (distance / reach[grain]) ** 2, 0.0)
    total = np.bincount(grain, weight)
    return np.stack(
        [np.bincount(grain, weight * move[neighbour, axis]) / total for axis in range(3)], axis=1
    )


MOVE = Move("smoothed", find_displacement)
