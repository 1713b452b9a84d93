"""Irregular stones: random convex polygons and polyhedra inscribed in ellipses and ellipsoids."""

import numpy as np
from numpy.random import Generator

from rigid_lcp.shapes.polygon import Polygon
from rigid_lcp.shapes.polyhedron import Polyhedron

SLENDER = 0.6
"""Smallest width over length of a stone, before corners are cut."""


def draw_stone(random: Generator, diameter: float, corners: int, dim: int) -> Polygon | Polyhedron:
    """A stone of ``corners`` vertices with the long axis ``diameter`` [m], in 2D or 3D."""
    return (draw_polygon if dim == 2 else draw_polyhedron)(random, diameter, corners)


def draw_polygon(random: Generator, diameter: float, corners: int) -> Polygon:
    """A convex polygon of ``corners`` vertices, inscribed in an ellipse.

    ``diameter`` [m]: the ellipse's long axis; its short one is `SLENDER` to 1 times that.  The
    vertices keep at least a quarter of the mean angle apart, so that no side is a sliver.
    """
    share = random.dirichlet(np.ones(corners)) * 0.75 + 0.25 / corners
    angle = 2 * np.pi * (np.cumsum(share) + random.random())
    x, y = np.cos(angle), random.uniform(SLENDER, 1.0) * np.sin(angle)
    return Polygon(0.5 * diameter * np.column_stack([x, y]))


def draw_polyhedron(random: Generator, diameter: float, corners: int) -> Polyhedron:
    """A convex polyhedron of ``corners`` vertices on an ellipsoid of long axis ``diameter`` [m].

    Directions are spread by a few steps of mutual repulsion, so that no face is a sliver.
    """
    points = random.normal(size=(corners, 3))
    for _ in range(20):
        points /= np.linalg.norm(points, axis=1)[:, None]
        apart = points[:, None] - points
        distance = np.linalg.norm(apart, axis=2) + np.eye(corners)
        points = points + 0.2 / corners * (apart / distance[..., None] ** 3).sum(axis=1)
    points /= np.linalg.norm(points, axis=1)[:, None]
    axes = np.array([1.0, *random.uniform(SLENDER, 1.0, size=2)])
    return Polyhedron(0.5 * diameter * points * axes)


SHAPE = draw_stone
