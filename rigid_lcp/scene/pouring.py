"""Stones to be poured: random shapes on a loose grid."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigid_lcp.scene.types import Grains
from rigid_lcp.shapes import get_shape

Floats = NDArray[np.float64]

GRID_SPACING = 1.05
"""Distance of grid points over the largest diameter."""


def place_grains(grains: Grains, dim: int) -> Iterator[tuple[Any, Floats, Any]]:
    """Shape, position (dim,) [m] and angle [rad] (3D: quaternion (4,)) of every grain.

    The grid fills ``region`` row by row from below, and goes on above it.  The same seed gives the
    same grains.
    """
    random, draw = np.random.default_rng(grains.seed), get_shape(grains.shape)
    low, high = np.array(grains.region_low), np.array(grains.region_high)
    cell = GRID_SPACING * grains.size[1]
    across = np.maximum(1, np.floor((high - low)[:-1] / cell).astype(int))
    for number in range(grains.count):
        place = np.array(np.unravel_index(number % across.prod(), across), dtype=float)
        level = number // across.prod()
        position = low + cell * np.append(place + 0.5, level + 0.5)
        diameter = random.uniform(grains.size[0], grains.size[1])
        corners = int(random.integers(grains.corners[0], grains.corners[1], endpoint=True))
        stone = draw(random, diameter, corners, dim)
        if dim == 2:
            angle = random.uniform(0, 2 * np.pi)
            c, s = (
                np.cos(angle),
                np.sin(angle),
            )  # what was drawn lies in its cell, not the centroid
            yield stone, position + np.array([[c, -s], [s, c]]) @ stone.centroid, angle
        else:
            yield stone, position, random.normal(size=4)
