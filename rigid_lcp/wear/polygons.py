"""A convex polygon worn at its corners: chamfers of the sharp one, or straight cuts of any size."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigid_lcp.errors import ShapeError
from rigid_lcp.wear.fragmentation import polygon_moments

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

LEAST_CHAMFER = 1e-6
"""Chamfers shorter than this share of a grain's size wait: detection has ties of 1e-9 of it."""


@dataclass(frozen=True)
class WornPolygon:
    """A polygon and the sharp one that it is worn from; all in the frame of the latter's shape."""

    sharp: Floats
    """Corners before chamfers (k, 2) [m]."""
    lost: Floats
    """Area cut off each sharp corner (k,) [m^2]."""
    vertices: Floats
    """Corners now (n, 2) [m]."""
    owner: Ints
    """The sharp corner that each corner now belongs to (n,)."""
    total: Floats
    """All area that has been worn at each corner now, on whatever sharp polygon, (n,) [m^2]."""


def wear_polygon(grain: WornPolygon, pending: Floats) -> tuple[WornPolygon, Floats] | None:
    """The polygon with the ``pending`` wear (n,) [m^2] of its corners cut off too, and what is left
    pending at its corners (m,) because it is too little to be cut.

    None where all of it is.  Raises `ShapeError` where it is more than half of the grain.
    """
    size = float(np.linalg.norm(np.ptp(grain.sharp, axis=0)))
    least = (LEAST_CHAMFER * size) ** 2
    if pending.max() < least:
        return None
    as_now = grain.vertices, np.arange(len(pending)), np.zeros(len(pending))
    for sharp, owner, lost in ((grain.sharp, grain.owner, grain.lost), as_now):
        worn = np.bincount(owner, pending, len(sharp))
        cut = np.where(lost + worn >= least, lost + worn, lost)
        made = chamfer_corners(sharp, cut)
        if made is not None:
            break
    else:  # corners with short edges go as a whole
        kept, nearest = take_corners(grain.vertices, cut)
        left = np.zeros(len(kept))
        np.add.at(left, _nearest(kept, grain.vertices), pending - cut)
        total = (grain.total + cut)[nearest]
        return WornPolygon(kept, 0 * total, kept, np.arange(len(kept)), total), left
    total = np.zeros(len(sharp))
    np.maximum.at(total, owner, grain.total)
    total += cut - lost
    vertices, owner = made
    left = lost + worn - cut
    return WornPolygon(sharp, cut, vertices, owner, total[owner]), left[owner]


def chamfer_corners(sharp: Floats, lost: Floats) -> tuple[Floats, Ints] | None:
    """A polygon (n, 2) with ``lost`` (n,) [m^2] cut off its corners, and each corner's owner.

    Each chamfer cuts the same length off both edges.  None where chamfers would meet on an edge,
    or take more than half of one.
    """
    back = np.roll(sharp, 1, axis=0) - sharp
    ahead = np.roll(sharp, -1, axis=0) - sharp
    length_back, length = np.linalg.norm(back, axis=1), np.linalg.norm(ahead, axis=1)
    back, ahead = back / length_back[:, None], ahead / length[:, None]
    cut = np.sqrt(2 * lost / np.abs(back[:, 0] * ahead[:, 1] - back[:, 1] * ahead[:, 0]))
    if (cut > 0.49 * np.minimum(length, length_back)).any():
        return None
    ends = np.stack([sharp + cut[:, None] * back, sharp + cut[:, None] * ahead], axis=1)
    kept = np.column_stack([np.ones(len(sharp), bool), lost > 0]).ravel()
    owner = np.repeat(np.arange(len(sharp)), 2)
    return ends.reshape(-1, 2)[kept], owner[kept]


def take_corners(vertices: Floats, areas: Floats) -> tuple[Floats, Ints]:
    """A polygon (n, 2) that loses ``areas`` (n,) [m^2] at its corners by straight cuts of any size.

    Each cut is across the bisector of its corner, and takes neighbouring corners too where it must.
    The corners that remain, and for each the nearest of the old ones.  Raises `ShapeError` where
    that leaves no more than half of the polygon.
    """
    if areas.sum() > 0.5 * polygon_moments(vertices)[0]:
        raise ShapeError(
            f"{areas.sum():.3g} m^2 wore off a grain of {polygon_moments(vertices)[0]:.3g} m^2 "
            "between two cuts", where="wear",
            remedy="cut more often (every), or take a smaller coefficient",
        )  # fmt: skip
    left = vertices
    for k in np.argsort(-areas, kind="stable"):
        if areas[k] == 0:
            break
        corner = int(np.argmin(np.linalg.norm(left - vertices[k], axis=1)))
        sides = left[[corner - 1, (corner + 1) % len(left)]] - left[corner]
        across = -(sides / np.linalg.norm(sides, axis=1)[:, None]).sum(axis=0)
        across /= np.linalg.norm(across)
        height = left @ across - left[corner] @ across
        left = _clip_polygon(
            left, height + cut_depth(height, left @ [-across[1], across[0]], areas[k])
        )
    edge = np.linalg.norm(np.roll(left, -1, axis=0) - left, axis=1)
    left = left[edge > LEAST_CHAMFER * edge.max()]
    return left, _nearest(vertices, left)


def _nearest(places: Floats, points: Floats) -> Ints:
    """Row of ``places`` (n, 2) that is nearest to each of the ``points`` (m, 2)."""
    apart = np.linalg.norm(points[:, None] - places[None], axis=2)
    return np.asarray(np.argmin(apart, axis=1), dtype=np.int64)


def cut_depth(height: Floats, along: Floats, area: float) -> float:
    """Depth t [m] to which a straight cut takes ``area`` [m^2] off the top of a convex polygon.

    ``height`` (n,) of its corners along the cut's normal [m], at most zero; ``along`` (n,) the
    other coordinate.  Between two corners the width is linear in depth, and the area a parabola.
    """
    above, wide, taken = 0.0, 0.0, 0.0
    for depth in np.unique(-height):
        width = _width(height + depth, along)
        slab = 0.5 * (wide + width) * (depth - above)
        if taken + slab >= area and depth > above:
            slope = (width - wide) / (depth - above)
            rest = area - taken
            return float(above + 2 * rest / (wide + np.sqrt(wide**2 + 2 * slope * rest)))
        above, wide, taken = float(depth), width, taken + slab
    return above


def _width(height: Floats, along: Floats) -> float:
    """Width [m] of a convex polygon where ``height`` (n,) is zero."""
    place = [float(x) for x, h in zip(along, height, strict=True) if h == 0]
    for k in range(len(height)):
        here, there = height[k - 1], height[k]
        if here * there < 0:
            share = here / (here - there)
            place.append(float((1 - share) * along[k - 1] + share * along[k]))
    return max(place) - min(place)


def _clip_polygon(vertices: Floats, height: Floats) -> Floats:
    """The part of a convex polygon where ``height`` (n,), linear in place, is not positive."""
    kept = []
    for k in range(len(vertices)):
        following = (k + 1) % len(vertices)
        here, there = height[k], height[following]
        if here <= 0:
            kept.append(vertices[k])
        if here * there < 0:
            share = here / (here - there)
            kept.append((1 - share) * vertices[k] + share * vertices[following])
    return np.array(kept)
