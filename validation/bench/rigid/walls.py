"""Towers and walls of bricks for the examination: contacts at the corners of every joint.

Rows are laid in running bond, each brick across two of the row below; a tower is a wall one brick
wide.  2 (plane) or 4 (space) contacts a joint, so that the rank of W is far below its size.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from rigid_lcp.friction.problem.definition import BODY_SIZE, BodySpace
from validation.bench.rigid.packings import build_jacobian

Floats = NDArray[np.float64]
MASSES = ("equal", "random", "top", "one")
"""All 1 kg; each between 1 and the ratio; the last laid heavy; one of them."""


def build_wall(
    rows: int, columns: int, dim: int, mass: Floats, *, length: float = 2.0, joined: bool = False
) -> BodySpace:
    """Bricks of ``length`` x 1 (x 1) m on a floor, row after row from below.

    ``mass`` (`count_bricks`,) [kg].  ``joined``: neighbours in a row touch as well.
    """
    laid = [_lay_row(k, columns, length) for k in range(rows)]
    centre = np.array([(x, 0.0, k + 0.5) for k, row in enumerate(laid) for x in row])
    first = np.cumsum([0, *(len(row) for row in laid)])
    pairs: list[tuple[int, int]] = []
    points: list[tuple[float, float, float]] = []
    upright: list[bool] = []
    depths = (0.0,) if dim == 2 else (0.5, -0.5)

    def touch(a: int, b: int, ends: list[tuple[float, float]], vertical: bool) -> None:
        for x, z in ends:
            for y in depths:
                pairs.append((a, b))
                points.append((x, y, z))
                upright.append(vertical)

    for k, row in enumerate(laid):
        for i, x in enumerate(row):
            below = (
                [(-1, x)] if k == 0 else [(first[k - 1] + j, b) for j, b in enumerate(laid[k - 1])]
            )
            for other, across in below:
                left, right = max(x, across) - length / 2, min(x, across) + length / 2
                if right > left:
                    touch(first[k] + i, other, [(left, float(k)), (right, float(k))], True)
        if joined:
            for i, (x, _) in enumerate(pairwise(row)):
                side = x + length / 2
                ends = [(side, float(k)), (side, float(k + 1))]
                touch(first[k] + i + 1, first[k] + i, ends, False)
    pair, point = np.array(pairs), np.array(points)
    frames = np.where(
        np.array(upright)[:, None, None],
        np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])[:dim],
        np.array([[1.0, 0, 0], [0, 0, 1], [0, 1, 0]])[:dim],
    )
    other = np.where(pair[:, 1, None] < 0, 0.0, point - centre[np.maximum(pair[:, 1], 0)])
    jacobian = build_jacobian(
        pair, frames[:, 0], point - centre[pair[:, 0]], other, len(centre), dim, frames
    )
    inertia = np.array([2.0, length**2 + 1.0, length**2 + 1.0]) / 12.0
    own = [1.0, 1.0, inertia[1]] if dim == 2 else [1.0, 1.0, 1.0, *inertia]
    inverse = 1.0 / (mass[:, None] * np.array(own)).ravel()
    return BodySpace(jacobian, sp.csr_array(sp.diags_array(inverse)), BODY_SIZE[dim])


def count_bricks(rows: int, columns: int) -> int:
    """Number of bricks."""
    return sum(len(_lay_row(k, columns, 2.0)) for k in range(rows))


def draw_masses(count: int, kind: str, ratio: float, generator: np.random.Generator) -> Floats:
    """Masses (count,) [kg] between 1 and ``ratio``, by one of `MASSES`."""
    mass = np.ones(count)
    if kind == "random":
        mass = ratio ** generator.random(count)
    elif kind == "top":
        mass[-1] = ratio
    elif kind == "one":
        mass[generator.integers(count)] = ratio
    return mass


def _lay_row(k: int, columns: int, length: float) -> Floats:
    """Middles of the bricks of row k; odd rows are half a brick in, and one brick shorter."""
    odd = k % 2 if columns > 1 else 0
    return np.asarray(length * (np.arange(columns - odd) + odd / 2), dtype=float)
