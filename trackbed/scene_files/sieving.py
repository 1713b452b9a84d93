"""Sizes of stones: the smallest square hole that each passes."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.spatial.transform import Rotation

from trackbed.scene_files.grading import Floats


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
