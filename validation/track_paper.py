"""The paper's track at rest: what its preparation cost, how it lies, what a step of it costs.

    trackbed qdem scenes/track.toml     prepares the bed, in hours; stop it in the run
    python -m validation.track_paper scenes/track.toml [--steps 300] [--threads 1 2]

Reads the bed in the scene's file, times a march from it and the march's parts, looks how long a
list of pairs is good for while both rail seats bear an axle that was put on them at once, and
counts what a split over processes would tell.  Writes ``validation/results/track-paper.json``.
"""

from __future__ import annotations

import argparse
import json
import resource
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from qdem_fem.contact_sphere_state import SphereContacts
from qdem_fem.contact_spheres import CONTACTS
from qdem_fem.contact_step import allowed_bound, step_with_contact
from qdem_fem.kinetic_damping import bodies_of
from qdem_fem.output import write_whole
from qdem_fem.run_folder import machine
from qdem_fem.scene_checks import scene_load
from qdem_fem.simulation import Simulation
from qdem_fem.track_bed import STAGES, Bed, bed_read
from qdem_fem.track_recipe import SLEEPER, BedRecipe, grains_of
from qdem_fem.track_scene import TrackPrepared, contact_of
from qdem_fem.track_stand import bed_begin
from validation.track_lie import measures_of, solid_share, standing_alone
from validation.track_small import parts_of, seconds
from validation.track_split import split_counts

RECORD = Path(__file__).parent / "results" / "track-paper.json"
WARM = 20
"""Steps before the clock starts."""
MARCHES = 5
AXLE = 50e3
"""Force on each rail seat [N], of an axle of 100 kN."""


def shape_of(recipe: BedRecipe, bed: Bed) -> dict[str, float]:
    """How the ballast lies [m], how many grains stand alone, how many of them higher than the
    sleeper's top, and the share of it that is solid.

    The share is that of the ballast under the sleeper, two radii from its bottom and the ground.
    """
    *grains, sleeper = bed.positions
    period = recipe.layout.box.width if recipe.periodic else None
    apart = 2 * recipe.radius
    low, high = sleeper.min(axis=0), sleeper.max(axis=0)
    under = np.array([[low[0], low[1], apart], [high[0], high[1], low[2] - recipe.radius - apart]])
    alone = standing_alone(grains, period)
    on_it = [grains[i].mean(axis=0)[2] > high[2] for i in alone]
    return measures_of(grains, recipe.radius) | {
        "below_sleeper": float(low[2]) - recipe.radius,
        "alone": len(alone),
        "alone_on_sleeper": int(np.sum(on_it)),
        "solid": solid_share(grains, recipe.radius, under, period),
    }


def contacts_of(run: Simulation) -> dict[str, float]:
    """Pairs in the list and of those that touch, and bodies touched by a body in the mean."""
    assert isinstance(run.contacts, SphereContacts)
    found = run.contacts.touching()
    one, other = bodies_of(run, found.first), bodies_of(run, found.second)
    pairs = np.unique(np.sort(np.column_stack([one, other]), axis=1), axis=0)
    return {
        "listed": len(run.contacts.pairs.second),
        "touching": len(found.first),
        "coordination": 2 * len(pairs) / len(run.bodies),
        "deepest": float(found.overlap.max()),
    }


def step_timed(run: Simulation, steps: int) -> dict[str, Any]:
    """What a step costs by the clock and the processor [s], medians of `MARCHES`; its parts."""
    run.advance(WARM * run.step)
    assert run.contacts is not None
    searched = run.contacts.renewals
    each = steps // MARCHES
    found = [seconds(lambda: run.advance(each * run.step), 1) for _ in range(MARCHES)]
    wall, spent = np.median(found, axis=0) / each
    elements = len(run.assembly.elements)
    return {
        "step": run.step, "steps": steps, "wall_a_step": wall, "seconds_a_step": spent,
        "mels": elements / spent / 1e6, "mels_wall": elements / wall / 1e6,
        "searches": run.contacts.renewals - searched,
        "parts": parts_of(run, max(3, each // 5)),
        "resident": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024,
    }  # fmt: skip


def axle_put_on(run: Simulation, steps: int) -> dict[str, float]:
    """Lists of pairs that were looked for, and how fast the sleeper came down [m/s].

    Both seats bear an axle at once, from one step to the next: no train is as sudden.
    """
    sleeper = next(body for body in run.bodies if body.name == SLEEPER)
    assert run.contacts is not None
    for name, nodes in sleeper.mesh.node_sets.items():
        if name.startswith("seat"):
            run.load(sleeper, nodes, [0.0, 0.0, -AXLE])
    searched, begun = run.contacts.renewals, run.time
    before = sleeper.displacement[:, 2].mean()
    run.advance(steps * run.step)
    way = before - float(sleeper.displacement[:, 2].mean())
    return {
        "force": AXLE, "steps": steps, "searches": run.contacts.renewals - searched,
        "way": way, "speed": way / (run.time - begun),
    }  # fmt: skip


def step_any(run: Simulation) -> float:
    """The step [s] that a run would take with room for `CONTACTS` contacts of every vertex."""
    assert run.contacts is not None
    bound = allowed_bound(run.contacts.one, run.contacts.inverse_mass, CONTACTS)
    elements = run.elements_critical_step.value
    return run.safety * step_with_contact(elements, bound, viscous=run.viscous)


def run_of(prepared: TrackPrepared, bed: Bed, threads: int) -> Simulation:
    """The scene's simulation in its bed, without its load."""
    table = prepared.scene.simulation
    return bed_begin(
        prepared.recipe, bed, contact_of(prepared), strain=table.strain, step=table.step,
        safety=table.safety, threads=threads, mass_scaling=table.mass_scaling,
    )[0]  # fmt: skip


def main() -> None:
    """Measure and write the record."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0] if __doc__ else None)
    parser.add_argument("scene", type=Path)
    parser.add_argument("--steps", type=int, default=300)
    parser.add_argument("--threads", type=int, nargs="+", default=[1])
    arguments = parser.parse_args()
    prepared = scene_load(arguments.scene)
    assert isinstance(prepared, TrackPrepared)
    recipe = prepared.recipe
    bed = bed_read(prepared.bed_file, recipe)
    if bed.stage != STAGES[-1]:
        sys.exit(f"{prepared.bed_file} is at stage {bed.stage}: `trackbed qdem` goes on from there")
    record: dict[str, Any] = {
        "command": f"python -m validation.track_paper scenes/{arguments.scene.name} --steps "
        f"{arguments.steps} --threads {' '.join(map(str, arguments.threads))}",
        "machine": machine(),
        "started": datetime.now(UTC).isoformat(timespec="seconds"),
    }
    made: list[Any] = []
    record["grains_cpu_s"] = seconds(lambda: made.append(grains_of(recipe)), 1)[1]
    record |= {
        "grains": len(made[0]), "cells": recipe.cells, "rests": bed.rests, "stands": bed.stands,
        "shape": shape_of(recipe, bed), "split": split_counts(recipe, made[0], bed.positions),
        "marches": {},
    }  # fmt: skip
    for threads in arguments.threads:
        begun: list[Simulation] = []
        built = seconds(lambda: begun.append(run_of(prepared, bed, threads)), 1)[1]  # noqa: B023
        run = begun[0]
        if not record["marches"]:
            elements = [len(body.elements) for body in run.bodies]
            record |= {
                "elements_ballast": sum(elements[:-1]), "elements_sleeper": elements[-1],
                "nodes": sum(len(body.nodes) for body in run.bodies),
                "vertices": len(run.contacts.nodes) if run.contacts else 0,
                "contacts": contacts_of(run), "step_any": step_any(run),
            }  # fmt: skip
        timed = {"threads": run.assembly.threads, "built_cpu_s": built}
        record["marches"][str(threads)] = timed | step_timed(run, arguments.steps)
        print(json.dumps(record["marches"][str(threads)]), flush=True)
        if threads == arguments.threads[0]:
            record["axle"] = axle_put_on(run, arguments.steps)
    write_whole(RECORD, json.dumps(record, indent=1) + "\n")


if __name__ == "__main__":
    main()
