"""The paper's track: its grains fall, a step of it is timed, its memory and its split counted.

    python -m validation.track_paper scenes/track-paper.toml --work FOLDER [--fall 240] [--steps 60]

In FOLDER are kept the grains, and where they are after each sitting of ``--fall`` processor seconds
of the stage ``bed``: another call goes on from there.  Each time the sleeper is laid on what lies
there and the cribs are filled, as the stage ``crib`` begins, and a march of the whole, deformable,
is timed on that stage's springs with the step of Table 1's.  Writes
``validation/results/track-paper.json``.
"""

from __future__ import annotations

import argparse
import json
import resource
import time
from contextlib import suppress
from dataclasses import asdict, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from qdem_fem.grain_set import GrainSet, grains_load, grains_save
from qdem_fem.kinetic_damping import Rest, rest_find
from qdem_fem.mesh_checks import FloatArray
from qdem_fem.output import write_whole
from qdem_fem.run_folder import machine
from qdem_fem.scene_checks import scene_load
from qdem_fem.simulation import Simulation
from qdem_fem.track_bed import ROUGH, Bed, nodes_begin, sleeper_guide
from qdem_fem.track_recipe import SLEEPER, BedRecipe, bodies_of_bed, grains_of
from qdem_fem.track_scene import TrackPrepared
from validation.track_split import split_counts

RECORD = Path(__file__).parent / "results" / "track-paper.json"
WARM = 5
"""Steps before the clock starts."""


class Spent(Exception):
    """The processor time of a sitting is spent."""


def grains_kept(recipe: BedRecipe, path: Path) -> GrainSet:
    """The grains of the scene, made where the file is not there."""
    if path.exists():
        return grains_load(path)
    grains = grains_of(recipe)
    grains_save(path, grains)
    return grains


def fall(
    recipe: BedRecipe, grains: GrainSet, path: Path, seconds: float, threads: int
) -> dict[str, Any]:
    """Go on with the stage ``bed`` for some processor time; what it came to, all sittings together.

    The file ``path`` holds the nodes [m] and what is told.  A sitting begins at rest, and its
    springs anew.
    """
    told: dict[str, Any] = {"cpu_s": 0.0, "steps": 0, "time": 0.0}
    nodes = nodes_begin(recipe, grains, "bed", None)
    if path.exists():
        with np.load(path) as file:
            nodes = np.split(file["nodes"], np.cumsum([len(x) for x in nodes])[:-1])
            told = json.loads(str(file["told"]))
    if seconds <= 0:
        return told
    started = time.process_time()
    bodies = bodies_of_bed(recipe, grains, nodes, rigid=True)
    contact = replace(recipe.contact([*bodies], recipe.softness), contacts=1)
    run = Simulation(
        list(bodies.values()), gravity=recipe.gravity, contact=contact, threads=threads
    )
    begun, last = time.process_time(), None

    def progress(rest: Rest) -> None:
        nonlocal last
        last = rest
        print(f"fall: {asdict(rest)}, {time.process_time() - begun:.0f} s", flush=True)
        if time.process_time() - started >= seconds:
            raise Spent

    with suppress(Spent):
        last = rest_find(run, *ROUGH, recipe.patience, progress)
    assert last is not None
    marched = time.process_time() - begun
    told |= {
        "cpu_s": told["cpu_s"] + time.process_time() - started,
        "steps": told["steps"] + last.steps, "time": told["time"] + last.time,
        "step": run.step, "seconds_a_step": marched / last.steps,
        "unbalanced": last.unbalanced, "kinetic": last.kinetic, "loose": last.loose,
        "rest": all(
            one <= bar
            for one, bar in zip((last.unbalanced, last.kinetic, last.loose), ROUGH, strict=True)
        ),
    }  # fmt: skip
    now = np.concatenate([body.nodes for body in run.bodies])
    now += run.assembly.field("displacement")
    with path.open("wb") as stream:
        np.savez_compressed(stream, nodes=now, told=json.dumps(told))
    return told


def all_laid(recipe: BedRecipe, grains: GrainSet, path: Path) -> list[FloatArray]:
    """Nodes of all bodies [m] as the stage ``crib`` begins on what has fallen so far."""
    loose = nodes_begin(recipe, grains, "bed", None)
    with np.load(path) as file:
        every = file["nodes"]
    fallen = np.split(every, np.cumsum([len(x) for x in loose])[:-1])
    return nodes_begin(recipe, grains, "crib", Bed("bed", fallen, 0 * every, {}, {}))


def step_timed(
    recipe: BedRecipe, grains: GrainSet, nodes: list[FloatArray], steps: int, threads: int
) -> dict[str, Any]:
    """Processor time of a step of all bodies, deformable, the least of three marches; memory."""
    started = time.process_time()
    bodies = bodies_of_bed(recipe, grains, nodes, rigid=False)
    hard, soft = (recipe.contact([*bodies], factor) for factor in (1.0, recipe.softness))
    step = Simulation(list(bodies.values()), threads=1, contact=hard).step
    bodies = bodies_of_bed(recipe, grains, nodes, rigid=False)
    run = Simulation(
        list(bodies.values()), gravity=recipe.gravity, threads=threads, contact=soft, step=step
    )
    sleeper_guide(run, bodies[SLEEPER], upright=False)
    run.advance(WARM * step)
    built = time.process_time() - started
    spent, wall = [], []
    for _ in range(3):
        began, clock = time.process_time(), time.perf_counter()
        run.advance(steps // 3 * step)
        spent.append((time.process_time() - began) / (steps // 3))
        wall.append((time.perf_counter() - clock) / (steps // 3))
    elements = [len(body.elements) for body in run.bodies]
    assert run.contacts is not None
    return {
        "threads": threads, "built_cpu_s": built, "step": step, "seconds_a_step": min(spent),
        "wall_a_step": min(wall), "elements_ballast": sum(elements[:-1]),
        "elements_sleeper": elements[-1],
        "nodes": sum(len(body.nodes) for body in run.bodies),
        "vertices": len(run.contacts.nodes),
        "mels": sum(elements) / min(spent) / 1e6,
        "mels_wall": sum(elements) / min(wall) / 1e6,
        "resident": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024,
    }  # fmt: skip


def main() -> None:
    """Measure and write the record."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0] if __doc__ else None)
    parser.add_argument("scene", type=Path)
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--fall", type=float, default=240.0)
    parser.add_argument("--steps", type=int, default=60)
    parser.add_argument("--threads", type=int, default=1)
    arguments = parser.parse_args()
    prepared = scene_load(arguments.scene)
    assert isinstance(prepared, TrackPrepared)
    recipe = prepared.recipe
    started, cpu = datetime.now(UTC).isoformat(timespec="seconds"), time.process_time()
    made = not (arguments.work / "grains.npz").exists()
    grains = grains_kept(recipe, arguments.work / "grains.npz")
    spent = time.process_time() - cpu
    print(f"{len(grains)} grains, {spent:.0f} s", flush=True)
    kept = arguments.work / "fall.npz"
    fallen = fall(recipe, grains, kept, arguments.fall, arguments.threads)
    nodes = all_laid(recipe, grains, kept)
    print(json.dumps(fallen), flush=True)
    timed = step_timed(recipe, grains, nodes, arguments.steps, arguments.threads)
    print(json.dumps(timed), flush=True)
    record = json.loads(RECORD.read_text(encoding="utf-8")) if RECORD.exists() else {}
    record |= {
        "command": f"python -m validation.track_paper scenes/{arguments.scene.name} "
        f"--work FOLDER --fall {arguments.fall:g}",
        "machine": machine(), "started": started, "fall": fallen,
        "grains": len(grains), "cells": recipe.cells,
        f"march_{arguments.threads}": timed, "heights": heights(recipe, nodes),
        "split": split_counts(recipe, grains, nodes),
    }  # fmt: skip
    if made:
        record["grains_cpu_s"] = spent
    write_whole(RECORD, json.dumps(record, indent=1) + "\n")


def heights(recipe: BedRecipe, nodes: list[FloatArray]) -> dict[str, float]:
    """How high ballast lies under the sleeper: top, and 95 of 100 centres are below `most` [m]."""
    centre = np.array([x.mean(axis=0) for x in nodes[: recipe.below]])
    under = recipe.layout.under(centre)
    return {
        "top": float(nodes[-1][:, 2].min()) - recipe.radius,
        "most": float(np.percentile(centre[under, 2], 95)),
        "length": float(np.ptp(centre[:, 0])),
    }


if __name__ == "__main__":
    main()
