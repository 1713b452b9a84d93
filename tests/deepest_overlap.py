"""The greatest overlap of a bed, without any neighbour search."""

from __future__ import annotations

import numpy as np
from scipy.spatial.distance import pdist

from adapters.bed.container import Walls
from adapters.bed.state import FloatArray


def deepest(position: FloatArray, radius: FloatArray, walls: Walls) -> float:
    """Greatest overlap [m] of grains (n, 3), (n,) [m], over all pairs and walls."""
    first, second = np.triu_indices(len(radius), 1)
    reach = radius[first] + radius[second]
    pairs = reach - pdist(position) if len(radius) > 1 else np.zeros(1)
    side = [
        radius - (position - point) @ normal
        for point, normal in zip(walls.plane_point, walls.plane_normal, strict=True)
    ]
    cylinder = np.hypot(position[:, 0], position[:, 1]) + radius - walls.cylinder_radius
    return float(max(pairs.max(), np.max(side), cylinder.max()))
