"""Convex polygons: grains with corners in the plane.

A shape knows its own frame only: its centroid is the origin.  Where it is, and how fast, is a
matter of the scene and of `rigid_lcp.motion.state`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import pi
from numbers import Integral
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from rigid_lcp.arrays import Floats, Ints
from rigid_lcp.errors import ShapeError
from rigid_lcp.shapes.numbers import require_finite_shape, require_length, require_size

STRAIGHT = 1e-12
"""Sine of the turn at a vertex below which three vertices count as one line [-]."""


@dataclass(frozen=True, eq=False)
class Polygon:
    """Convex polygon, given by its vertices (n, 2) in metres, anticlockwise.

    ``vertices`` are kept relative to the centroid, which is at ``centroid`` (2,) in the frame they
    were given in.  Raises `ShapeError` for fewer than three vertices, numbers that are not finite,
    clockwise or crossing outlines, corners that point inwards, repeated or collinear vertices.
    A grain that is not convex is a matter of several bodies.
    """

    vertices: Floats
    centroid: Floats

    dim = 2

    def __init__(self, vertices: ArrayLike) -> None:
        outline = check_outline(vertices)
        start = outline.mean(axis=0)
        area, first, _ = _find_moments(outline - start)
        centroid = start + first / area
        object.__setattr__(self, "vertices", outline - centroid)
        object.__setattr__(self, "centroid", centroid)

    @classmethod
    def rectangle(cls, width: float, height: float) -> Polygon:
        """Rectangle of ``width`` along x and ``height`` along y [m].  Raises `ShapeError`."""
        width = require_length(width, "width", "rectangle")
        height = require_length(height, "height", "rectangle")
        x, y = width / 2, height / 2
        return cls([(-x, -y), (x, -y), (x, y), (-x, y)])

    @classmethod
    def regular(cls, corners: int, radius: float) -> Polygon:
        """Regular polygon with ``corners`` vertices on a circle of ``radius`` [m].

        Raises `ShapeError`.
        """
        radius = require_length(radius, "radius", "polygon")
        if not isinstance(corners, Integral) or corners < 3:
            raise ShapeError(
                f"it has {corners!r} corners",
                where="polygon",
                remedy="give a whole number, 3 or more",
            )
        angle = 2 * pi * np.arange(corners) / corners
        return cls(radius * np.column_stack([np.cos(angle), np.sin(angle)]))

    @classmethod
    def from_corners(cls, vertices: ArrayLike) -> Self:
        """The polygon with the ``vertices`` (n, 2) [m] of another in its body frame.

        They are taken as they are, the round-off of their centroid and all: so a shape is made
        again from its corners to the last bit.
        """
        made = cls(vertices)
        object.__setattr__(made, "vertices", np.array(vertices, dtype=float))
        return made

    @cached_property
    def area(self) -> float:
        """Area [m^2]."""
        return _find_moments(self.vertices)[0]

    @cached_property
    def faces(self) -> Ints:
        """First and second corner of each face (n, 2); face k begins at corner k."""
        corner = np.arange(len(self.vertices))
        return np.column_stack([corner, np.roll(corner, -1)])

    @property
    def edges(self) -> Ints:
        """The faces, as those of a polyhedron have their edges."""
        return self.faces

    @cached_property
    def normals(self) -> Floats:
        """Outward unit normals (n, 2) of the faces."""
        along = np.roll(self.vertices, -1, axis=0) - self.vertices
        along /= np.linalg.norm(along, axis=1)[:, None]
        return np.column_stack([along[:, 1], -along[:, 0]])

    @cached_property
    def reach(self) -> float:
        """Distance of the farthest vertex from the centroid [m]."""
        return float(np.linalg.norm(self.vertices, axis=1).max())

    @cached_property
    def width(self) -> float:
        """Least of the distances from a face to its farthest corner [m]."""
        height = self.vertices @ self.normals.T
        return float((np.diagonal(height) - height.min(axis=0)).min())

    def mass_properties(self, density: float) -> tuple[float, float]:
        """Mass [kg] and moment of inertia about the centroid [kg m^2] at ``density`` [kg/m^2]."""
        area, _, second = _find_moments(self.vertices)
        return density * area, density * second


def check_outline(vertices: ArrayLike) -> Floats:
    """The vertices (n, 2) if they are a convex polygon, anticlockwise; else a `ShapeError`."""
    where = "polygon"
    outline = require_finite_shape(vertices, "outline", where)
    if outline.ndim != 2 or outline.shape[1] != 2 or len(outline) < 3:
        raise ShapeError(
            f"vertices have shape {outline.shape}", where=where,
            remedy="give at least three vertices of two coordinates",
        )  # fmt: skip
    size = float(np.ptp(outline, axis=0).max())
    require_size(size, where)
    side = np.roll(outline, -1, axis=0) - outline
    length = np.hypot(side[:, 0], side[:, 1])
    if (length <= STRAIGHT * length.max()).any():
        twice = int(np.argmin(length))
        raise ShapeError(
            "it is there twice", where=f"{where}, vertex {twice}", remedy="leave one of them out"
        )
    before, after = np.roll(side, 1, axis=0), side
    scale = np.roll(length, 1) * length
    turn_sine = (before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]) / scale
    turn = np.arctan2(turn_sine, (before * after).sum(axis=1) / scale)
    if np.isclose(turn.sum(), -2 * pi):
        raise ShapeError(
            "the vertices run clockwise", where=where, remedy="give them in reverse order"
        )
    if (np.abs(turn_sine) <= STRAIGHT).any():
        flat = int(np.argmin(np.abs(turn_sine)))
        raise ShapeError(
            "it lies on a line with its neighbours", where=f"{where}, vertex {flat}",
            remedy="leave it out; a polygon needs an area",
        )  # fmt: skip
    if (turn < 0).any() or not np.isclose(turn.sum(), 2 * pi):
        inward = int(np.argmin(turn))
        raise ShapeError(
            "the polygon is not convex or crosses itself", where=f"{where}, vertex {inward}",
            remedy="divide it into convex polygons, or take its convex hull",
        )  # fmt: skip
    return outline


def _find_moments(outline: Floats) -> tuple[float, Floats, float]:
    """Area [m^2], first moment (2,) [m^3] and polar second moment [m^4] about the origin.

    Green's theorem over the sides (exact).
    """
    x, y = outline.T
    x1, y1 = np.roll(outline, -1, axis=0).T
    cross = x * y1 - x1 * y
    first = np.array([((x + x1) * cross).sum(), ((y + y1) * cross).sum()]) / 6
    second = ((x * x + x * x1 + x1 * x1 + y * y + y * y1 + y1 * y1) * cross).sum() / 12
    return float(cross.sum() / 2), first, float(second)
