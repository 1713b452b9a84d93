"""Bodies of a ballasted track: loose grains on a lattice, and a slice of a sleeper.

Axes: x along the sleeper, y along the track, z up from the ground.  A slice is what lies between
two planes across the sleeper, which are planes of symmetry of the model: smooth walls for grains,
no displacement along x for the sleeper's ends.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from qdem_fem.files import Floats, MeshError
from qdem_fem.grains import GrainSet
from qdem_fem.mesh import TetMesh, make_box_mesh
from qdem_fem.track.sleeper_mesh import SleeperShape

GAP = 1e-6
"""Left between bodies that are put beside each other, or beside a wall [m]."""


Room = tuple[float, float, float, float]
"""From x to x and from y to y [m]."""


@dataclass(frozen=True)
class TrackBox:
    """Where the track lies: 0 <= x <= length, 0 <= y <= width, z >= 0 [m]."""

    length: float  # along the sleeper
    width: float  # along the track: from the middle between two sleepers to the next


def make_loose_lattice(
    grains: Sequence[Floats], rooms: Sequence[Room], bottom: float, radius: float, seed: int,
    share: Callable[[Floats], Floats] = np.ones_like, where: str = "track, box",
) -> list[Floats]:  # fmt: skip
    """Nodes of grains turned at random, in columns on a lattice; none touches another or a wall.

    ``grains``: nodes (n, 3) [m] of each about its centroid, ``radius`` [m] of their spheres, which
    stay within the ``rooms``.  Columns are filled from ``bottom`` [m] up, always that one next
    which is lowest over its ``share`` of the greatest height, a function of x (k,) [m] that is
    above zero.  Raises `MeshError`, saying ``where``, for rooms too narrow for the largest grain.
    """
    random = np.random.default_rng(seed)
    turns = Rotation.random(len(grains), random_state=seed)
    turned = [turn.apply(nodes) for turn, nodes in zip(turns, grains, strict=True)]
    low = np.array([nodes.min(axis=0) for nodes in turned]) - radius
    high = np.array([nodes.max(axis=0) for nodes in turned]) + radius
    cell = (high - low).max(axis=0) + GAP
    grids = [
        np.meshgrid(_place_centres(*room[:2], cell[0]), _place_centres(*room[2:], cell[1]))
        for room in rooms
    ]
    spots = np.concatenate([np.stack(grid, axis=-1).reshape(-1, 2) for grid in grids])
    spots = spots[np.lexsort(spots.T[::-1])]
    if not len(spots):
        raise MeshError(
            f"grains up to {cell.max():.3g} m wide, spheres included, do not fit in it",
            where=where, remedy="give a greater box, or smaller grains",
        )  # fmt: skip
    height = bottom + 1e-3 * random.random(len(spots))
    shares = share(spots[:, 0])
    placed = []
    for nodes, least, most in zip(turned, low, high, strict=True):
        column = int(((height - bottom) / shares).argmin())
        middle = 0.5 * (least + most)[:2]
        corner = np.array([*(spots[column] - middle), height[column] - least[2]])
        placed.append(nodes + corner)
        height[column] += most[2] - least[2] + GAP
    return placed


def _place_centres(start: float, end: float, cell: float) -> Floats:
    """Centres of as many cells as fit, evenly shared out [m]."""
    count = int((end - start) / cell)
    return start + (np.arange(count) + 0.5) * (end - start) / max(count, 1)


def place_grains(grains: GrainSet) -> list[Floats]:
    """Nodes of each grain [m], (n, 3), its centroid at zero."""
    return [grains.parts(number)[0] for number in range(len(grains))]


def make_sleeper_slice(
    shape: SleeperShape, box: TrackBox, bottom: float, radius: float, cells: tuple[int, int, int]
) -> TetMesh:
    """A slice of a sleeper at a rail seat, across the middle of the box, its bottom at a height.

    Its spheres of ``radius`` reach to the walls at both ends.  Node sets: ``bottom``, ``top``,
    ``ends``; ``seat``, the top over ``shape.seat_length`` in the middle; and on the middle of the
    top ``S1`` (left end), ``S2`` (middle), ``S3`` (right end).
    """
    length = box.length - 2 * (radius + GAP)
    mesh = make_box_mesh((length, 1.0, shape.height), cells)
    x, y, z = mesh.nodes.T
    nodes = np.stack(
        [x + radius + GAP, (y - 0.5) * shape.width_at(z) + box.width / 2, z + bottom], axis=1
    )
    old = mesh.node_sets
    top = old["z-max"]
    sets = {"bottom": old["z-min"], "top": top, "ends": np.union1d(old["x-min"], old["x-max"])}
    off = np.abs(nodes[top, 0] - box.length / 2)
    sets["seat"] = top[off <= max(shape.seat_length / 2, off.min()) + GAP]
    for name, place in (("S1", 0.0), ("S2", box.length / 2), ("S3", box.length)):
        away = np.hypot(nodes[top, 0] - place, nodes[top, 1] - box.width / 2)
        sets[name] = top[[int(away.argmin())]]
    return TetMesh(nodes, mesh.elements, node_sets=sets)
