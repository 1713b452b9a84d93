"""Which grains overlap with which, and with which wall; coordination number and penetration."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from adapters.bed.container import WHOLE, Walls
from adapters.bed.state import BoolArray, FloatArray, IntArray, State
from adapters.errors import UsageError

CYLINDER = "cylinder"
"""Name of the cylinder among the walls; its number comes after those of the planes."""


@dataclass(frozen=True)
class Neighbours:
    """Rows: one for each pair of grains, and for each grain and wall, nearer than some gap."""

    first: IntArray  # index of the grain, shape (m,)
    second: IntArray  # index of the other grain, above ``first``; or wall w as -1 - w; shape (m,)
    normal: FloatArray  # unit vector that points at the first grain, shape (m, 3)
    overlap: FloatArray  # overlap delta [m], negative for a gap, shape (m,)

    def __len__(self) -> int:
        return len(self.first)


@dataclass(frozen=True)
class Bed:
    """What the overlaps of one configuration say."""

    contacts: int  # rows in contact: pairs of grains, and grains with walls
    coordination_number: float  # mean number of contacts of a grain with other grains
    coordination_with_walls: float
    """The same, contacts with walls, mirror planes and piston counted too."""
    max_penetration: float  # greatest overlap [m]; 0 without contact
    mean_penetration: float  # mean overlap of the contacts [m]; 0 without contact
    mean_height: float  # mean height of the centres [m]


def list_wall_names(walls: Walls) -> tuple[str, ...]:
    """Names of the walls in the order of their numbers: the planes, then the cylinder."""
    return walls.plane_name + ((CYLINDER,) if np.isfinite(walls.cylinder_radius) else ())


def find_behind_discs(position: FloatArray, walls: Walls) -> BoolArray:
    """Which grains lie behind each plane that ends (a piston over a part of the bed), (n, p).

    Such a plane is a thin disc with two sides, so which side a grain belongs to is part of its
    state: take it where it is beyond doubt, before a jump.  Whole planes have one side only.
    """
    height = np.einsum("nwa,wa->nw", position[:, None] - walls.plane_point, walls.plane_normal)
    ends = np.isfinite(walls.plane_reach)
    ends[-1] |= walls.piston_edges != WHOLE
    return np.asarray((height < 0) & ends)


def find_pairs_within(position: FloatArray, radius: FloatArray, gap: float) -> IntArray:
    """Pairs (i, j), i < j, whose surfaces are nearer than ``gap`` [m], shape (m, 2), sorted.

    ``position`` (n, 3) and ``radius`` (n,) in metres.  One search tree for each factor of two in
    radius, so that small grains are not searched as far as big ones.
    """
    if len(radius) == 0:
        return np.empty((0, 2), np.int64)
    octave = np.floor(np.log2(radius / radius.min())).astype(int)
    groups = [np.flatnonzero(octave == o) for o in np.unique(octave)]
    trees = [cKDTree(position[group]) for group in groups]
    found = []
    for a, (group, tree) in enumerate(zip(groups, trees, strict=True)):
        reach = radius[group].max() + gap
        pairs = tree.query_pairs(reach + radius[group].max(), output_type="ndarray")
        found.append(group[pairs])
        for larger, other in zip(groups[a + 1 :], trees[a + 1 :], strict=True):
            near = tree.sparse_distance_matrix(
                other, reach + radius[larger].max(), output_type="ndarray"
            )
            found.append(np.column_stack([group[near["i"]], larger[near["j"]]]))
    pair = np.sort(np.concatenate(found).astype(np.int64), axis=1)
    distance = np.linalg.norm(position[pair[:, 0]] - position[pair[:, 1]], axis=1)
    pair = pair[distance < radius[pair].sum(axis=1) + gap]
    return pair[np.lexsort((pair[:, 1], pair[:, 0]))]


def list_wall_rows(
    position: FloatArray, radius: FloatArray, walls: Walls, behind: BoolArray, gap: float
) -> tuple[IntArray, IntArray]:
    """``first`` and ``second`` of all grains nearer than ``gap`` [m] to a wall."""
    from adapters.bed.overlap_kernel import find_wall_rows  # loads the compiler

    first, second = find_wall_rows(position, radius, walls.geometry, behind, gap)
    return first, second


def measure_rows(
    position: FloatArray, radius: FloatArray, first: IntArray, second: IntArray, walls: Walls,
    behind: BoolArray,
) -> Neighbours:  # fmt: skip
    """The given rows with normal and overlap at ``position`` [m], (n, 3)."""
    from adapters.bed.overlap_kernel import fill_rows  # loads the compiler

    normal, overlap = np.empty((len(first), 3)), np.empty(len(first))
    fill_rows(position, radius, first, second, walls.geometry, behind, normal, overlap)
    return Neighbours(first, second, normal, overlap)


def find_pairs(
    position: FloatArray, radius: FloatArray, walls: Walls, gap: float = 0.0,
    behind: BoolArray | None = None,
) -> Neighbours:  # fmt: skip
    """All rows nearer than ``gap`` [m]; with the default, exactly those in contact.

    ``position`` (n, 3) and ``radius`` (n,) in metres; ``behind`` from `find_behind_discs`, of these
    positions when left out.  Raises `UsageError` for shapes or numbers that are no bed.
    """
    position = np.ascontiguousarray(position, float)
    radius = np.ascontiguousarray(radius, float)
    check_bed(position, radius)
    side = find_behind_discs(position, walls) if behind is None else behind
    pair = find_pairs_within(position, radius, gap)
    grain, wall = list_wall_rows(position, radius, walls, side, gap)
    first = np.concatenate([pair[:, 0], grain])
    second = np.concatenate([pair[:, 1], wall])
    return measure_rows(position, radius, first, second, walls, side)


def check_bed(position: FloatArray, radius: FloatArray) -> None:
    """Raise `UsageError` unless these are n finite centres [m] and n positive radii [m]."""
    if radius.ndim != 1 or position.shape != (len(radius), 3):
        raise UsageError(
            f"positions {position.shape} and radii {radius.shape} do not belong together",
            remedy="give one centre (x, y, z) and one radius for each grain",
        )
    # beyond 1e100 m squares overflow: as good as infinite
    bad = ~(np.abs(position) < 1e100).all(axis=1) | ~((radius > 0) & (radius < 1e100))
    if bad.any():
        raise UsageError(
            f"{int(bad.sum())} of {len(radius)} grains have no finite centre or no positive radius",
            where=f"grain {int(np.flatnonzero(bad)[0])} (counted from 0)",
            remedy="check the state that was read, and the law that extrapolated it",
        )


DEEPEST = 0.5
"""Overlap over the smaller radius above which a state is hardly a bed [-]: contacts bear to .05."""


def judge_state(state: State, walls: Walls, where: str) -> str:
    """A sentence on grains so deep in one another that radii and positions hardly belong together.

    Raises `UsageError` for grains outside the ``walls``: this is no bed of theirs.
    """
    check_bed(state.position, state.radius)
    rows = find_pairs(state.position, state.radius, walls)
    at_wall = rows.second < 0
    behind = np.where(at_wall, rows.overlap - state.radius[rows.first], -1.0)
    if (behind > 0).any():
        count, row = len(np.unique(rows.first[behind > 0])), np.argmax(behind)
        raise UsageError(
            f"{count} of {len(state.radius)} grains have their centres outside the walls of the "
            f"scene, grain {state.identifier[rows.first[row]]} by {behind[row]:.3g} m behind "
            f"{list_wall_names(walls)[-1 - rows.second[row]]}: this is no bed of this scene",
            where=where,
            remedy="give its own scene, in the units and the place of the state (floor at z = 0)",
        )
    least = np.minimum(state.radius[rows.first], state.radius[np.maximum(rows.second, 0)])
    share = np.where(at_wall, 0.0, rows.overlap / least)
    if not (share > DEEPEST).any():
        return ""
    row = np.argmax(share)
    first, second = state.identifier[[rows.first[row], rows.second[row]]]
    return (
        f"{where}: grains {first} and {second} lie {share[row]:.2g} of the smaller radius in one "
        f"another, {(share > DEEPEST).sum()} pairs deeper than {DEEPEST:g}: look whether radii are "
        "diameters, and all lengths in one unit"
    )


def measure_bed(position: FloatArray, touching: Neighbours) -> Bed:
    """Coordination number, penetration and height of a bed, from its `find_pairs` in contact."""
    overlap = touching.overlap[touching.overlap > 0]
    pairs = int((touching.second[touching.overlap > 0] >= 0).sum())
    return Bed(
        contacts=len(overlap),
        coordination_number=2 * pairs / max(len(position), 1),
        coordination_with_walls=(len(overlap) + pairs) / max(len(position), 1),
        max_penetration=float(overlap.max(initial=0.0)),
        mean_penetration=float(overlap.mean()) if len(overlap) else 0.0,
        mean_height=float(position[:, 2].mean()) if len(position) else 0.0,
    )
