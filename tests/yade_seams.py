"""Seams between the triangles of a partial piston on YADE: what a grain on one feels."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np

from adapters.bed.state import FloatArray

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
