"""Every grain by its own law, shrunk towards its neighbours by how far the window proves it."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array

from adapters.container import Container
from adapters.jump_field import (
    height_share,
    jump_arguments_check,
    kernel_pairs,
    mean_drop,
    mean_restored,
)
from adapters.laws.law import Law
from adapters.moves.move import (
    Move,
    block_moves,
    grain_weights,
    law_moves,
    within_variance,
)
from adapters.state import FloatArray

KERNEL_RADII = 2.5
"""Reach of the neighbours' mean in radii of the grain: those it touches, and little more."""


def displacement(
    cycle: FloatArray,
    position: FloatArray,
    radius: FloatArray,
    law: Law,
    h: float,
    container: Container,
) -> FloatArray:
    """Empirical Bayes estimate of each grain's move [m], shape (n, 3).

    The move of a grain's own law is taken apart, Delta_i = e_i + d_i + o_i: what a uniform vertical
    strain gives at its height (e), how far the mean of its neighbourhood departs from that (d), and
    how far the grain departs from its neighbourhood (o).  d and o are kept by the share that is
    proven, tau^2 / (tau^2 + s_i^2) each (`shrinkage`); e is that of the law of the mean path.

    Arguments and errors as `moves.move.Displacement`.  A window too short for two parts proves
    nothing: then the bed is strained evenly.
    """
    jump_arguments_check(position, radius, h)
    place, own = position[-1], law_moves(cycle, position, law, h)
    parts = block_moves(cycle, position, law, h)
    drop = mean_drop(cycle, position, law, h)
    if len(parts) < 2:
        return mean_restored(place, np.zeros_like(own), drop)
    weight = grain_weights(parts)
    local = local_mean(place, KERNEL_RADII * np.asarray(radius, float), weight)
    share = height_share(place)

    def taken_apart(move: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        near, even = local @ move, np.zeros_like(move)
        even[:, 2] = share * ((weight * share) @ near[:, 2] / ((weight * share) @ share))
        return even, near - even, move - near

    even, *deviations = taken_apart(own)
    of_parts = [taken_apart(part) for part in parts]
    kept = [
        shrinkage(np.stack([each[level] for each in of_parts]))[:, None] * deviation
        for level, deviation in enumerate(deviations, 1)
    ]
    return mean_restored(place, even + sum(kept), drop)


def local_mean(place: FloatArray, reach: FloatArray, weight: FloatArray) -> csr_array:
    """Matrix (n, n) of means over the grains within ``reach`` (n,) [m], each its own included.

    Weights (1 - (d / reach)^2) times ``weight`` (n,); ``place`` (n, 3) [m].
    """
    grain, neighbour, kernel = kernel_pairs(place, reach)
    value = kernel * weight[neighbour]
    value /= np.bincount(grain, value)[grain]
    return csr_array((value, (grain, neighbour)), shape=(len(place), len(place)))


def shrinkage(deviation: FloatArray) -> FloatArray:
    """Share tau^2 / (tau^2 + s_i^2) of each grain's mean deviation that is proven, shape (n,).

    ``deviation`` [m], shape (b, n, 3), b >= 2: by each part of the window.  s_i^2 is the variance
    within the grain (`moves.move.within_variance`), tau^2 that between grains, by moments: the
    mean over the grains of |mean deviation|^2 / 3 - s_i^2, none below 0.  A grain counts by
    1 / (e_i + median e) with e_i the mean square of its parts, so that a few loose ones do not
    rule.  Noise alone of any spread gives 0 in the mean: it knows no direction, and among parts of
    a given e_i products of different ones cancel.
    """
    variance = within_variance(deviation)
    square = (deviation.mean(axis=0) ** 2).sum(axis=1) / 3
    size = (deviation**2).mean(axis=(0, 2))
    weight = size + np.median(size)
    weight = np.divide(1.0, weight, out=np.ones_like(weight), where=weight > 0)
    between = max(float(np.average(square - variance, weights=weight)), 0.0)
    total = between + variance
    return np.divide(between, total, out=np.zeros_like(total), where=total > 0)


MOVE = Move("shrunk", displacement)
