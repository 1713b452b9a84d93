"""What a way to move grains in a jump is, and what several of them ask of a window."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import numpy as np

from adapters.container import Container
from adapters.laws.law import Law
from adapters.state import FloatArray

BLOCKS_MOST = 4
"""Parts of a window from which the scatter of a grain's move is taken, at most."""


class Displacement(Protocol):
    """Displacement of every grain over a jump [m], shape (n, 3)."""

    def __call__(
        self,
        cycle: FloatArray,
        position: FloatArray,
        radius: FloatArray,
        law: Law,
        h: float,
        container: Container,
    ) -> FloatArray:
        """Displacement of every grain over ``h`` jumped cycles [m], shape (n, 3).

        ``cycle``, shape (k+1,), and ``position`` [m], shape (k+1, n, 3): the ends of the window's
        cycles, the first row the state before it, healing cycles left out.  ``radius`` [m], (n,).
        Raises `UsageError` for arguments out of range and positions that are not finite.
        """


@dataclass(frozen=True)
class Move:
    """A way to move grains in a jump; a file ``move_NAME.py`` with an object ``MOVE`` is one."""

    name: str
    """The name in scenes: that of the file, dashes for its underscores."""
    displacement: Displacement
    moves_piston: bool = True
    """False leaves the piston where it is, beside grains that stay where they are."""


def law_moves(cycle: FloatArray, position: FloatArray, law: Law, h: float) -> FloatArray:
    """Each grain's own extrapolated move u(N + h) - u(N) [m], shape (n, 3): eqs 16 to 21.

    Arguments and errors as `Displacement`.
    """
    rows = slice(law.first_state, None)
    start = float(cycle[-1])
    path = position[rows] - position[0]
    return np.asarray(law.increment(law.fit(cycle[rows], path), start, start + h))


def block_moves(cycle: FloatArray, position: FloatArray, law: Law, h: float) -> FloatArray:
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
    them, over their number: parts so long that they hardly depend on one another.
    """
    blocks = len(moves)
    scatter = ((moves - moves.mean(axis=0)) ** 2).sum(axis=(0, 2))
    return np.asarray(scatter / (3 * (blocks - 1) * blocks))


def grain_weights(moves: FloatArray) -> FloatArray:
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
