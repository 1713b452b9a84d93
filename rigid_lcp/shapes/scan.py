"""Stones as they were scanned: the convex hull of a closed surface, with as few corners as asked.

Contact is between convex bodies, so a scan's hollows are filled, and a step costs the more the more
corners a stone has.  What both change is measured: volume, centre of mass, moments of inertia.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial import ConvexHull

from rigid_lcp.arrays import Floats
from rigid_lcp.errors import ShapeError
from rigid_lcp.shapes.polyhedron import Polyhedron, find_hull, integrate_solid
from trackbed.mesh_file import read_surface
from trackbed.run_files import digest_file
from trackbed.scene_files import LengthUnit, find_sieve_size

Solid = tuple[float, Floats, Floats]
"""Volume [m^3], centre of mass (3,) [m] and inertia over density about it (3, 3) [m^5]."""


@dataclass(frozen=True)
class Change:
    """How one solid differs from another."""

    volume: float  # over the other's, less 1 [-]
    centre: float  # way of the centre of mass over the radius of a sphere of the other's volume [-]
    inertia: float  # greatest difference of a principal moment, over the other's [-]


@dataclass(frozen=True)
class Scan:
    """A scanned stone, and how its shape differs from the scan."""

    path: Path
    digest: str  # of the file
    triangles: int
    turned: bool  # whether all triangles of the file faced inwards
    hull: Change  # of the convex hull from the scan
    hull_corners: int
    shape: Polyhedron  # of some corners of the hull, spread to its volume, in the scan's size
    spread: float  # factor of that on lengths, less 1 [-]
    thinned: Change  # of the shape from the hull
    size: float  # smallest square hole that the shape passes [m]

    def describe(self) -> str:
        """How the stone differs from its scan, as a sentence."""
        said = (
            f"{self.path.name}: {self.triangles:,} triangles"
            f"{', which faced inwards, turned' * self.turned}; its convex hull has "
            f"{max(self.hull.volume, 0.0):.2%} more volume and mass, moments of inertia "
            f"{self.hull.inertia:.2%} and a centre {self.hull.centre:.2%} of a radius off; "
        )
        count = len(self.shape.vertices)
        if count == self.hull_corners:
            return f"{said}all {count} corners kept"
        return (
            f"{said}{count} of {self.hull_corners:,} corners kept, spread by {self.spread:.2%} to "
            f"the hull's volume: moments {self.thinned.inertia:.2%}, centre "
            f"{self.thinned.centre:.2%} off the hull's"
        )


def read_scan(path: Path, unit: LengthUnit, corners: int) -> Scan:
    """The stone of a mesh file with lengths in ``unit``, with ``corners`` corners at most.

    Raises `MeshError` for a surface that bounds no solid (`trackbed.mesh_file.read_surface`),
    `ShapeError` where the hull has no volume or corners too near to one another.
    """
    surface = read_surface(path, unit)
    try:
        triangles, points = find_hull(surface.points)
        kept = Polyhedron(thin_points(points, corners) if len(points) > corners else points)
        hull = integrate_solid(points, triangles)
        spread = (hull[0] / kept.volume) ** (1 / 3)
        shape = kept.scale(spread)
    except ShapeError as error:
        raise error.relocate(str(path)) from error
    scanned = integrate_solid(surface.points, surface.triangles)
    return Scan(
        path, digest_file(path), len(surface.triangles), surface.turned,
        compare_solids(hull, scanned), len(points), shape, spread - 1,
        compare_solids((shape.volume, shape.centroid, shape.inertia), hull),
        find_sieve_size(shape.vertices),
    )  # fmt: skip


def compare_solids(solid: Solid, other: Solid) -> Change:
    """How a solid differs from another."""
    moments, wanted = (np.linalg.eigvalsh(one[2]) for one in (solid, other))
    apart = np.abs(moments / wanted - 1)
    radius = (3 * other[0] / (4 * np.pi)) ** (1 / 3)
    way = float(np.linalg.norm(solid[1] - other[1])) / radius
    return Change(solid[0] / other[0] - 1, way, float(apart.max()))


def thin_points(points: Floats, count: int) -> Floats:
    """``count`` of the corners (n, 3) [m] of a convex hull, those that its shape hangs on most.

    Four far apart, and then again and again the corner that is farthest outside the hull of those
    chosen before.  Which they are depends on no axes and no unit.
    """
    rest = points - points.mean(axis=0)
    chosen: list[int] = []
    for _ in range(4):
        chosen.append(int(np.argmax(np.einsum("pi,pi->p", rest, rest))))
        if len(chosen) == 1:
            rest = points - points[chosen[0]]
        else:
            along = rest[chosen[-1]] / np.linalg.norm(rest[chosen[-1]])
            rest = rest - np.outer(rest @ along, along)
    while len(chosen) < count:
        plane = ConvexHull(points[chosen]).equations
        chosen.append(int(np.argmax((points @ plane[:, :3].T + plane[:, 3]).max(axis=1))))
    return points[chosen]
