"""The runs: a packing on every way, and the settled bed timed on every engine: ``PARTS``."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import asdict
from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from adapters.bed.state import FloatArray
from adapters.engines.contract import get_engine
from adapters.errors import TrackbedError
from validation.studies.engines.packing import SEEDS, WAYS, Way, pour_bed, run_way
from validation.studies.engines.speed import (
    count_contacts,
    load_tiles,
    mirror_tiles,
    run_bed,
    settle_tile,
)

Row = dict[str, Any]
SPEED = {(1, 1): (500, 4500), (3, 3): (100, 600)}
"""Tiles along x and y -> steps of the short and of the long run."""
REPEATS = 5
ENGINES = ("liggghts", "lammps", "yade")


@cache
def make_start(seed: int) -> tuple[FloatArray, FloatArray]:
    """The rained bed of a seed: positions (n, 3), radii (n,) [m]."""
    with TemporaryDirectory() as temporary:
        return pour_bed(seed, Path(temporary) / "rain")


def settle_packing(way: Way, seed: int) -> Row:
    """One way on one bed; a run that failed says why."""
    position, radius = make_start(seed)
    scene = way.scene(seed)
    row: Row = {"way": way.name, "seed": seed, "ok": True, "why": ""}
    with TemporaryDirectory() as temporary:
        try:
            figures, cpu_s = run_way(way, seed, position, radius, Path(temporary))
            row |= asdict(figures) | {"engine_cpu_s": cpu_s}
        except TrackbedError as error:
            row |= {"ok": False, "why": str(error)}
    row |= {"grains": scene.grain_count, "steps_per_cycle": scene.steps_per_cycle}
    return row | {"engine": way.make_engine().version()}


def time_engine(engine: str, tiles: tuple[int, int], repeat: int) -> Row:
    """CPU time of the steps between a short and a long run of the settled bed."""
    home = Path(os.environ.get("TRACKBED_VALIDATION", "validation-runs")) / "engines"
    home.mkdir(parents=True, exist_ok=True)
    position, radius = mirror_tiles(*settle_tile(home), tiles)
    scene, (short, long) = load_tiles(engine, tiles), SPEED[tiles]
    with TemporaryDirectory(dir=home) as temporary:
        runs = [
            run_bed(scene, position, radius, steps, Path(temporary) / str(steps))
            for steps in (short, long)
        ]
    cost = runs[1][0] - runs[0][0]
    return {
        "speed": engine,
        "grains": len(radius),
        "steps": [short, long],
        "repeat": repeat,
        "steps_cpu_s": cost,
        "start_up_s": runs[0][0] - cost * short / (long - short),
        "contacts_per_grain": count_contacts(runs[1][1]),
        "engine": get_engine(engine).version(),
    }


def list_parts() -> dict[str, Callable[[], Row]]:
    """All ways on the first beds, then on the others: a study cut short has fewer beds."""
    parts: dict[str, Callable[[], Row]] = {}
    for seeds in (SEEDS[:5], SEEDS[5:]):
        for way in WAYS:
            for seed in seeds:
                parts[f"{way.name}, bed {seed}"] = partial(settle_packing, way, seed)
    for repeat in range(REPEATS):
        for tiles in SPEED:
            for engine in ENGINES:
                name = f"speed, {engine}, {tiles[0]} x {tiles[1]} tiles, {repeat}"
                parts[name] = partial(time_engine, engine, tiles, repeat)
    return parts


PARTS = list_parts()
