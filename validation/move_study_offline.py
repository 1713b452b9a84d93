"""What a jump moves, judged on full runs without an engine: one jump, the same run's own future.

The environment variable TRACKBED_DATA names a folder with ``full_runs/*.npz``, of which
`jump_without_engine` says what they hold.  Beds are chaotic, so single grains of another run are no
truth; the run itself is, over one jump, and another member tells how far apart two runs' moves are.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from adapters.errors import UsageError
from adapters.jump_field import mean_drop
from adapters.laws import law_named
from adapters.moves import move_named, moves_known
from adapters.overlaps import Bed, bed_measure, neighbours
from adapters.relaxation import RelaxationNotConverged, relax
from adapters.scene import Scene
from adapters.scene_file import scene_load
from adapters.state import FloatArray, State
from scenes import scene_path
from validation.cases.jump_without_engine import data_folder

Row = dict[str, Any]
LAW = law_named("log")
KEPT_SHARE = 0.99
"""Grains of which the field's error is told: the others carry half of the squared displacement."""
OTHER_MEMBER = "another member"
"""Stands for a way: the moves, over the same cycles, of a run that began 1e-10 m apart."""


@dataclass(frozen=True)
class FullRun:
    """A stored run: positions at the end of every cycle."""

    name: str
    scene_name: str
    starts: tuple[int, ...]
    """First cycles k_i of the windows."""
    twin: str = ""
    """A run of another member."""

    def scene(self) -> Scene:
        """The scene whose walls and materials are the run's."""
        return scene_load(scene_path(self.scene_name), [])

    def jumps(self, cycles: int) -> Iterator[tuple[int, int, int]]:
        """(k_i, k, h) that a run of so many cycles is long enough for."""
        for k in (20, 50):
            for k_i in self.starts:
                yield from ((k_i, k, h) for h in (k, 2 * k) if k_i + k + h <= cycles)


PAPER_STARTS = (10, 30, 50, 80, 120, 170)
RUNS = (
    FullRun("paper_scale_a", "karrech", PAPER_STARTS, twin="paper_scale_b"),
    FullRun("paper_scale_b", "karrech", PAPER_STARTS, twin="paper_scale_a"),
    FullRun("coarse_bursty", "karrech-coarse", (30, 60, 100, 150, 200, 300, 400, 500, 600, 750)),
)


def positions_read(name: str) -> tuple[FloatArray, FloatArray]:
    """Centres at all cycle ends [m], shape (cycles + 1, n, 3), and radii [m], shape (n,).

    Raises `UsageError` where TRACKBED_DATA does not name the folder.
    """
    folder = data_folder()
    if folder is None:
        raise UsageError("the full runs are not there", remedy="set TRACKBED_DATA to their folder")
    with np.load(folder / "full_runs" / f"{name}.npz") as data:
        displacement = 1e-6 * data["displacement_um"].astype(float)
        return data["initial_position_m"] + displacement, data["radius_m"].astype(float)


def states_at(scene: Scene, position: FloatArray, radius: FloatArray) -> State:
    """A state of the run at rest; the piston's face on the highest grain, where it must be."""
    top = float((position[:, 2] + radius).max())
    still = np.zeros_like(position)
    mass = 4 / 3 * np.pi * scene.material.grain.density * radius**3
    names = np.arange(1, len(radius) + 1)
    return State(names, position, radius, mass, still, still, piston_height=top)


def field_errors(move: FloatArray, truth: FloatArray) -> Row:
    """How far moves (n, 3) [m] are from the true ones: mean, field, single grains, lengths.

    ``field`` is eq. 22 over the `KEPT_SHARE` of grains that truly move least, ``field_all`` over
    all; 1 is what moving nothing has.  ``median`` is the median distance over the median move.
    """
    true, missed = np.linalg.norm(truth, axis=1), np.linalg.norm(move - truth, axis=1)
    kept = true <= np.quantile(true, KEPT_SHARE)
    length = np.linalg.norm(move, axis=1)
    shares = (0.5, 0.9, 0.99)
    return {
        "mean_error": float((move - truth)[:, 2].mean() / abs(truth[:, 2].mean())),
        "field": float(np.linalg.norm(missed[kept]) / np.linalg.norm(true[kept])),
        "field_all": float(np.linalg.norm(missed) / np.linalg.norm(true)),
        "median": float(np.median(missed) / np.median(true)),
        "quantiles": [float(np.quantile(length, q) / np.quantile(true, q)) for q in shares],
    }


def bed_row(bed: Bed, name: str) -> Row:
    """Contacts and overlaps of a bed under the name of the instant."""
    return {
        f"coordination_{name}": bed.coordination_with_walls,
        f"overlap_max_{name}": bed.max_penetration,
        f"overlap_mean_{name}": bed.mean_penetration,
    }


def jump_row(
    run: FullRun,
    jump: tuple[int, int, int],
    way: str,
    position: FloatArray,
    radius: FloatArray,
    twin: FloatArray | None,
) -> Row:
    """One jump one way: its errors, its bed before and after relaxation, its cost."""
    k_i, k, h = jump
    scene, first, last = run.scene(), k_i + k, k_i + k + h
    cycle, window = np.arange(k_i, first + 1.0), position[k_i : first + 1]
    before = states_at(scene, position[first], radius)
    after = states_at(scene, position[last], radius)
    walls = scene.container.walls(before.piston_height)
    start = time.process_time()
    drop = 0.0
    if way == OTHER_MEMBER:
        assert twin is not None
        move = twin[last] - twin[first]
        drop = after.piston_height - before.piston_height
    else:
        chosen = move_named(way)
        move = chosen.displacement(cycle, window, radius, LAW, h, scene.container)
        tops = (window[:, :, 2] + radius).max(axis=1)[:, None, None] * np.ones(3)
        drop = min(mean_drop(cycle, tops, LAW, h), 0.0) if chosen.moves_piston else 0.0
    cost = time.process_time() - start
    walls_after = scene.container.walls(before.piston_height + drop)
    try:
        result = relax(
            before.position + move, before, walls, scene.stiffness, walls_after=walls_after
        )
    except RelaxationNotConverged as error:
        result = error.best
    truth = position[last] - position[first]
    relaxed = field_errors(result.position - before.position, truth)
    touching = neighbours(position[last], radius, scene.container.walls(after.piston_height))
    return {
        "run": run.name,
        "jump": list(jump),
        "move": way,
        **field_errors(move, truth),
        "settlement_um": -1e6 * float(truth[:, 2].mean()),
        **bed_row(result.before, "before"),
        **bed_row(result.estimated, "estimated"),
        **bed_row(result.relaxed, "relaxed"),
        **bed_row(bed_measure(position[last], touching), "true"),
        "field_relaxed": relaxed["field"],
        "median_relaxed": relaxed["median"],
        "relaxed": result.converged,
        "pushed_median": result.median_move,
        "pushed_most": result.largest_move,
        "move_s": cost,
        "relax_s": result.cpu_s,
    }


def rows_offline(done: set[tuple[Any, ...]]) -> Iterator[Row]:
    """All rows that are not ``done`` (run, jump, way), one by one."""
    for run in RUNS:
        position, radius = positions_read(run.name)
        twin = positions_read(run.twin)[0] if run.twin else None
        for jump in run.jumps(len(position) - 1):
            ways = list(moves_known())
            if twin is not None and sum(jump) < len(twin):
                ways.append(OTHER_MEMBER)
            for way in ways:
                if (run.name, jump, way) not in done:
                    yield jump_row(run, jump, way, position, radius, twin)
