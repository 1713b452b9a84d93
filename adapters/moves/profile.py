"""The mean profile moves, settlement by height and spread from the axis; grains go along."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from adapters.bed import Container, FloatArray
from adapters.moves.contract import Jump, Move, restore_mean


@dataclass(frozen=True)
class ProfileNumbers:
    """Knots of the profile, and parts of the window."""

    grains_per_layer: int = 60  # between two knots at least: the mean has an eighth of the scatter
    layers_most: int = 4  # knots, as many as features: bedding below, bulk, loose top
    blocks_most: int = 4  # parts of a window from which the scatter of a grain's move is taken


PROFILE = ProfileNumbers()


def find_displacement(jump: Jump) -> FloatArray:
    """u_z(z), piecewise linear and 0 on the floor, and u_r = c r from the axis [m], shape (n, 3).

    Both fitted to the moves of all grains' own laws, loose ones counting little
    (`weigh_grains`).  Every grain keeps its place in the profile: fluctuations are frozen.  The
    mean vertical move is that of the law of the mean path.  In a box the axis is the middle, or the
    mirror.  Not under a piston on a part of the section: what that presses down goes everywhere.
    """
    place, own = jump.place, jump.extrapolate_grains()
    weight = weigh_grains(extrapolate_blocks(jump))
    root = np.sqrt(weight)
    move = np.empty_like(own)
    layers = int(np.clip(len(place) // PROFILE.grains_per_layer, 1, PROFILE.layers_most))
    knots = np.concatenate([[0.0], np.quantile(place[:, 2], np.arange(1, layers + 1) / layers)])
    hats = np.column_stack([np.interp(place[:, 2], knots, row) for row in np.eye(layers + 1)[1:]])
    found = np.linalg.lstsq(root[:, None] * hats, root * own[:, 2], rcond=None)[0]
    move[:, 2] = hats @ found
    outward = place[:, :2] - find_axis(jump.container)
    square = float(weight @ (outward**2).sum(axis=1))
    spread = float(weight @ (outward * own[:, :2]).sum(axis=1)) / square if square else 0.0
    move[:, :2] = spread * outward
    return restore_mean(place, move, jump.extrapolate_mean())


def find_axis(container: Container) -> FloatArray:
    """Where the bed spreads from, (x, y) [m]: mirrors and a cylinder's axis, else mid-box."""
    if container.shape != "box":
        return np.zeros(2)
    half = np.array([container.size_x, container.size_y]) / 2
    return np.where([axis in container.symmetry for axis in "xy"], 0.0, half)


def extrapolate_blocks(jump: Jump) -> FloatArray:
    """The same jump as each of ``b`` equal parts of the window predicts it [m], shape (b, n, 3).

    Parts share the states between them.  ``b`` is `PROFILE.blocks_most`, less where a part would be
    shorter than the law wants it; 0 where not even two parts are long enough.
    """
    law, path = jump.law, jump.position - jump.position[0]
    first, start = law.first_state, float(jump.cycle[-1])
    spans = len(path) - 1 - first
    blocks = min(PROFILE.blocks_most, spans // max(law.minimum_cycles - 1, 1))
    if blocks < 2:
        return np.empty((0, *path.shape[1:]))
    ends = first + np.linspace(0, spans, blocks + 1).round().astype(int)
    parts = [slice(a, b + 1) for a, b in pairwise(ends)]
    fits = [law.fit(jump.cycle[part], path[part]) for part in parts]
    return np.stack([law.increment(fit, start, start + jump.h) for fit in fits])


def weigh_grains(moves: FloatArray) -> FloatArray:
    """Weights 1 / (s_i^2 + median s^2) of the grains in a mean over grains, shape (n,), mean 1.

    ``moves`` [m], shape (b, n, 3): what the parts of a window say, so long that they are nearly
    independent; s_i^2 is the variance of their mean per axis.  A loose grain, whose parts disagree,
    counts little; none counts more than twice the median one.  All alike without two parts.
    """
    blocks, n = moves.shape[:2]
    if blocks < 2:
        return np.ones(n)
    scatter = ((moves - moves.mean(axis=0)) ** 2).sum(axis=(0, 2))
    variance = scatter / (3 * (blocks - 1) * blocks)
    middle = float(np.median(variance)) or float(variance.mean())
    weight = 1 / (variance + middle) if middle > 0 else np.ones(n)
    return np.asarray(weight / weight.mean())


MOVE = Move("profile", find_displacement)
