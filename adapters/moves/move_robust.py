"""Every grain by its own law, outliers cut where the distribution ends, rattlers carried along."""

from __future__ import annotations

import numpy as np

from adapters.container import Container
from adapters.jump_field import (
    jump_arguments_check,
    kernel_pairs,
    mean_drop,
    mean_restored,
)
from adapters.laws.law import Law
from adapters.moves.move import Move, law_moves
from adapters.state import FloatArray

FENCE = 1.5
"""Tukey's fence: so many interquartile ranges above the upper quartile a value is an outlier."""
KERNEL_RADII = 2.5
"""Reach of the neighbours that carry a rattler, in its radii."""


def displacement(
    cycle: FloatArray,
    position: FloatArray,
    radius: FloatArray,
    law: Law,
    h: float,
    container: Container,
) -> FloatArray:
    """The law's increment of each grain's path, made safe from outliers [m], shape (n, 3).

    Lengths of moves are about log-normal; those beyond Tukey's fence of their logarithms are cut to
    it (`upper_fence`).  Rattlers, whose median step from cycle to cycle is beyond the fence of all
    such steps, take the mean move of the neighbours that are none; without such they stay.  The
    mean vertical move is that of the law of the mean path.

    Arguments and errors as `moves.move.Displacement`.
    """
    jump_arguments_check(position, radius, h)
    place, move = position[-1], law_moves(cycle, position, law, h)
    length = np.linalg.norm(move, axis=1)
    bound = upper_fence(length)
    move = move * np.divide(bound, length, out=np.ones_like(length), where=length > bound)[:, None]
    step = np.median(np.linalg.norm(np.diff(position, axis=0), axis=2), axis=0)
    rattles = step > upper_fence(step)
    grain, neighbour, weight = kernel_pairs(place, KERNEL_RADII * np.asarray(radius, float))
    weight = np.where(rattles[neighbour], 0.0, weight)
    total = np.bincount(grain, weight)
    for axis in range(3):
        near = np.bincount(grain, weight * move[neighbour, axis])
        mean = np.divide(near, total, out=np.zeros_like(near), where=total > 0)
        move[rattles, axis] = mean[rattles]
    return mean_restored(place, move, mean_drop(cycle, position, law, h))


def upper_fence(length: FloatArray) -> float:
    """Tukey's upper fence of the logarithms of ``length`` (n,), at most the longest one."""
    positive = length[length > 0]
    if not len(positive):
        return 0.0
    low, high = np.quantile(np.log(positive), (0.25, 0.75))
    return float(min(np.exp(high + FENCE * (high - low)), positive.max()))


MOVE = Move("robust", displacement)
