"""What a way to move grains in a jump is, and what several of them ask of a window of cycles."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from adapters.bed import Container, FloatArray
from adapters.laws.form import Law


@dataclass(frozen=True, eq=False)
class Jump:
    """A window of computed cycles, and the jump behind it."""

    cycle: FloatArray
    """Cycles done at the window's cycle ends, the first the state before it, healing cycles left
    out, shape (k+1,)."""
    position: FloatArray  # centres then [m], shape (k+1, n, 3)
    radius: FloatArray  # radii [m], shape (n,)
    law: Law
    h: float  # cycles to jump
    container: Container

    @property
    def place(self) -> FloatArray:
        """Centres before the jump [m], shape (n, 3)."""
        return self.position[-1]

    def extrapolate_grains(self) -> FloatArray:
        """Each grain's own extrapolated move u(N + h) - u(N) [m], shape (n, 3): eqs 16 to 21.

        Raises `UsageError` for positions that are not finite.
        """
        return self._extrapolate(self.position - self.position[0])

    def extrapolate_mean(self) -> float:
        """Mean vertical move [m], by the law of the mean path."""
        height = self.position[:, :, 2]
        return float(self._extrapolate((height - height[0]).mean(axis=1)))

    def _extrapolate(self, path: FloatArray) -> FloatArray:
        rows, start = slice(self.law.first_state, None), float(self.cycle[-1])
        parameters = self.law.fit(self.cycle[rows], path[rows])
        return np.asarray(self.law.increment(parameters, start, start + self.h))


@dataclass(frozen=True)
class Move:
    """A way to move grains in a jump; a file with an object ``MOVE`` is one."""

    name: str  # the name in scenes: that of the file, dashes for its underscores
    displacement: Callable[[Jump], FloatArray]
    """Displacement of every grain over the jump [m], shape (n, 3)."""
    moves_piston: bool = True
    """False leaves the piston where it is, beside grains that stay where they are."""
    tames_loose: bool = True
    """False throws a loose grain as far as its own law says, as the paper's estimate does."""


def restore_mean(place: FloatArray, move: FloatArray, drop: float) -> FloatArray:
    """``move`` (n, 3) [m] with the uniform vertical strain that makes its mean height ``drop``.

    Zero at the lowest grain of ``place`` (n, 3) [m]; a shift in a flat layer.
    """
    height = place[:, 2] - place[:, 2].min()
    share = height / height.mean() if height.any() else np.ones_like(height)
    move = move.copy()
    move[:, 2] += (drop - move[:, 2].mean()) * share
    return move
