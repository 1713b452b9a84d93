"""Spheres packed into a closed mesh, and how far they are from its volume and inertia.

Greedy: each sphere touches the surface from inside and covers as much of what is still uncovered
as any.  What such spheres leave out at edges and corners is then laid on all radii alike, so that
their union has the volume of the mesh.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq
from scipy.spatial import cKDTree

from adapters.bed import FloatArray, IntArray
from adapters.bed.stones.form import Form, make_form
from adapters.bed.stones.solid import Solid, integrate_mesh, integrate_union
from adapters.errors import UsageError

CELLS = 12_000
"""Cells of the box around a mesh: a sphere's place is right to about a 20th of the box."""
SAMPLES = 60_000
"""Points on the surface that distances are taken from."""


@dataclass(frozen=True)
class Fit:
    """How well the first spheres of a packing stand for the mesh."""

    spheres: int
    volume_error: float  # of the inscribed spheres' union, over the mesh's volume [-]
    growth: float  # laid on all radii so that the volume is right, over the stone's radius [-]
    inertia_error: float  # greatest of the principal moments behind that, relative [-]


def pack_spheres(
    name: str, point: FloatArray, triangle: IntArray, count: int
) -> tuple[Form, float, list[Fit]]:
    """A form of ``count`` spheres, the radius of the sphere of its volume [m], and errors.

    ``point`` [m], shape (p, 3), and ``triangle``, shape (t, 3), are one closed surface.  Errors are
    those of 1, 2, 4, ... spheres and of all.  Raises `UsageError` for another mesh.
    """
    point, triangle = join_corners(point, triangle)
    solid = integrate_mesh(point, triangle)
    place, radius = fill_with_spheres(point, triangle, count)
    counts = sorted({len(radius), *(2**i for i in range(len(radius).bit_length()))})
    fits = [judge_fit(place[:n], radius[:n], solid) for n in counts]
    grown = radius + fits[-1].growth * solid.radius
    return make_form(name, place, grown, solid), solid.radius, fits


def join_corners(point: FloatArray, triangle: IntArray) -> tuple[FloatArray, IntArray]:
    """The mesh with points at one place made one and triangles that face outwards.

    Raises `UsageError` unless it is a closed surface whose triangles face alike.
    """
    extent = float(np.ptp(point, axis=0).max()) if len(point) else 0.0
    if not np.isfinite(extent) or extent <= 0 or not len(triangle):
        raise UsageError("this mesh has no triangles, or no finite extent")
    point, same = np.unique(np.round(point / extent, 9), axis=0, return_inverse=True)
    point, triangle = extent * point, same.ravel()[triangle]
    triangle = triangle[(triangle != np.roll(triangle, 1, axis=1)).all(axis=1)]
    edges = np.concatenate([triangle[:, [i, (i + 1) % 3]] for i in range(3)])
    codes, back = (one @ [len(point), 1] for one in (edges, edges[:, ::-1]))
    open_edges = len(codes) - len(np.intersect1d(codes, back))
    if open_edges or len(np.unique(codes)) < len(codes):
        raise UsageError(
            f"the surface is not closed, or its triangles do not face alike: {open_edges} of "
            f"{len(codes)} edges have no triangle on their other side",
            remedy="close it, in MeshLab by Close Holes and Re-Orient all faces coherently",
        )  # fmt: skip
    inwards = integrate_mesh(point, triangle).volume < 0
    return point, triangle[:, ::-1] if inwards else triangle


def fill_with_spheres(
    point: FloatArray, triangle: IntArray, count: int
) -> tuple[FloatArray, FloatArray]:
    """Centres (m, 3) and radii (m,) [m] of inscribed spheres, the one that covers most first; fewer
    than ``count`` where they cover every cell."""
    low, size = point.min(axis=0), np.ptp(point, axis=0)
    side = float(np.cbrt(size.prod() / CELLS))
    cell = low + side * (0.5 + np.indices(np.ceil(size / side).astype(int)).reshape(3, -1).T)
    depth = measure_depth(cell, point, triangle)
    cell, depth = cell[depth > 0], depth[depth > 0]
    if not len(cell):
        raise UsageError("this mesh is too thin to hold a sphere")
    left, chosen = cell, list[int]()
    while len(chosen) < count and len(left):
        best = int(np.argmax(cKDTree(left).query_ball_point(cell, depth, return_length=True)))
        chosen.append(best)
        left = left[np.linalg.norm(left - cell[best], axis=1) > depth[best]]
    return cell[chosen], depth[chosen]


def measure_depth(place: FloatArray, point: FloatArray, triangle: IntArray) -> FloatArray:
    """Distance of places (n, 3) [m] below the surface, (n,), negative outside: to the plane of the
    triangle on which the nearest of `SAMPLES` points lies."""
    corner = point[triangle]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    area = np.linalg.norm(normal, axis=1)
    generator = np.random.default_rng(0)
    of = generator.choice(len(area), SAMPLES, p=area / area.sum())
    weight = generator.dirichlet(np.ones(3), SAMPLES)
    sample = np.einsum("si,sij->sj", weight, corner[of])
    near = cKDTree(sample).query(place)[1]
    unit = normal[of[near]] / area[of[near], None]
    return np.einsum("ni,ni->n", sample[near] - place, unit)


def judge_fit(place: FloatArray, radius: FloatArray, solid: Solid) -> Fit:
    """Errors of spheres (m, 3), (m,) [m] that stand for a solid, and the growth they need."""

    def find_excess(growth: float) -> float:
        return integrate_union(place, radius + growth * solid.radius).volume / solid.volume - 1

    error = find_excess(0.0)
    growth = float(brentq(find_excess, 0.0, 2.0, xtol=1e-5)) if error < 0 else 0.0
    grown = integrate_union(place, radius + growth * solid.radius)
    moments, wanted = (np.linalg.eigvalsh(one.inertia) for one in (grown, solid))
    return Fit(len(radius), error, growth, float(np.abs(moments / wanted - 1).max()))
