"""A bed that is to be relaxed, what grains may touch in it, and what a relaxation changed."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from adapters.bed import (
    GRAVITY,
    Bed,
    BoolArray,
    FloatArray,
    HertzStiffness,
    IntArray,
    Neighbours,
    State,
    Walls,
    check_bed,
    find_behind_discs,
    find_normal_force,
    find_overlap_under_force,
    find_pairs,
    list_wall_names,
    measure_bed,
    measure_rows,
)
from adapters.errors import NotConverged, UsageError


@dataclass(frozen=True)
class Surroundings:
    """What does not change while the centres of ``n`` grains move."""

    radius: FloatArray  # radii [m], (n,)
    walls: Walls
    behind: BoolArray
    """Which grains lie behind each plane that ends, (n, p): `adapters.bed.find_behind_discs`."""
    stiffness: HertzStiffness

    def rows(self, position: FloatArray, first: IntArray, second: IntArray) -> Neighbours:
        """The given rows at ``position`` [m], (n, 3)."""
        return measure_rows(position, self.radius, first, second, self.walls, self.behind)

    def search(self, position: FloatArray, gap: float) -> Neighbours:
        """All rows nearer than ``gap`` [m] at ``position`` [m], (n, 3)."""
        return find_pairs(position, self.radius, self.walls, gap, self.behind)

    def reorder(self, order: IntArray) -> Surroundings:
        """The same with the grains in another order."""
        return Surroundings(self.radius[order], self.walls, self.behind[order], self.stiffness)

    def row_stiffness(self, rows: Neighbours) -> FloatArray:
        """lambda = 4/3 E* sqrt(R*) of each row [N/m^1.5]."""
        modulus_of_wall = np.array(
            [
                self.stiffness.mirror if mirror else self.stiffness.wall
                for mirror in self.walls.plane_frictionless
            ]
            + [self.stiffness.wall]
        )
        pair = rows.second >= 0
        other = np.where(pair, self.radius[np.where(pair, rows.second, 0)], np.inf)
        modulus = np.where(
            pair, self.stiffness.grain, modulus_of_wall[np.where(pair, 0, -1 - rows.second)]
        )
        radius = 1 / (1 / self.radius[rows.first] + 1 / other)
        return np.asarray(find_normal_force(1.0, 1.0, radius) * modulus)


@dataclass(frozen=True)
class Relaxation:
    """Relaxed positions, and what was changed to reach them."""

    position: FloatArray  # centres [m], (n, 3)
    method: str  # one of `METHODS`
    converged: bool
    before: Bed  # measures of the state before the jump
    estimated: Bed  # measures of the estimated positions
    relaxed: Bed  # measures of the relaxed positions
    evaluations: int
    """Evaluations of all contacts; for ``smallest-move`` products with its matrix count too."""
    cpu_s: float  # processor time [s]
    largest_move: float  # greatest distance of a grain from its estimate [m]
    median_move: float  # median distance of a grain from its estimate [m]

    @property
    def coordination_change(self) -> float:
        """Relative change of the coordination number over the jump; a sound jump stays in 3 %."""
        before = self.before.coordination_with_walls
        return self.relaxed.coordination_with_walls / before - 1 if before else 0.0

    def record(self) -> dict[str, Any]:
        """All but the positions, for the run folder and the command line."""
        record = asdict(self)
        del record["position"]
        record["coordination_change"] = self.coordination_change
        return record


class RelaxationNotConverged(NotConverged):
    """A relaxation stopped short of its tolerance; ``best`` is what it had reached."""

    best: Relaxation


@dataclass(frozen=True)
class Estimated:
    """The bed that a jump estimates, the state it came from, and what both touch."""

    position: FloatArray  # estimated centres [m], (n, 3)
    before: State
    scene_before: Surroundings
    scene: Surroundings  # the same with the piston where it is now
    carried: Neighbours  # contacts of ``before``

    @property
    def mean_weight(self) -> float:
        """Mean weight of a grain [N]."""
        return GRAVITY * float(self.before.mass.mean())

    @property
    def length(self) -> float:
        """Overlap of two mean grains under the mean weight [m]."""
        stiffness, radius = self.scene.stiffness.grain, self.scene.radius.mean()
        return float(find_overlap_under_force(self.mean_weight, stiffness, radius / 2))


def make_estimate(
    position: FloatArray, before: State, walls: Walls, walls_after: Walls | None,
    stiffness: HertzStiffness,
) -> Estimated:  # fmt: skip
    """Arguments of `relax` taken together; raises `UsageError` for what is no bed."""
    position = np.ascontiguousarray(position, float)
    radius = np.ascontiguousarray(before.radius, float)
    after = walls if walls_after is None else walls_after
    check_bed(position, radius)
    if list_wall_names(after) != list_wall_names(walls):
        raise UsageError(
            f"walls before, {list_wall_names(walls)}, are not {list_wall_names(after)} after",
            remedy="the same walls belong to both; a piston may only move",
        )
    if not len(radius):
        raise UsageError("a relaxation wants grains")
    behind = find_behind_discs(before.position, walls)
    scene_before = Surroundings(radius, walls, behind, stiffness)
    scene = Surroundings(radius, after, behind, stiffness)
    carried = scene_before.search(before.position, 0.0)
    return Estimated(position, before, scene_before, scene, carried)


def measure_relaxation(
    bed: Estimated, relaxed: FloatArray, method: str, converged: bool, evaluations: int,
    started: float,
) -> Relaxation:  # fmt: skip
    """What a relaxation to ``relaxed`` (n, 3) [m] changed, ``started`` at a CPU time [s]."""
    before, scene = bed.before, bed.scene
    move = np.linalg.norm(relaxed - bed.position, axis=1)
    return Relaxation(
        position=relaxed, method=method, converged=converged,
        before=measure_bed(before.position, bed.carried),
        estimated=measure_bed(bed.position, scene.search(bed.position, 0.0)),
        relaxed=measure_bed(relaxed, scene.search(relaxed, 0.0)), evaluations=evaluations,
        cpu_s=time.process_time() - started, largest_move=float(move.max()),
        median_move=float(np.median(move)),
    )  # fmt: skip
