"""Convex polyhedra: grains with corners in space, with exact mass properties.

A shape lives in its body frame, whose origin is the centre of mass; where a body is and how it
is turned is the state's business.
"""

from copy import copy
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from rigid_lcp.arrays import Floats, Ints
from rigid_lcp.errors import ShapeError
from rigid_lcp.shapes.numbers import require_finite_shape, require_length, require_size

FLATNESS = 1e-9
"""Corners within this share of the size of a plane lie in it: round-off of coordinates is far
below, and what a grain has for edges far above."""
SCALING = {"vertices": 1, "distances": 1, "reach": 1, "width": 1, "volume": 3, "inertia": 5}
"""Powers of length in what a polyhedron knows of itself."""


def integrate_solid(points: Floats, triangles: Ints) -> tuple[float, Floats, Floats]:
    """Volume [m^3], centroid (3,) [m], and inertia over density about it (3, 3) [m^5] of the solid
    inside a closed surface of triangles wound outwards; exact.

    The divergence theorem splits the solid into signed tetrahedra with one corner in the mean of
    the points; each integral of 1, x, x x^T over a tetrahedron is a closed form (Tonon, J. Math.
    Stat. 1 (2005) 8).  ``points`` (n, 3) [m], ``triangles`` (t, 3) indices.
    """
    middle = points.mean(axis=0)
    corner = points[triangles] - middle
    six = np.einsum("ti,ti->t", corner[:, 0], np.cross(corner[:, 1], corner[:, 2]))
    volume = six.sum() / 6.0
    total = corner.sum(axis=1)
    centroid = (six[:, None] * total).sum(axis=0) / (24.0 * volume)
    second = np.einsum("t,tci,tcj->ij", six, corner, corner)
    second += np.einsum("t,ti,tj->ij", six, total, total)
    second = second / 120.0 - volume * np.outer(centroid, centroid)
    inertia = np.trace(second) * np.eye(3) - second
    return float(volume), centroid + middle, 0.5 * (inertia + inertia.T)


class Polyhedron:
    """The convex hull of points, moved so that its centre of mass is the origin.

    ``points`` (n, 3) [m]; points inside the hull are dropped.  ``centroid`` (3,) is where the
    centre of mass lay in the coordinates given: place the body there to have the polyhedron
    where it was.  Raises `ShapeError` for fewer than four points, points in a plane, or NaN.
    Not for hollow or non-convex grains: make those of several convex ones.
    """

    dim = 3

    def __init__(self, points: ArrayLike) -> None:
        triangles, corners = find_hull(points)
        found = integrate_solid(corners, triangles)
        self._set_fields(corners - found[1], triangles, found)

    @classmethod
    def from_corners(cls, vertices: ArrayLike) -> Self:
        """The polyhedron with the ``vertices`` (v, 3) [m] of another in its body frame.

        They are taken as they are, the round-off of their centre of mass and all: so a shape made
        here is made again from its corners to the last bit.
        """
        made = cls.__new__(cls)
        triangles, corners = find_hull(vertices)
        made._set_fields(corners, triangles, integrate_solid(corners, triangles))
        return made

    def scale(self, factor: float) -> Self:
        """The same polyhedron ``factor`` [-] times as large, about its centre of mass; angles of
        faces and names of corners, edges and faces stay."""
        made = copy(self)
        made.__dict__["edges"] = self.edges
        for name, power in SCALING.items():
            made.__dict__[name] = factor**power * getattr(self, name)
        return made

    def _set_fields(
        self, vertices: Floats, triangles: Ints, found: tuple[float, Floats, Floats]
    ) -> None:
        self.volume, self.centroid, self.inertia = found
        """Volume [m^3]; centre of mass in the coordinates of the points given [m], (3,); inertia
        tensor over density about the centre of mass, in the body frame [m^5]."""
        self.vertices = vertices
        """Corners in the body frame [m], (v, 3)."""
        self.faces, self.normals, self.distances = _find_faces(self.vertices, triangles)
        """Corners of each face, anticlockwise from outside; outward unit normals (f, 3);
        distances d of the faces from the centre of mass [m], (f,), as in eq. 9."""
        if len(self.faces) < 4 or self.width <= FLATNESS * self.reach:
            raise _explain_flat()

    @cached_property
    def edges(self) -> Ints:
        """(e, 4): first and second corner, and the two faces that meet there.

        Raises `ShapeError` where faces do not meet edge to edge.
        """
        owner: dict[tuple[int, int], int] = {}
        for face, loop in enumerate(self.faces):
            for start, end in zip(loop, np.roll(loop, -1), strict=True):
                owner[int(start), int(end)] = face
        rows = [
            (start, end, face, owner[end, start])
            for (start, end), face in owner.items()
            if start < end and (end, start) in owner
        ]
        if 2 * len(rows) != len(owner):
            raise ShapeError(
                "its faces do not meet edge to edge: corners are too near to one another or to a "
                f"face (within {FLATNESS:g} of its size)", where="Polyhedron",
                remedy="merge the corners that are nearly the same",
            )  # fmt: skip
        return np.array(rows, dtype=np.int64)

    @cached_property
    def reach(self) -> float:
        """Distance of the farthest corner from the centre of mass [m]."""
        return float(np.linalg.norm(self.vertices, axis=1).max())

    @cached_property
    def width(self) -> float:
        """Least of the distances from a face to its farthest corner [m]."""
        return float((self.distances - (self.vertices @ self.normals.T).min(axis=0)).min())

    def mass_properties(self, density: float) -> tuple[float, Floats]:
        """Mass [kg] and inertia tensor (3, 3) [kg m^2] in the body frame, ``density`` [kg/m^3]."""
        return density * self.volume, density * self.inertia

    def __repr__(self) -> str:
        return f"Polyhedron({len(self.vertices)} corners, {len(self.faces)} faces)"


def make_box(length: float, width: float, height: float) -> Polyhedron:
    """A cuboid with edges along x, y and z [m].  Raises `ShapeError` unless all are positive."""
    edges = [
        require_length(value, name, "box")
        for value, name in ((length, "length"), (width, "width"), (height, "height"))
    ]
    corners = np.indices((2, 2, 2)).reshape(3, -1).T - 0.5
    return Polyhedron(corners * edges)


def find_hull(points: ArrayLike) -> tuple[Ints, Floats]:
    """Triangles of the convex hull, wound outwards, and the points that are its corners."""
    from scipy.spatial import ConvexHull, QhullError

    given = require_finite_shape(points, "points", "Polyhedron")
    if given.ndim != 2 or given.shape[1] != 3 or len(given) < 4 or not np.isfinite(given).all():
        raise ShapeError(
            f"points of shape {given.shape} are not four or more finite places in space",
            where="Polyhedron", remedy="give an array (n, 3) of metres, n at least 4",
        )  # fmt: skip
    middle = given.mean(axis=0)
    size = float(np.abs(given - middle).max())
    require_size(size, "Polyhedron")
    try:
        hull = ConvexHull((given - middle) / (size or 1.0))
    except QhullError as error:
        raise ShapeError(
            "its points lie in a plane, on a line, or in one place", where="Polyhedron",
            remedy="give at least four points that span a volume",
        ) from error  # fmt: skip
    corners = np.sort(hull.vertices)
    inside = hull.points[corners].mean(axis=0)
    place = np.full(len(given), -1)
    place[corners] = np.arange(len(corners))
    a, b, c = (hull.points[hull.simplices[:, k]] for k in range(3))
    inwards = np.einsum("ti,ti->t", np.cross(b - a, c - a), a - inside) < 0
    triangles = place[hull.simplices]
    triangles[inwards] = triangles[inwards][:, ::-1]
    return triangles, given[corners]


def _explain_flat() -> ShapeError:
    return ShapeError(
        f"its points lie in a plane within {FLATNESS:g} of its size", where="Polyhedron",
        remedy="give at least four points that span a volume",
    )  # fmt: skip


def _find_faces(points: Floats, triangles: Ints) -> tuple[list[Ints], Floats, Floats]:
    """Planes of the hull, from the largest triangle down: loops of corners, normals, distances.

    A plane takes every point within `FLATNESS`; so slivers, which have no normal of their own to
    speak of, vanish into the faces beside them.  Raises `ShapeError` where one plane takes all.
    """
    corner = points[triangles]
    area = _find_areas(corner)
    squares = np.einsum("ti,ti->t", area, area)
    tolerance = FLATNESS * float(np.abs(points).max())
    loops: list[Ints] = []
    normals: list[Floats] = []
    free = np.ones(len(triangles), dtype=bool)
    for first in np.argsort(-squares, kind="stable"):
        if not free[first]:
            continue
        unit = area[first] / np.sqrt(squares[first])
        in_plane = np.abs((points - corner[first, 0]) @ unit) < tolerance
        if in_plane.all():
            raise _explain_flat()
        mine = in_plane[triangles].all(axis=1)
        unit = area[mine & free].sum(axis=0)
        unit /= np.linalg.norm(unit)
        free &= ~mine
        loops.append(_trace_loop(points, np.flatnonzero(in_plane), unit, tolerance))
        normals.append(unit)
    distances = [
        float((points[loop] @ unit).mean()) for loop, unit in zip(loops, normals, strict=True)
    ]
    return loops, np.array(normals), np.array(distances)


def _find_areas(corner: Floats) -> Floats:
    """Twice the area vectors (t, 3) [m^2] of triangles with corners (t, 3, 3) [m].

    Orthogonal to the edges within round-off of their length, however thin the triangle: a plain
    cross product leans by round-off times length over altitude, out of the tolerance of its plane.
    """
    sides = np.roll(corner, -1, axis=1) - corner
    squares = np.einsum("tki,tki->tk", sides, sides)
    row, longest = np.arange(len(corner)), squares.argmax(axis=1)
    base, side = sides[row, longest], sides[row, (longest + 1) % 3]
    share = np.einsum("ti,ti->t", base, side) / squares[row, longest]
    return np.cross(base, side - share[:, None] * base)


def _trace_loop(points: Floats, corners: Ints, normal: Floats, tolerance: float) -> Ints:
    """Corners of a convex face anticlockwise about its normal, without those along an edge."""
    arm = points[corners] - points[corners].mean(axis=0)
    along = arm[np.argmax(np.einsum("ci,ci->c", arm, arm))]
    along = along / np.linalg.norm(along)
    angle = np.arctan2(arm @ np.cross(normal, along), arm @ along)
    loop = corners[np.argsort(angle, kind="stable")]
    before, after = points[np.roll(loop, 1)], points[np.roll(loop, -1)]
    chord = after - before
    offset = np.cross(chord, points[loop] - before) @ normal
    return np.asarray(loop[-offset > tolerance * np.linalg.norm(chord, axis=1)], dtype=np.int64)
