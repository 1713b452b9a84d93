"""The mean profile moves, settlement by height and spread from the axis; grains go along."""

from __future__ import annotations

import numpy as np

from adapters.container import Container
from adapters.jump_field import jump_arguments_check, mean_drop, mean_restored
from adapters.laws.law import Law
from adapters.moves.move import Move, block_moves, grain_weights, law_moves
from adapters.state import FloatArray

GRAINS_PER_LAYER = 60
"""At least so many between two knots of the profile: their mean has an eighth of the scatter."""
LAYERS_MOST = 4
"""No more knots than a profile has features: bedding below, bulk, loose top."""


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
    (`moves.move.grain_weights`).  Every grain keeps its place in the profile: fluctuations are
    frozen.  The mean vertical move is that of the law of the mean path.  In a box the axis is
    the middle, or the mirror.

    Arguments and errors as `moves.move.Displacement`.  Do not use it under a piston that covers a
    part of the section: what it presses down, the profile spreads over all of it.
    """
    jump_arguments_check(position, radius, h)
    place, own = position[-1], law_moves(cycle, position, law, h)
    weight = grain_weights(block_moves(cycle, position, law, h))
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
    return mean_restored(place, move, mean_drop(cycle, position, law, h))


def axis_of(container: Container) -> FloatArray:
    """Where the bed spreads from, (x, y) [m]: mirrors and a cylinder's axis, else mid-box."""
    if container.shape != "box":
        return np.zeros(2)
    half = np.array([container.size_x, container.size_y]) / 2
    return np.where([axis in container.symmetry for axis in "xy"], 0.0, half)


MOVE = Move("profile", displacement)
