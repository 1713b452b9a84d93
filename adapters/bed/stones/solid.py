"""Volume, centre of mass and inertia of a solid, from its surface.

By the divergence theorem a function f of degree d has, over a solid with the surface element dA,

    integral of f dV = 1/(3 + d) integral of f x . dA

so that 1, x_i and x_i x_j need points on the surface alone.
"""

from dataclasses import dataclass

import numpy as np

from adapters.bed import GOLDEN_ANGLE, FloatArray, IntArray

SURFACE_POINTS = 100_000
"""Points on all spheres of a union together: volume and inertia are then right to 1e-4."""


@dataclass(frozen=True)
class Solid:
    """What a rigid body needs to know of its shape; density 1."""

    volume: float  # [m^3]
    centre: FloatArray  # centre of mass [m], shape (3,)
    inertia: FloatArray  # about the centre, along the axes [m^5], shape (3, 3)

    @property
    def radius(self) -> float:
        """Radius of the sphere of the same volume [m]."""
        return float(np.cbrt(3 * self.volume / (4 * np.pi)))


def integrate_surface(point: FloatArray, area: FloatArray) -> Solid:
    """The solid with this surface: ``point`` [m] and outward ``area`` vectors [m^2], (p, 3)."""
    origin = point.mean(axis=0)  # far from it digits would cancel
    point = point - origin
    swept = np.einsum("pi,pi->p", point, area)
    volume = float(swept.sum()) / 3
    centre = swept @ point / (4 * volume)
    second = np.einsum("p,pi,pj->ij", swept, point, point) / 5
    second -= volume * np.outer(centre, centre)
    return Solid(volume, origin + centre, np.trace(second) * np.eye(3) - second)


def integrate_mesh(point: FloatArray, triangle: IntArray) -> Solid:
    """The solid inside a closed mesh, exactly; negative volume where the triangles face inwards.

    ``point`` [m], shape (p, 3); ``triangle``, rows of ``point``, shape (t, 3).  On a triangle x . n
    is constant, and the middles of its sides integrate squares exactly.
    """
    a, b, c = (point[corner] for corner in triangle.T)
    area = np.cross(b - a, c - a) / 6
    return integrate_surface(
        np.concatenate([(a + b) / 2, (b + c) / 2, (c + a) / 2]), np.tile(area, (3, 1))
    )


def integrate_union(place: FloatArray, radius: FloatArray) -> Solid:
    """The union of spheres with centres (m, 3) and radii (m,) [m], no two of them the same.

    What overlaps counts once.  The surface is what of each sphere lies in no other one, on points
    spread evenly; relative errors are about 1e-4.
    """
    count = SURFACE_POINTS // len(radius)
    height = 1 - (2 * np.arange(count) + 1) / count
    angle = GOLDEN_ANGLE * np.arange(count)
    flat = np.sqrt(1 - height**2)
    normal = np.column_stack([flat * np.cos(angle), flat * np.sin(angle), height])
    points, areas = [], []
    for centre, r in zip(place, radius, strict=True):
        point = centre + r * normal
        free = np.ones(count, bool)
        for other, reach in zip(place, radius, strict=True):
            if other is not centre and np.linalg.norm(other - centre) < r + reach:
                free &= ((point - other) ** 2).sum(axis=1) >= reach**2 * (1 - 1e-12)
        points.append(point[free])
        areas.append(4 * np.pi * r**2 / count * normal[free])
    return integrate_surface(np.concatenate(points), np.concatenate(areas))
