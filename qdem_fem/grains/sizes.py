"""Sizes of grains: the smallest square hole that each passes, and grading curves.

A curve says which share of the mass passes which sieve; sizes are drawn from it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.spatial.transform import Rotation

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


@dataclass(frozen=True)
class SieveNumbers:
    """Search over rotations."""

    starts: int = 3000  # rotations that are tried first [-]
    kept: int = 16  # best of them, which are refined [-]
    rounds: int = 34  # of refinement [-]
    tries: int = 12  # random turns in a round [-]
    first_turn: float = 0.3  # size of turns in the first round [rad]
    shrink: float = 0.75  # their factor from round to round [-]: 0.3 to 2e-5


SIEVE = SieveNumbers()


def find_sieve_size(nodes: Floats) -> float:
    """Side D [m] of the smallest square hole that a rigid body passes without turning.

    ``nodes`` (n, 3) [m]: all corners of its convex hull.  With w(a) = max a.x - min a.x, the width
    along a unit vector a,

        D = min over orthogonal a, b of max(w(a), w(b)),

    as a square with sides along a and b holds the body's shadow if it is as wide as both; the body
    moves along a x b.  2 r for a sphere, the edge of a cube, edge/sqrt(2) for a regular
    tetrahedron, min(b, (b + c)/sqrt(2)) for a box a >= b >= c.  A body that turns on its way may
    pass a smaller hole: D is an upper bound of that.

    The definition is that of a grain's sieving size in Math. Probl. Eng. 2021, 6659285; here the
    minimum over all rotations is searched from fixed ones, the best of them refined (`SIEVE`)
    by shrinking random turns, the same for every grain.
    """
    x = nodes - nodes.mean(axis=0)
    starts, turns = _make_rotations()
    frames = starts[np.argsort(_measure_hole(x, starts), kind="stable")[: SIEVE.kept]]
    for turn in turns:
        tries = np.einsum("kil,tlj->ktij", frames, turn)
        tries[:, 0] = frames
        width = _measure_hole(x, tries)
        best = width.argmin(axis=1)
        frames = tries[np.arange(len(frames)), best]
    return float(_measure_hole(x, frames).min())


@cache
def _make_rotations() -> tuple[Floats, Floats]:
    """Frames to start from (s, 2, 3), and turns (rounds, tries, 3, 3) that get smaller."""
    generator = np.random.default_rng(0)
    starts = Rotation.from_quat(generator.standard_normal((SIEVE.starts, 4))).as_matrix()[:, :2]
    size = SIEVE.first_turn * SIEVE.shrink ** np.arange(SIEVE.rounds)
    vectors = size[:, None, None] * generator.standard_normal((SIEVE.rounds, SIEVE.tries, 3))
    turns = Rotation.from_rotvec(vectors.reshape(-1, 3)).as_matrix().transpose(0, 2, 1)
    return starts, turns.reshape(SIEVE.rounds, SIEVE.tries, 3, 3)


def _measure_hole(x: Floats, frames: Floats) -> Floats:
    """max(w(a), w(b)) [m] of frames (..., 2, 3)."""
    along = frames @ x.T
    return np.asarray((along.max(axis=-1) - along.min(axis=-1)).max(axis=-1))
