"""A picture of spheres: orthographic, shaded, each pixel that of the nearest sphere."""

from __future__ import annotations

from math import cos, radians, sin

import numpy as np

from adapters.bed import FloatArray, IntArray

AZIMUTH, ELEVATION = radians(225), radians(28)
"""Direction of the viewer: into the cut faces of a quarter cylinder (x > 0, y > 0), from above."""

LIGHT = np.array([-0.35, 0.55, 0.76])
"""Direction of the light: right, up, towards the viewer."""


def view(position: FloatArray) -> FloatArray:
    """Coordinates right, up and towards the viewer [m] of ``position`` [m], both (n, 3)."""
    right = np.array([-sin(AZIMUTH), cos(AZIMUTH), 0.0])
    towards = np.array(
        [cos(ELEVATION) * cos(AZIMUTH), cos(ELEVATION) * sin(AZIMUTH), sin(ELEVATION)]
    )
    up = np.cross(towards, right)
    return np.asarray(position @ np.column_stack([right, up, towards]))


def draw_spheres(
    position: FloatArray,
    radius: FloatArray,
    colour: FloatArray,
    extent: tuple[float, float, float, float],
    width: int,
) -> FloatArray:
    """Image of spheres on white, shape (height, width, 3), values 0 to 1, first row on top.

    ``position`` [m], (n, 3); ``radius`` [m], (n,); ``colour``, (n, 3); ``extent`` left, right,
    bottom, top [m] in the plane of `view`; ``width`` in pixels.
    """
    left, right, bottom, top = extent
    pixel = (right - left) / width
    height = round((top - bottom) / pixel)
    image, depth = np.ones((height, width, 3)), np.full((height, width), -np.inf)
    seen = view(position)
    light = LIGHT / np.linalg.norm(LIGHT)
    for (x, y, z), r, rgb in zip(seen, radius, colour, strict=True):
        columns = _pixels(x - left, r, pixel, width)
        rows = _pixels(top - y, r, pixel, height)
        across = ((columns + 0.5) * pixel + left - x)[None, :]
        upward = (top - (rows + 0.5) * pixel - y)[:, None]
        square = r**2 - across**2 - upward**2
        rise = np.sqrt(np.maximum(square, 0.0))
        here = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
        nearer = (square > 0) & (z + rise > depth[here])
        shade = (light[0] * across + light[1] * upward + light[2] * rise) / r
        # A dark rim separates one grain from the next where their colours agree.
        brightness = (0.52 + 0.62 * np.maximum(shade, 0.0)) * (0.6 + 0.4 * (rise / r) ** 0.5)
        painted = np.minimum(brightness[..., None] * rgb, 1.0)
        image[here] = np.where(nearer[..., None], painted, image[here])
        depth[here] = np.where(nearer, z + rise, depth[here])
    return image


def _pixels(centre: float, radius: float, pixel: float, count: int) -> IntArray:
    """Indices of the pixels that a sphere covers along one axis; at least one."""
    low = int(np.clip((centre - radius) / pixel, 0, count - 1))
    high = int(np.clip((centre + radius) / pixel, low, count - 1))
    return np.arange(low, high + 1)


def extent_of(positions: list[FloatArray], radius: FloatArray) -> tuple[float, float, float, float]:
    """Left, right, bottom, top [m] that hold the spheres at all ``positions``."""
    seen = np.array([view(position)[:, :2] for position in positions])
    low = (seen - radius[:, None]).min(axis=(0, 1))
    high = (seen + radius[:, None]).max(axis=(0, 1))
    margin = 0.01 * (high - low).max()
    return (low[0] - margin, high[0] + margin, low[1] - margin, high[1] + margin)
