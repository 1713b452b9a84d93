"""A mono-block sleeper of trapezoidal section as a mesh."""

from dataclasses import dataclass

import numpy as np

from qdem_fem.files import Floats, Integers, MeshError
from qdem_fem.mesh import TetMesh, make_box_mesh

ON_THE_PLANE = 1e-9
"""Over the length: distance within which a node lies on a plane."""


@dataclass(frozen=True)
class SleeperShape:
    """Measures of a sleeper [m]; x along it from 0, y across it about 0, z up from its bottom.

    Length, width and height are those the paper prints of the Type-3 pre-stressed concrete
    sleeper, which are largest ones; what it leaves open is assumed: sides that lean to
    ``top_width`` (that gives 168 kg), no waist and no slope of the ends, seats of 0.13 m for the
    rail foot, 1.132 m apart (gauge 1.067 m and the width of a rail head).
    """

    length: float = 2.0
    width: float = 0.24  # of the bottom
    height: float = 0.174
    top_width: float = 0.17
    seat_distance: float = 1.132  # from the middle of one rail seat to that of the other
    seat_length: float = 0.13  # along the sleeper

    @property
    def stations(self) -> Floats:
        """Ends of the sleeper and of its seats, and its centre [m], (7,)."""
        middle, apart, half = self.length / 2, self.seat_distance / 2, self.seat_length / 2
        right = np.array([0.0, apart - half, apart + half, middle])
        return np.concatenate([middle - right[:0:-1], middle + right])

    def width_at(self, z: Floats) -> Floats:
        """Width b(z) [m]."""
        return self.width - (self.width - self.top_width) * np.asarray(z) / self.height


def make_sleeper_mesh(shape: SleeperShape, along: int, across: int, up: int) -> TetMesh:
    """The sleeper in ``along`` x ``across`` x ``up`` cells of six tetrahedra; volume exact.

    Cells along it are shared out between the `SleeperShape.stations` by their distance, at least
    one each.  Node sets: ``bottom``, ``top``, ``end-1``, ``end-2``, ``seat-1`` and ``seat-2`` (the
    nodes of the top over a rail seat, edges included), all that of a box, and single nodes
    nearest to where the paper measures accelerations on the top: ``S1`` (end), ``S2`` (by the
    rail), ``S3`` (centre); where exactly is assumed.  Raises `MeshError` for fewer than 6 cells
    along.
    """
    knots = shape.stations
    cuts = _share_cells(np.diff(knots) / shape.length, along)
    mesh = make_box_mesh((1.0, 1.0, 1.0), (along, across, up))
    grid = np.concatenate(
        [np.linspace(a, b, n, endpoint=False) for a, b, n in zip(knots, knots[1:], cuts,
                                                                 strict=False)]
        + [knots[-1:]]
    )  # fmt: skip
    x = grid[np.rint(mesh.nodes[:, 0] * along).astype(np.int64)]
    z = mesh.nodes[:, 2] * shape.height
    nodes = np.stack([x, (mesh.nodes[:, 1] - 0.5) * shape.width_at(z), z], axis=1)
    sets = {
        new: mesh.node_sets[old]
        for new, old in (("bottom", "z-min"), ("top", "z-max"), ("end-1", "x-min"),
                         ("end-2", "x-max"))
    }  # fmt: skip
    top, near = sets["top"], ON_THE_PLANE * shape.length
    seats = shape.length / 2 + shape.seat_distance / 2 * np.array([-1, 1])
    for number, seat in enumerate(seats, 1):
        inside = np.abs(nodes[top, 0] - seat) <= shape.seat_length / 2 + near
        sets[f"seat-{number}"] = top[inside]
    beside = seats[0] + shape.seat_length / 2
    for name, place in (("S1", 0.0), ("S2", beside), ("S3", shape.length / 2)):
        away = np.hypot(nodes[top, 0] - place, nodes[top, 1])
        sets[name] = top[[int(away.argmin())]]
    return TetMesh(nodes, mesh.elements, node_sets=sets)


def make_half_sleeper(shape: SleeperShape, along: int, across: int, up: int) -> TetMesh:
    """The half of a sleeper from end 1 to its middle, ``along`` cells long, as `make_sleeper_mesh`.

    Its node sets without those of the other half, and ``ends``: the plane of symmetry at the
    middle.  Raises `MeshError` for fewer than 3 cells along.
    """
    whole = make_sleeper_mesh(shape, 2 * along, across, up)
    middle = shape.length / 2
    kept = whole.nodes[whole.elements, 0].mean(axis=1) < middle
    nodes = np.unique(whole.elements[kept])
    number = np.full(len(whole.nodes), -1)
    number[nodes] = np.arange(len(nodes))
    sets = {name: number[old][number[old] >= 0] for name, old in whole.node_sets.items()}
    sets = {name: mine for name, mine in sets.items() if len(mine)}
    sets["ends"] = np.flatnonzero(whole.nodes[nodes, 0] > middle - ON_THE_PLANE * shape.length)
    return TetMesh(whole.nodes[nodes], number[whole.elements[kept]], node_sets=sets)


def _share_cells(shares: Floats, count: int) -> Integers:
    """``count`` whole cells by shares that add up to one, one each at least."""
    if count < len(shares):
        raise MeshError(
            f"{count} cells along", where="make_sleeper_mesh", remedy=f"use {len(shares)} or more"
        )
    cells = np.ones(len(shares), np.int64)
    for _ in range(count - len(shares)):
        cells[int(np.argmax(shares / cells))] += 1
    return cells
