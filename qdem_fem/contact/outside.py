"""What of a body's surface contact sees: all of it, or, of a periodic slab, what is not joined.

Faces that `periodic` has joined across the width lie within the body and its images.  They are
left out, and in their place the surface goes on: faces near one side appear once more beyond the
other, as images of the same nodes, so that what slides over the side stays on a closed surface.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from qdem_fem.contact.search import PeriodicWidth, find_joined_twins
from qdem_fem.contact.system import System

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True)
class Outside:
    """The vertices and faces of a body that others may touch."""

    node: Integers
    """(k,) the node of the body that each vertex is, or is an image of"""
    reference: Floats
    """(k, 3) reference position [m]"""
    face: Integers
    """(f, 3) vertices, outward; the body's own faces first"""
    own_faces: int
    """Faces that are not images."""
    own: NDArray[np.bool_]
    """(k,) whether a vertex is no image, nor the upper one of two that are one"""
    image: NDArray[np.bool_]
    """(k,) whether a vertex is an image"""
    joined: bool
    """Whether the body is one with its images across the width."""


def find_outside(
    nodes: Floats, surface: Integers, master: Integers, side: PeriodicWidth | None, reach: float
) -> Outside:
    """The outside of a body of ``nodes`` (n, 3) [m] with outward faces ``surface`` (k, 3).

    ``master`` (n,): the node that each moves with; ``reach`` [m]: way beyond the sides up to which
    images of the faces are needed.
    """
    low, high = (
        (np.zeros(0, np.int64),) * 2 if side is None else find_joined_twins(nodes, master, side)
    )
    if side is None or not len(low):
        node = np.unique(surface)
        return Outside(
            node, nodes[node], np.searchsorted(node, surface), len(surface),
            np.ones(len(node), dtype=bool), np.zeros(len(node), dtype=bool), False,
        )  # fmt: skip
    within = np.isin(surface, low).all(axis=1) | np.isin(surface, high).all(axis=1)
    face = surface[~within]
    x = nodes[:, side.number][face]
    lower, upper = nodes[low, side.number].max() + reach, nodes[high, side.number].min() - reach
    above, below = face[x.min(axis=1) <= lower], face[x.max(axis=1) >= upper]
    count = len(nodes)
    up, down = np.arange(count) + count, np.arange(count) + 2 * count
    up[low], down[high] = high, low  # the image of one of two joined nodes is the other
    every = np.concatenate([face, up[above], down[below]])
    vertex = np.unique(every)
    node, times = vertex % count, np.array([0.0, 1.0, -1.0])[vertex // count]
    return Outside(
        node, nodes[node] + times[:, None] * side.way, np.searchsorted(vertex, every), len(face),
        (vertex < count) & ~np.isin(vertex, high), vertex >= count, True,
    )  # fmt: skip


def find_outsides(run: System, side: PeriodicWidth | None, reach: float) -> list[Outside]:
    """`find_outside` every body; of slabs, images of faces up to ``reach`` [m] beyond a side."""
    found = []
    for body, start in zip(run.bodies, run.first_node, strict=False):
        master = run.master[start : start + len(body.nodes)] - start
        found.append(find_outside(body.nodes, body.surface, master, side, reach))
    return found
