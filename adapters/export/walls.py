"""Walls and piston of a scene as triangles, for STL."""

from __future__ import annotations

import numpy as np

from adapters.bed import Container, FloatArray, count_sides
from adapters.engines import clip_convex


def trace_section(container: Container, reach: float, grain_radius: float) -> FloatArray:
    """Corners of the horizontal section [m], counter-clockwise seen from above, shape (m, 2).

    A circle is a polygon with its corners on it, its sides at most 1 % of the mean
    ``grain_radius`` [m] inside; where the engine itself has planes for the cylinder, those.
    ``reach`` [m] is the radius of a part of the section; inf for the whole.
    """
    if container.shape == "box":
        return np.array(
            [
                (0.0, 0.0),
                (container.size_x, 0.0),
                (container.size_x, container.size_y),
                (0.0, container.size_y),
            ]
        )
    radius, sides = container.radius, container.sides
    if np.isfinite(reach) or not sides:
        radius = min(reach, radius)
        sides = count_sides(radius, grain_radius)
    else:
        radius /= np.cos(np.pi / sides)
    angle = 2 * np.pi * np.arange(sides) / sides
    circle = radius * np.column_stack([np.cos(angle), np.sin(angle)])
    # Mirrors pass through corners; what is left of them on the wrong side is round-off.
    circle[np.abs(circle) < 1e-12 * radius] = 0.0
    floor = [0.0 if axis in container.symmetry else -np.inf for axis in "xy"]
    return clip_convex(circle, floor)


def triangulate_piston(container: Container, reach: float, grain_radius: float) -> FloatArray:
    """The piston's face at height 0, normals down, at the grains, shape (t, 3, 3) [m]."""
    return _fan(trace_section(container, reach, grain_radius))[:, ::-1]


def triangulate_container(container: Container, height: float, grain_radius: float) -> FloatArray:
    """Floor and side walls up to ``height`` [m], normals at the grains, shape (t, 3, 3) [m].

    Mirror planes are no walls and are left open, as is the top.
    """
    section = trace_section(container, np.inf, grain_radius)
    faces = [_fan(section)]
    for a, b in zip(section, np.roll(section, -1, axis=0), strict=True):
        if _mirror(container, a, b):
            continue
        low, far = np.array([*a, 0.0]), np.array([*b, 0.0])
        up = np.array([0.0, 0.0, height])
        faces.append(np.array([[far, low, low + up], [far, low + up, far + up]]))
    return np.concatenate(faces)


def _mirror(container: Container, a: FloatArray, b: FloatArray) -> bool:
    """Whether the edge from ``a`` to ``b`` lies in a mirror plane."""
    return any(
        a[axis] == 0 and b[axis] == 0
        for axis, name in enumerate("xy")
        if name in container.symmetry
    )


def _fan(polygon: FloatArray) -> FloatArray:
    """Triangles of a convex polygon, shape (m, 2), at height 0, normals up, (m - 2, 3, 3)."""
    corners = np.column_stack([polygon, np.zeros(len(polygon))])
    return np.array([corners[[0, i, i + 1]] for i in range(1, len(corners) - 1)])
