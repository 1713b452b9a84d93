"""Grains worn at corners and edges: cuts that take given volumes (in 2D areas) off convex shapes.

Each corner or edge that rubs is cut by planes (in 2D lines) of one direction, the mean of the
normals of the faces that meet there; so chamfers grow parallel to themselves, and shapes only
shrink.  The volume beyond a plane is the integral of the cross-section, a quadratic between two
corners: the depth of a cut is the root of a cubic.
"""

from dataclasses import dataclass, replace
from itertools import pairwise
from sys import float_info

import numpy as np
from scipy.optimize import brentq

from rigid_lcp.arrays import Floats, Ints
from rigid_lcp.contact import FEATURE_BITS, MOST_EDGES
from rigid_lcp.errors import ShapeError
from rigid_lcp.shapes import Polygon, Polyhedron

Solid = Polygon | Polyhedron


@dataclass(frozen=True)
class CutNumbers:
    """Cuts and their planes; lengths are shares of a grain's reach."""

    clearance: float = 1e-6  # of a cut, within which corners lie in it [-]
    least_depth: float = 1e-5  # less deep ones wait [-]: corners within the clearance are one
    near_plane: float = 2e-6  # within which corners lie in a plane that wears [-]
    most_at_once: float = 0.5  # share of a grain's volume that one cut may take [-]


CUTS = CutNumbers()


@dataclass(frozen=True)
class WornShape:
    """A polygon or polyhedron, and the planes that wear cuts it by; all in its body frame."""

    shape: Solid
    normal: Floats  # outward directions of the planes (k, dim), unit
    lost: Floats  # volume cut off by each so far (k,) [m^3], in 2D area [m^2]
    pending: Floats
    """Volume worn there and not yet cut off (k,); within round-off of zero it may be less."""


def make_unworn(shape: Solid) -> WornShape:
    """The shape as it is, nothing lost."""
    return WornShape(shape, np.zeros((0, shape.dim)), np.zeros(0), np.zeros(0))


def find_volume(shape: Solid) -> float:
    """Volume [m^3], in 2D area [m^2]."""
    return shape.mass_properties(1.0)[0]


def place_plane(grain: WornShape, corners: Ints) -> int | None:
    """The plane that wear of a corner (one number) or an edge (two) deepens, None for a new one.

    A chamfer wears on at all its edges and corners; a plane that has not cut yet only where it is.
    """
    height = grain.shape.vertices @ grain.normal.T
    on = height >= height.max(axis=0, initial=-np.inf) - CUTS.near_plane * grain.shape.reach
    mine = on[corners].all(axis=0) & ((grain.lost > 0) | (on.sum(axis=0) == len(corners)))
    return int(np.argmax(mine)) if mine.any() else None


def rub_corners(grain: WornShape, corners: Ints, volume: float) -> WornShape:
    """The grain with ``volume`` more pending at a corner (one number) or an edge (two)."""
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


def wear_shape(grain: WornShape) -> tuple[WornShape, Floats] | None:
    """The grain with all pending wear cut off that is deep enough, and the way (dim,) [m] that its
    centre of mass took in the body frame; None where nothing is.

    Raises `ShapeError` where more of the grain than `CUTS` allows would go in one cut.
    """
    shape, way = grain.shape, np.zeros(grain.shape.dim)
    lost, pending = grain.lost.copy(), grain.pending.copy()
    for k in np.argsort(-pending, kind="stable"):
        made = None if pending[k] <= 0 else cut_shape(shape, grain.normal[k], float(pending[k]))
        if made is None:
            continue
        gone = find_volume(shape) - find_volume(made[0])
        lost[k], pending[k] = lost[k] + gone, pending[k] - gone
        shape, way = made[0], way + made[1]
    return None if shape is grain.shape else (WornShape(shape, grain.normal, lost, pending), way)


def cut_shape(shape: Solid, normal: Floats, volume: float) -> tuple[Solid, Floats] | None:
    """The shape without ``volume`` on the outer side of a plane with ``normal``, and where its
    centre of mass lies in the frame of ``shape`` (dim,) [m].

    None where the cut is too shallow, or would leave corners too near to one another or more edges
    than detection has names for: then it waits.
    """
    whole = find_volume(shape)
    if volume > CUTS.most_at_once * whole:
        unit = "m^2" if shape.dim == 2 else "m^3"
        raise ShapeError(
            f"{volume:.3g} {unit} wore off a grain of {whole:.3g} {unit} between two cuts",
            where="wear", remedy="cut more often (every), or take a smaller coefficient",
        )  # fmt: skip
    depth = find_cut_depth(shape, normal, volume)
    if depth < CUTS.least_depth * shape.reach:
        return None
    height = shape.vertices @ normal
    try:
        return cut_part(shape, height - height.max() + depth)
    except ShapeError:
        return None


def cut_part(shape: Solid, height: Floats) -> tuple[Solid, Floats]:
    """The part of a shape where ``height`` (v,) over a plane is negative, and where its centre of
    mass lies in the frame of ``shape`` (dim,) [m].

    Raises `ShapeError` for corners that can not be kept apart, or more edges than have names.
    """
    part = type(shape)(find_part_corners(shape, height))
    made = type(shape).from_corners(part.vertices)  # as a run that goes on makes it again
    if len(made.edges) + 2 > (MOST_EDGES if shape.dim == 3 else 1 << FEATURE_BITS):
        raise ShapeError(f"it has {len(made.edges)} edges", where="cut", remedy="wear it less")
    return made, part.centroid


def find_part_corners(shape: Solid, height: Floats) -> Floats:
    """Corners (n, dim) of the part of a shape where ``height`` (v,) over a plane is negative.

    Corners nearly in the plane go to both parts as they are: slivers would have no faces.  Those
    of a polygon are in order.
    """
    on = np.abs(height) <= CUTS.clearance * shape.reach
    first, second, share = find_crossed_edges(shape, np.where(on, 0.0, height))
    crossing = (1 - share) * shape.vertices[first] + share * shape.vertices[second]
    kept = np.concatenate([np.flatnonzero(~on & (height < 0)), np.flatnonzero(on)])
    points = np.vstack([shape.vertices[kept], crossing])
    if shape.dim == 2:  # side k begins at corner k
        points = points[np.argsort(np.concatenate([kept, first + 0.5]))]
    return points


def find_crossed_edges(shape: Solid, height: Floats) -> tuple[Ints, Ints, Floats]:
    """Both corners (m,) of the edges on which ``height`` (v,) changes its sign, and at which share
    (m, 1) of their length."""
    first, second = shape.edges[:, 0], shape.edges[:, 1]
    through = height[first] * height[second] < 0
    first, second = first[through], second[through]
    return first, second, (height[first] / (height[first] - height[second]))[:, None]


def find_cut_depth(shape: Solid, normal: Floats, volume: float) -> float:
    """Depth t [m] to which a plane with ``normal`` takes ``volume`` off the top."""
    height = shape.vertices @ normal
    depths = np.unique(height.max() - height)
    taken = 0.0
    for above, below in pairwise(depths):
        if below - above < 1e-13 * shape.reach:
            continue
        places = above + (below - above) * np.array([0.25, 0.5, 0.75])
        areas = [measure_section(shape, normal, height - height.max() + t) for t in places]
        # A(s) on s in [0, 1] through three places, and its integral
        area = np.polynomial.Polynomial.fit(
            [0.25, 0.5, 0.75], areas, 2, domain=[0, 1], window=[0, 1]
        )
        inside = area.integ() * float(below - above)
        if taken + float(inside(1.0)) >= volume:
            missing = inside - (volume - taken)
            share = brentq(missing, 0.0, 1.0, xtol=float_info.min)
            return float(above + (below - above) * share)
        taken += float(inside(1.0))
    return float(depths[-1])


def measure_section(shape: Solid, normal: Floats, height: Floats) -> float:
    """Area [m^2], in 2D length [m], of the section where ``height`` (v,) is zero at no corner."""
    first, second, share = find_crossed_edges(shape, height)
    points = (1 - share) * shape.vertices[first] + share * shape.vertices[second]
    if shape.dim == 2:
        return float(np.linalg.norm(points[1] - points[0]))
    arm = points - points.mean(axis=0)
    along = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    along /= np.linalg.norm(along)
    x, y = arm @ along, arm @ np.cross(normal, along)
    order = np.argsort(np.arctan2(y, x))
    x, y = x[order], y[order]
    return 0.5 * float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum())
