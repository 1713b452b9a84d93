"""A few collective modes of the window, their amplitudes extrapolated by the law."""

from __future__ import annotations

import numpy as np

from adapters.container import Container
from adapters.jump_field import jump_arguments_check, mean_drop, mean_restored
from adapters.laws.law import Law
from adapters.moves.move import Move, block_moves, grain_weights
from adapters.state import FloatArray

MODES_MOST = 6
"""Modes that are tried; the energy of a window is in fewer."""
HELD_OUT = 1 / 3
"""Last part of the window, by which the number of modes is chosen."""


def displacement(
    cycle: FloatArray,
    position: FloatArray,
    radius: FloatArray,
    law: Law,
    h: float,
    container: Container,
) -> FloatArray:
    """Sum over m modes of shape times the law's increment of its amplitude [m], shape (n, 3).

    Proper orthogonal decomposition u_i(N) = sum_j a_j(N) phi_ij of the displacements since the
    window's start, each grain weighted by w_i (`moves.move.grain_weights`), or loose grains would
    be the modes.  m, none at all included, is the number by which the first two thirds of the
    window best predict its end.  The mean vertical move is that of the law of the mean path.

    Arguments and errors as `moves.move.Displacement`.  Do not use it for windows of few cycles:
    less than twice the law's fewest are not cut for a choice, and one mode is taken.
    """
    jump_arguments_check(position, radius, h)
    weight = grain_weights(block_moves(cycle, position, law, h))
    known = round((1 - HELD_OUT) * (len(cycle) - 1)) + 1
    count = 1
    if known - law.first_state >= max(law.minimum_cycles, 2):
        early = modal_moves(cycle[:known], position[:known], law, cycle[-1], weight)
        truth = position[-1] - position[known - 1]
        missed = [
            float(weight @ ((early[:m].sum(axis=0) - truth) ** 2).sum(axis=1))
            for m in range(len(early) + 1)
        ]
        count = int(np.argmin(missed))
    modes = modal_moves(cycle, position, law, cycle[-1] + h, weight)
    return mean_restored(
        position[-1], modes[:count].sum(axis=0), mean_drop(cycle, position, law, h)
    )


def modal_moves(
    cycle: FloatArray, position: FloatArray, law: Law, end: float, weight: FloatArray
) -> FloatArray:
    """What each mode moves from the last of ``cycle`` to ``end`` [m], shape (modes, n, 3).

    Modes by falling energy, at most `MODES_MOST`; ``weight`` (n,) of the grains.
    """
    share = np.sqrt(weight)[:, None]
    data = ((position - position[0]) * share).reshape(len(cycle), -1)
    # of the small matrix of products of instants: a window has fewer of them than coordinates
    energy, instants = np.linalg.eigh(data @ data.T)
    strong = [j for j in np.argsort(-energy)[:MODES_MOST] if energy[j] > 1e-20 * energy.max()]
    amplitude = instants[:, strong] * np.sqrt(energy[strong])
    shape = (instants[:, strong] / np.sqrt(energy[strong])).T @ data
    rows = slice(law.first_state, None)
    increment = law.increment(law.fit(cycle[rows], amplitude[rows]), float(cycle[-1]), float(end))
    return (increment[:, None] * shape).reshape(len(strong), *position.shape[1:]) / share


MOVE = Move("modes", displacement)
