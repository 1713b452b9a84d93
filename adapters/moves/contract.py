"""What a way to move grains in a jump is, and what several of them ask of a window of cycles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from adapters.bed import Container, FloatArray
from adapters.errors import UsageError
from adapters.laws.form import Law


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
    """A way to move grains in a jump; a file with an object ``MOVE`` is one."""

    name: str
    """The name in scenes: that of the file, dashes for its underscores."""
    displacement: Displacement
    moves_piston: bool = True
    """False leaves the piston where it is, beside grains that stay where they are."""
    tames_loose: bool = True
    """False throws a loose grain as far as its own law says, as the paper's estimate does."""


def extrapolate_grains(cycle: FloatArray, position: FloatArray, law: Law, h: float) -> FloatArray:
    """Each grain's own extrapolated move u(N + h) - u(N) [m], shape (n, 3): eqs 16 to 21.

    Arguments and errors as `Displacement`.
    """
    rows = slice(law.first_state, None)
    start = float(cycle[-1])
    path = position[rows] - position[0]
    return np.asarray(law.increment(law.fit(cycle[rows], path), start, start + h))


def extrapolate_mean(cycle: FloatArray, position: FloatArray, law: Law, h: float) -> float:
    """Mean vertical move [m] over ``h`` cycles by the law of the mean path; see `Displacement`."""
    rows = slice(law.first_state, None)
    path = (position[rows, :, 2] - position[0, :, 2]).mean(axis=1)
    start = float(cycle[-1])
    return float(law.increment(law.fit(cycle[rows], path), start, start + h))


def height_share(place: FloatArray) -> FloatArray:
    """Vertical move of each grain under a uniform strain of mean move 1, shape (n,).

    Heights above the lowest grain of ``place`` (n, 3) [m] over their mean; 1 in a flat layer.
    """
    height = place[:, 2] - place[:, 2].min()
    return np.asarray(height / height.mean() if height.any() else np.ones_like(height))


def restore_mean(place: FloatArray, move: FloatArray, drop: float) -> FloatArray:
    """``move`` (n, 3) [m] with the uniform vertical strain that makes its mean height ``drop``."""
    move = move.copy()
    move[:, 2] += (drop - move[:, 2].mean()) * height_share(place)
    return move


def check_jump_arguments(position: FloatArray, radius: FloatArray, h: float) -> None:
    """Raise `UsageError` unless these are the states (k+1, n, 3) of n grains and a jump h >= 0."""
    if position.ndim != 3 or position.shape[2] != 3 or np.shape(radius) != position.shape[1:2]:
        raise UsageError(
            f"positions of shape {position.shape} and radii of shape {np.shape(radius)} are not "
            "those of states of the same grains"
        )
    if not position.shape[1]:
        raise UsageError("there are no grains to move")
    if not (np.isfinite(h) and h >= 0):
        raise UsageError(f"a jump of {h:g} cycles is none", remedy="give h >= 0")
