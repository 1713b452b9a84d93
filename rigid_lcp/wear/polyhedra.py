"""A convex polyhedron worn at its edges and corners: plane cuts that take given volumes.

Each edge or corner that rubs is cut by planes of one direction, the mean of the normals of the
faces that meet there; so chamfers grow parallel to themselves, and shapes only shrink.  The
volume beyond a plane is the integral of the cross-section, a quadratic between two corners: the
depth of a cut is the root of a cubic.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from rigid_lcp.contact import MOST_EDGES
from rigid_lcp.errors import ShapeError
from rigid_lcp.shapes import Polyhedron, cut_points

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

LEAST_CORNER_CUT = 1e-5
"""Cuts less deep than this share of a grain's reach wait: corners within 1e-6 of it are one."""
NEAR_PLANE = 2e-6
"""Corners within this share of the reach of a plane lie in it."""
MOST_AT_ONCE = 0.5
"""Share of a grain's volume that one cut may take."""


@dataclass(frozen=True)
class WornPolyhedron:
    """A polyhedron, and the planes that wear cuts it by; all in its body frame."""

    shape: Polyhedron
    normal: Floats
    """Outward directions of the planes (k, 3), unit."""
    lost: Floats
    """Volume cut off by each so far (k,) [m^3]."""
    pending: Floats
    """Volume worn there and not yet cut off (k,) [m^3]; within round-off of zero it may be less."""


def unworn(shape: Polyhedron) -> WornPolyhedron:
    """The polyhedron as it is, nothing lost."""
    return WornPolyhedron(shape, np.zeros((0, 3)), np.zeros(0), np.zeros(0))


def place_plane(grain: WornPolyhedron, corners: Ints) -> int | None:
    """The plane that wear of a corner (one number) or an edge (two) deepens, None for a new one.

    A chamfer wears on at all its edges and corners; a plane that has not cut yet only where it is.
    """
    height = grain.shape.vertices @ grain.normal.T
    on = height >= height.max(axis=0, initial=-np.inf) - NEAR_PLANE * grain.shape.reach
    mine = on[corners].all(axis=0) & ((grain.lost > 0) | (on.sum(axis=0) == len(corners)))
    return int(np.argmax(mine)) if mine.any() else None


def rub_edges(grain: WornPolyhedron, corners: Ints, volume: float) -> WornPolyhedron:
    """The grain with ``volume`` [m^3] more pending at a corner (one number) or an edge (two)."""
    known = place_plane(grain, corners)
    if known is not None:
        pending = grain.pending.copy()
        pending[known] += volume
        return replace(grain, pending=pending)
    wanted = set(corners.tolist())
    faces = [k for k, loop in enumerate(grain.shape.faces) if wanted <= set(loop.tolist())]
    normal = grain.shape.normals[faces].sum(axis=0)
    normal /= np.linalg.norm(normal)
    return replace(
        grain, normal=np.vstack([grain.normal, normal]), lost=np.append(grain.lost, 0.0),
        pending=np.append(grain.pending, volume),
    )  # fmt: skip


def wear_polyhedron(grain: WornPolyhedron) -> tuple[WornPolyhedron, Floats] | None:
    """The grain with all pending wear cut off that is deep enough, and the way (3,) [m] that its
    centre of mass took in the body frame; None where nothing is.

    Raises `ShapeError` where more than `MOST_AT_ONCE` of the grain would go in one cut.
    """
    shape, shift = grain.shape, np.zeros(3)
    lost, pending = grain.lost.copy(), grain.pending.copy()
    for k in np.argsort(-pending, kind="stable"):
        made = None if pending[k] <= 0 else cut_shape(shape, grain.normal[k], float(pending[k]))
        if made is None:
            continue
        gone = shape.volume - made.volume
        lost[k], pending[k] = lost[k] + gone, pending[k] - gone
        shape, shift = made, shift + made.centroid
    if shape is grain.shape:
        return None
    return WornPolyhedron(shape, grain.normal, lost, pending), shift


def cut_shape(shape: Polyhedron, normal: Floats, volume: float) -> Polyhedron | None:
    """The polyhedron without ``volume`` [m^3] on the outer side of a plane with ``normal``.

    None where the cut is too shallow, or would leave corners too near to one another
    or more edges than detection has names for: then it waits.  Its ``centroid`` is where
    the centre of mass lies in the frame of ``shape``.
    """
    if volume > MOST_AT_ONCE * shape.volume:
        raise ShapeError(
            f"{volume:.3g} m^3 wore off a grain of {shape.volume:.3g} m^3 between two cuts",
            where="wear", remedy="cut more often (every), or take a smaller coefficient",
        )  # fmt: skip
    depth = cut_depth(shape, normal, volume)
    if depth < LEAST_CORNER_CUT * shape.reach:
        return None
    height = shape.vertices @ normal
    try:
        rough = Polyhedron(cut_points(shape, height - height.max() + depth))
        made = Polyhedron.of_corners(rough.vertices)
        made.centroid = rough.centroid
        return made if len(made.edges) + 2 <= MOST_EDGES else None
    except ShapeError:
        return None


def cut_depth(shape: Polyhedron, normal: Floats, volume: float) -> float:
    """Depth t [m] to which a plane with ``normal`` takes ``volume`` [m^3] off the top."""
    height = shape.vertices @ normal
    depths = np.unique(height.max() - height)
    taken = 0.0
    for above, below in pairwise(depths):
        if below - above < 1e-13 * shape.reach:
            continue
        places = above + (below - above) * np.array([0.25, 0.5, 0.75])
        areas = [section_area(shape, normal, height - height.max() + t) for t in places]
        # A(s) on s in [0, 1] through three places, and its integral
        area = np.polynomial.Polynomial.fit(
            [0.25, 0.5, 0.75], areas, 2, domain=[0, 1], window=[0, 1]
        )
        inside = area.integ() * float(below - above)
        if taken + float(inside(1.0)) >= volume:
            return float(above + (below - above) * _root(inside, volume - taken))
        taken += float(inside(1.0))
    return float(depths[-1])


def _root(rising: np.polynomial.Polynomial, value: float) -> float:
    """Where in [0, 1] a rising polynomial has a value: bisection to the last digit."""
    low, high = 0.0, 1.0
    while high - low > 1e-16 * high:
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        low, high = (middle, high) if float(rising(middle)) < value else (low, middle)
    return high


def section_area(shape: Polyhedron, normal: Floats, height: Floats) -> float:
    """Area [m^2] of the section where ``height`` (v,), linear in place, is zero at no corner."""
    first, second = shape.edges[:, 0], shape.edges[:, 1]
    through = height[first] * height[second] < 0
    first, second = first[through], second[through]
    share = (height[first] / (height[first] - height[second]))[:, None]
    points = (1 - share) * shape.vertices[first] + share * shape.vertices[second]
    arm = points - points.mean(axis=0)
    along = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    along /= np.linalg.norm(along)
    x, y = arm @ along, arm @ np.cross(normal, along)
    order = np.argsort(np.arctan2(y, x))
    x, y = x[order], y[order]
    return 0.5 * float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum())
