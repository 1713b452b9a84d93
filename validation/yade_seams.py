"""Seams between the triangles of a partial piston on YADE: what a grain on one feels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from adapters import contact_law as law
from adapters.scene import Scene
from adapters.state import FloatArray
from adapters.yade_parameters import piston_face

SEAM_MEAN = 3 * np.pi / 16
"""Mean of (1 - x^2)^(3/2) over 0 < x < 1."""


def seam_length(triangles: FloatArray, inside: Callable[[FloatArray], Any]) -> float:
    """Length [m] of the edges that two ``triangles`` (t, 3, 2) share, where grains can be.

    ``inside`` takes points (n, 2) [m] and says of each whether it is in the container.
    """
    sides = np.concatenate([triangles, triangles[:, :1]], axis=1)
    seen: set[frozenset[tuple[float, ...]]] = set()
    length = 0.0
    for corners in sides:
        for a, b in pairwise(corners):
            edge = frozenset(tuple(np.round(corner, 12).tolist()) for corner in (a, b))
            if edge in seen:
                between = a + np.linspace(0, 1, 1001)[:, None] * (b - a)
                length += float(np.linalg.norm(b - a) * np.mean(inside(between)))
            seen.add(edge)
    return length


def seam_force(distance: float | FloatArray, contact_radius: float) -> FloatArray:
    """Force on a grain at a ``distance`` [m] from a seam over that on a plane, same overlap.

    The nearest point of the other triangle is on the seam, so its overlap is
    delta - s^2/(2 R) = delta (1 - s^2/a^2), a = sqrt(2 R delta) the ``contact_radius``, and by
    eq. 5 it adds (1 - s^2/a^2)^(3/2).
    """
    depth = np.maximum(1 - np.square(distance) / contact_radius**2, 0.0)
    return np.asarray(1 + depth**1.5)


@dataclass(frozen=True)
class Seams:
    """What the seams of a scene's partial piston do."""

    touched: float
    """Share of the piston's contacts that are on a seam."""
    stiffness: float
    """By how much they raise the mean stiffness of the piston's contacts, over it."""


def seams_of(scene: Scene) -> Seams:
    """Seams of a scene's piston at the peak load, every grain of the mean radius.

    Grains meet the triangles near the rim alone, further in the plane, which has no seam.
    A square of two radii for each grain under the piston, of which half carry.
    """
    assert scene.loading is not None
    grain = scene.sample.grain_radius
    face = piston_face(scene.container, scene.piston_reach, grain)
    mirrors = np.array([axis in scene.container.symmetry for axis in "xy"])

    def seen(points: FloatArray) -> Any:
        inside = ((points > 0) | ~mirrors).all(axis=1)
        return inside & (np.hypot(*points.T) > face["plane_reach"])

    length = seam_length(np.array(face["triangles"]), seen)
    peak = float(scene.stress_at(np.linspace(0, 1, 101)).max())
    force = peak * (2 * grain.mean) ** 2 / 0.5
    overlap = float(law.overlap_under_force(force, scene.stiffness.wall, grain.mean))
    touched = 2 * np.sqrt(2 * grain.mean * overlap) * length / scene.loaded_area
    return Seams(float(touched), float(SEAM_MEAN * touched))
