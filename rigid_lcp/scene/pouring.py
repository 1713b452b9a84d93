"""Irregular stones to be poured: random convex shapes on a loose grid."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from rigid_lcp.scene.types import Grains
from rigid_lcp.shapes import Polygon

Floats = NDArray[np.float64]

SPACING = 1.05
"""Distance of grid points over the largest diameter."""
SLENDER = 0.6
"""Smallest width over length of a stone, before corners are cut."""


def make_stone_2d(random: Generator, diameter: float, corners: int) -> Polygon:
    """A convex polygon of ``corners`` vertices, inscribed in an ellipse.

    ``diameter`` [m]: the ellipse's long axis; its short one is `SLENDER` to 1 times that.  The
    vertices keep at least a quarter of the mean angle apart, so that no side is a sliver.
    """
    share = random.dirichlet(np.ones(corners)) * 0.75 + 0.25 / corners
    angle = 2 * np.pi * (np.cumsum(share) + random.random())
    x, y = np.cos(angle), random.uniform(SLENDER, 1.0) * np.sin(angle)
    return Polygon(0.5 * diameter * np.column_stack([x, y]))


def place_grains(grains: Grains, dim: int) -> Iterator[tuple[Any, Floats, Any]]:
    """Shape, position (dim,) [m] and angle [rad] (3D: quaternion (4,)) of every grain.

    The grid fills ``region`` row by row from below, and goes on above it.  The same seed gives the
    same grains.
    """
    random = np.random.default_rng(grains.seed)
    low, high = np.array(grains.region_low), np.array(grains.region_high)
    cell = SPACING * grains.size[1]
    across = np.maximum(1, np.floor((high - low)[:-1] / cell).astype(int))
    for number in range(grains.count):
        place = np.array(np.unravel_index(number % across.prod(), across), dtype=float)
        level = number // across.prod()
        position = low + cell * np.append(place + 0.5, level + 0.5)
        diameter = random.uniform(grains.size[0], grains.size[1])
        corners = int(random.integers(grains.corners[0], grains.corners[1], endpoint=True))
        if dim == 2:
            stone, angle = make_stone_2d(random, diameter, corners), random.uniform(0, 2 * np.pi)
            c, s = np.cos(angle), np.sin(angle)  # the ellipse lies in its cell, not the centroid
            yield stone, position + np.array([[c, -s], [s, c]]) @ stone.centroid, angle
        else:
            yield make_stone_3d(random, diameter, corners), position, random.normal(size=4)


def make_stone_3d(random: Generator, diameter: float, corners: int) -> Any:
    """A convex polyhedron of ``corners`` vertices on an ellipsoid of long axis ``diameter`` [m].

    Directions are spread by a few steps of mutual repulsion, so that no face is a sliver.
    """
    from rigid_lcp.shapes import Polyhedron

    points = random.normal(size=(corners, 3))
    for _ in range(20):
        points /= np.linalg.norm(points, axis=1)[:, None]
        apart = points[:, None] - points
        distance = np.linalg.norm(apart, axis=2) + np.eye(corners)
        points = points + 0.2 / corners * (apart / distance[..., None] ** 3).sum(axis=1)
    points /= np.linalg.norm(points, axis=1)[:, None]
    axes = np.array([1.0, *random.uniform(SLENDER, 1.0, size=2)])
    return Polyhedron(0.5 * diameter * points * axes)
