"""Grading curves: which share of the mass passes which sieve, and sizes drawn from a curve."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from qdem_fem.files import Floats, MeshError


@dataclass(frozen=True, eq=False)
class Grading:
    """Mass share that passes each sieve; between two sieves even in the logarithm of size.

    Raises `MeshError` for sieves that do not grow, or shares that do not grow from 0 to 1.
    """

    sieves: Floats
    """Sides of the square holes [m], (k,), growing."""
    passing: Floats
    """Share of the mass that passes [-], (k,), from 0 to 1."""

    def __post_init__(self) -> None:
        for name in ("sieves", "passing"):
            object.__setattr__(self, name, np.array(getattr(self, name), float))
        d, p = self.sieves, self.passing
        sound = d.ndim == 1 and d.shape == p.shape and len(d) >= 2
        sound = sound and bool(np.isfinite(d).all() and d[0] > 0 and (np.diff(d) > 0).all())
        if not (sound and p[0] == 0 and p[-1] == 1 and (np.diff(p) >= 0).all()):
            raise MeshError(
                f"sieves {d.tolist()} with passing {p.tolist()} are no grading curve",
                where="grading",
                remedy="give growing sieves in metres and as many shares, growing from 0 to 1",
            )


BALLAST = Grading(
    np.array([0.0224, 0.0315, 0.040, 0.050, 0.063]), np.array([0.0, 0.13, 0.475, 0.845, 1.0])
)
"""Midway between the limits of EN 13450:2013, Table 1, railway ballast 31.5/50, category A, with
nothing below 22.4 mm: 71.5 % from 31.5 to 50.  Not compared with a printed copy of the standard."""


def draw_sizes(grading: Grading, count: int, generator: np.random.Generator) -> Floats:
    """Sieve sizes [m], (count,), of grains of like shape whose masses follow the curve.

    Even in ln D by mass is D^-4 dD by number, as the mass of a grain goes with D^3.  One size is
    drawn from each of ``count`` slices of equal number, then they are shuffled: the curve is met
    as well as that many grains can.
    """
    low, high = grading.sieves[:-1], grading.sieves[1:]
    mass = np.diff(grading.passing) / np.log(high / low)
    number = np.concatenate([[0.0], np.cumsum(mass * (low**-3.0 - high**-3.0) / 3)])
    share = (np.arange(count) + generator.random(count)) / count * number[-1]
    at = np.clip(np.searchsorted(number, share, side="right") - 1, 0, len(low) - 1)
    rest = share - number[at]
    # mass, not number, is what an empty interval lacks: it is never drawn from
    inverse = low[at] ** -3.0 - 3 * rest / np.where(mass[at] > 0, mass[at], 1.0)
    sizes = np.clip(inverse ** (-1 / 3), low[at], high[at])
    return np.asarray(generator.permutation(sizes))
