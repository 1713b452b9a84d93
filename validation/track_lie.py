"""How the ballast of a track lies: measures, grains that stand alone, the solid share."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from qdem_fem.mesh_checks import FloatArray

GRAIN = 0.05
"""A grain's size [m]."""
NEAR, RING, STANDS = 2.4 * GRAIN, GRAIN, 0.6 * GRAIN
"""A grain stands alone where all others whose centres lie from `RING` to `NEAR` of it in plan have
theirs at least `STANDS` lower [m]: below it are those of its own column, which do not count."""


def measures_of(grains: Sequence[FloatArray], radius: float) -> dict[str, float]:
    """Height of ballast and its length on top and at its foot [m], from nodes of grains (k, 3) [m].

    The height is that below which 95 of 100 vertices of the highest tenth lie, over the ground; on
    top is within a grain of it.
    """
    nodes = np.concatenate(grains)
    height = float(np.quantile(nodes[:, 2], 0.995))
    ends = np.quantile(nodes[nodes[:, 2] > height - GRAIN, 0], [0.01, 0.99])
    return {
        "height": height + radius,
        "top": float(ends[1] - ends[0]),
        "foot": float(np.ptp(nodes[:, 0])) + 2 * radius,
    }


def standing_alone(
    grains: Sequence[FloatArray], width: float | None = None
) -> NDArray[np.intp]:  # fmt: skip
    """Numbers of grains that stand higher than all around them, as the top of a tower does.

    ``grains`` are nodes of each (k, 3) [m], ``width`` that after which they repeat along y [m].
    A grain that has none around it, alone on the ground, does not stand on anything.
    """
    centres = np.array([nodes.mean(axis=0) for nodes in grains])
    plan, images = centres[:, :2].copy(), [0.0]
    if width is not None:
        plan[:, 1] %= width
        images = [-width, 0.0, width]
    every = np.concatenate([plan + np.array([0.0, image]) for image in images])
    heights = np.tile(centres[:, 2], len(images))
    around = cKDTree(every).query_ball_point(plan, NEAR)
    alone = []
    for number, near in enumerate(around):
        apart = np.hypot(*(every[near] - plan[number]).T)
        ring = heights[near][apart > RING]
        if len(ring) and centres[number, 2] > ring.max() + STANDS:
            alone.append(number)
    return np.array(alone, dtype=np.intp)


def solid_share(
    grains: Sequence[FloatArray], radius: float, box: FloatArray, width: float | None = None,
    points: int = 200_000, seed: int = 0,
) -> float:  # fmt: skip
    """Share of a ``box`` (2, 3) [m] that is filled: that of random points within a sphere.

    Spheres of ``radius`` [m] sit at all nodes (k, 3) [m] of the grains, inner ones too: where
    nodes are nearer to each other than a radius they fill a grain.  Standard error: at most
    0.5/sqrt(points).
    """
    nodes = np.concatenate(grains)
    if width is not None:
        nodes[:, 1] %= width
        shifts = (-width, 0.0, width)
        nodes = np.concatenate([nodes + np.array([0.0, image, 0.0]) for image in shifts])
    random = np.random.default_rng(seed)
    places = box[0] + (box[1] - box[0]) * random.random((points, 3))
    distance = cKDTree(nodes).query(places, distance_upper_bound=radius)[0]
    return float(np.mean(distance <= radius))
