"""The mean profile moves, settlement by height and spread from the axis; grains go along."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from adapters.bed import Container, FloatArray
from adapters.laws.form import Law
from adapters.moves.contract import (
    Move,
    check_jump_arguments,
    extrapolate_grains,
    extrapolate_mean,
    restore_mean,
)

GRAINS_PER_LAYER = 60
"""At least so many between two knots of the profile: their mean has an eighth of the scatter."""
LAYERS_MOST = 4
"""No more knots than a profile has features: bedding below, bulk, loose top."""
BLOCKS_MOST = 4
"""Parts of a window from which the scatter of a grain's move is taken, at most."""


def displacement(
    cycle: FloatArray,
    position: FloatArray,
    radius: FloatArray,
    law: Law,
    h: float,
    container: Container,
) -> FloatArray:
    """u_z(z), piecewise linear and 0 on the floor, and u_r = c r from the axis [m], shape (n, 3).

    Both fitted to the moves of all grains' own laws, loose ones counting little
    (`weigh_grains`).  Every grain keeps its place in the profile: fluctuations are
    frozen.  The mean vertical move is that of the law of the mean path.  In a box the axis is
    the middle, or the mirror.

    Arguments and errors as `moves.move.Displacement`.  Do not use it under a piston that covers a
    part of the section: what it presses down, the profile spreads over all of it.
    """
    check_jump_arguments(position, radius, h)
    place, own = position[-1], extrapolate_grains(cycle, position, law, h)
    weight = weigh_grains(extrapolate_blocks(cycle, position, law, h))
    root = np.sqrt(weight)
    move = np.empty_like(own)
    layers = int(np.clip(len(place) // GRAINS_PER_LAYER, 1, LAYERS_MOST))
    knots = np.concatenate([[0.0], np.quantile(place[:, 2], np.arange(1, layers + 1) / layers)])
    hats = np.column_stack([np.interp(place[:, 2], knots, row) for row in np.eye(layers + 1)[1:]])
    found = np.linalg.lstsq(root[:, None] * hats, root * own[:, 2], rcond=None)[0]
    move[:, 2] = hats @ found
    outward = place[:, :2] - axis_of(container)
    square = float(weight @ (outward**2).sum(axis=1))
    spread = float(weight @ (outward * own[:, :2]).sum(axis=1)) / square if square else 0.0
    move[:, :2] = spread * outward
    return restore_mean(place, move, extrapolate_mean(cycle, position, law, h))


def axis_of(container: Container) -> FloatArray:
    """Where the bed spreads from, (x, y) [m]: mirrors and a cylinder's axis, else mid-box."""
    if container.shape != "box":
        return np.zeros(2)
    half = np.array([container.size_x, container.size_y]) / 2
    return np.where([axis in container.symmetry for axis in "xy"], 0.0, half)


def extrapolate_blocks(cycle: FloatArray, position: FloatArray, law: Law, h: float) -> FloatArray:
    """The same jump as each of ``b`` equal parts of the window predicts it [m], shape (b, n, 3).

    Parts share the states between them.  ``b`` is `BLOCKS_MOST`, less where a part would be shorter
    than the law wants it; 0 where not even two parts are long enough.
    """
    first, start = law.first_state, float(cycle[-1])
    spans = len(cycle) - 1 - first
    blocks = min(BLOCKS_MOST, spans // max(law.minimum_cycles - 1, 1))
    if blocks < 2:
        return np.empty((0, *position.shape[1:]))
    ends = first + np.linspace(0, spans, blocks + 1).round().astype(int)
    parts = [slice(a, b + 1) for a, b in pairwise(ends)]
    return np.stack(
        [
            law.increment(law.fit(cycle[part], position[part] - position[0]), start, start + h)
            for part in parts
        ]
    )


def within_variance(moves: FloatArray) -> FloatArray:
    """Variance s_i^2 of the mean of a grain's ``moves`` [m^2] per axis, shape (n,).

    ``moves`` [m], shape (b, n, 3), b >= 2: what the parts of a window say.  The scatter between
    them, over their number: parts so long that they are nearly independent.
    """
    blocks = len(moves)
    scatter = ((moves - moves.mean(axis=0)) ** 2).sum(axis=(0, 2))
    return np.asarray(scatter / (3 * (blocks - 1) * blocks))


def weigh_grains(moves: FloatArray) -> FloatArray:
    """Weights 1 / (s_i^2 + median s^2) of the grains in a mean over grains, shape (n,), mean 1.

    From ``moves`` of shape (b, n, 3) [m].  A loose grain, whose parts of the window disagree,
    counts little; none counts more than twice the median one.  All alike without two parts.
    """
    n = moves.shape[1]
    if len(moves) < 2:
        return np.ones(n)
    variance = within_variance(moves)
    middle = float(np.median(variance))
    if middle == 0:
        middle = float(variance.mean())
    weight = 1 / (variance + middle) if middle > 0 else np.ones(n)
    return np.asarray(weight / weight.mean())


MOVE = Move("profile", displacement)
