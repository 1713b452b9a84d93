"""Convex grains in space: random ballast stones, and grains cut in two by a plane."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigid_lcp.errors import SceneError, ShapeError
from rigid_lcp.shapes.numbers import require_vector
from rigid_lcp.shapes.polyhedron import Polyhedron
from rigid_lcp.shapes.rotations import rotate, rotate_back

Floats = NDArray[np.float64]

CLEARANCE = 1e-6
"""Share of its reach by which a cut must miss the corners of a grain, or go through them."""

UNIT = 1e-6
"""Error of a quaternion's squared length that a run may have left."""


def ballast_stone(
    generator: np.random.Generator, size: float, corners: int = 16,
    flatness: float = 0.75, elongation: float = 1.3,
) -> Polyhedron:  # fmt: skip
    """A random convex stone that passes a square sieve of about ``size`` [m].

    The hull of ``corners`` points on an ellipsoid with half axes ``size / 2`` times
    ``elongation``, 1 and ``flatness`` (longest to middle, thinnest to middle axis: the two ratios
    of Zingg's diagram).  The points keep apart: each is the farthest of ten random ones from
    those before it (Mitchell's best candidate), so edges stay sharp and faces of like size.
    Raises `ShapeError` for fewer than four corners or a size that is not positive.
    """
    axes = 0.5 * size * np.array([elongation, 1.0, flatness])
    if corners < 4 or not (np.isfinite(axes).all() and (axes > 0).all()):
        raise ShapeError(
            f"size {size!r}, corners {corners!r}, ratios {flatness!r} and {elongation!r} make no "
            "stone", where="ballast_stone", remedy="give positive numbers and at least 4 corners",
        )  # fmt: skip
    chosen = np.empty((0, 3))
    while len(chosen) < corners:
        tries = generator.normal(size=(10, 3))
        tries /= np.linalg.norm(tries, axis=1)[:, None]
        nearest = -(tries @ chosen.T).max(axis=1, initial=-1.0)
        chosen = np.vstack([chosen, tries[np.argmax(nearest)]])
    return Polyhedron(chosen * axes)


def cut(shape: Polyhedron, normal: ArrayLike, offset: float) -> tuple[Polyhedron, Polyhedron]:
    """The parts of a polyhedron beyond and before the plane ``normal . x = offset``.

    Plane and parts in the body frame of ``shape``: ``part.centroid`` is where the centre of mass
    of the part lies in it.  The volumes add up to that of the whole.  Raises `ShapeError` where
    the plane misses the polyhedron or only grazes it, `SceneError` for numbers that are none.
    """
    direction = require_vector(normal, 3, "the normal", "cut")
    (offset,) = require_vector(offset, 1, "the offset", "cut")
    length = float(np.linalg.norm(direction))
    if not 0.0 < length < np.inf:
        raise ShapeError(
            f"the normal of the plane is {normal!r}", where="cut",
            remedy="give three numbers that are not all zero",
        )  # fmt: skip
    height = (shape.vertices @ direction - offset) / length
    slack = CLEARANCE * shape.reach
    if height.max() <= slack or height.min() >= -slack:
        raise ShapeError(
            f"the plane does not cut the polyhedron: its corners lie {height.min():.3g} to "
            f"{height.max():.3g} m from the plane", where="cut",
            remedy=f"move the plane along its normal, by {-offset / length:.3g} m to go through"
            " the centre of mass",
        )  # fmt: skip
    beyond = Polyhedron(cut_points(shape, -height))
    before = Polyhedron(cut_points(shape, height))
    return beyond, before


def cut_points(shape: Polyhedron, height: Floats) -> Floats:
    """Corners (n, 3) of the part of a polyhedron where ``height`` (v,) over a plane is negative.

    Corners nearly in the plane go to both parts as they are: slivers would have no faces.
    """
    on = np.abs(height) <= CLEARANCE * shape.reach
    first, second = shape.edges[:, 0], shape.edges[:, 1]
    through = ~on[first] & ~on[second] & (height[first] * height[second] < 0)
    first, second = first[through], second[through]
    share = (height[first] / (height[first] - height[second]))[:, None]
    crossing = (1 - share) * shape.vertices[first] + share * shape.vertices[second]
    return np.vstack([shape.vertices[~on & (height < 0)], shape.vertices[on], crossing])


@dataclass(frozen=True)
class Fragment:
    """A part of a body with the state that it has at the moment of the break."""

    shape: Polyhedron
    position: Floats
    """Centre of mass [m], (3,)."""
    quaternion: Floats
    """Orientation: that of the whole, (4,)."""
    velocity: Floats
    """Velocity of the centre of mass [m/s], (3,)."""
    spin: Floats
    """Spin in the world frame [rad/s]: that of the whole, (3,)."""


def fragments(
    shape: Polyhedron, position: ArrayLike, quaternion: ArrayLike, velocity: ArrayLike,
    spin: ArrayLike, normal: ArrayLike, point: ArrayLike,
) -> tuple[Fragment, Fragment]:  # fmt: skip
    """A moving polyhedron broken by the plane through ``point`` [m] with ``normal``, both world.

    Every point of the parts keeps place and velocity: mass, momentum, angular momentum and
    energy are those of the whole.  Raises as `cut` does, and `SceneError` for a quaternion that
    is not of unit length.
    """
    where = "fragments"
    position, velocity, spin, normal, point = (
        require_vector(given, 3, f"the {what}", where)
        for what, given in (
            ("position", position), ("velocity", velocity), ("spin", spin), ("normal", normal),
            ("point", point),
        )
    )  # fmt: skip
    quaternion = require_vector(quaternion, 4, "the quaternion", where)
    if not abs(quaternion @ quaternion - 1.0) < UNIT:
        raise SceneError(
            f"the quaternion is {quaternion.tolist()}, not of unit length", where=where,
            remedy="divide it by its length",
        )  # fmt: skip
    direction = rotate_back(quaternion, normal)
    offset = float(direction @ rotate_back(quaternion, point - position))
    made = []
    for part in cut(shape, direction, offset):
        arm = rotate(quaternion, part.centroid)
        made.append(
            Fragment(part, position + arm, quaternion, velocity + np.cross(spin, arm), spin)
        )
    return made[0], made[1]
