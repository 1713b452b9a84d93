"""What a step of the small track costs: a short march from its bed, as far as that is prepared.

    python -m validation.track_small scenes/track-small.toml [--steps 400]

Writes ``validation/results/track-small.json``.  Where the bed is not at rest yet the march begins
where its last stage left the grains, on the springs of that stage, and the record says so: there
are contacts, at their cost, as in a bed at rest.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from datetime import UTC, datetime
from pathlib import Path

from qdem_fem.output import write_whole
from qdem_fem.run_folder import machine
from qdem_fem.scene_checks import scene_load
from qdem_fem.simulation import Simulation
from qdem_fem.track_bed import SLEEPER, bed_read, bodies_of_bed, grains_of, sleeper_guide
from qdem_fem.track_scene import TrackPrepared
from validation.track_page import SMALL


def main() -> None:
    """Measure and write the record."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0] if __doc__ else None)
    parser.add_argument("scene", type=Path)
    parser.add_argument("--steps", type=int, default=400)
    arguments = parser.parse_args()
    prepared = scene_load(arguments.scene)
    assert isinstance(prepared, TrackPrepared)
    recipe, table = prepared.recipe, prepared.scene.simulation
    bed = bed_read(prepared.bed_file, recipe)
    bodies = bodies_of_bed(recipe, grains_of(recipe), bed.positions, rigid=False)
    softness = 1.0 if bed.stage in ("hard", "rest") else recipe.softness
    hard, soft = (recipe.contact([*bodies], factor) for factor in (1.0, softness))
    step = Simulation(list(bodies.values()), threads=1, contact=hard).step
    bodies = bodies_of_bed(recipe, grains_of(recipe), bed.positions, rigid=False)
    run = Simulation(
        list(bodies.values()), gravity=recipe.gravity, threads=1, contact=soft, step=step
    )
    sleeper_guide(run, bodies[SLEEPER], upright=False)
    spent = []
    for counted in (False, True):
        run.counts_viscous = counted
        run.advance(20 * run.step)
        started = time.process_time()
        run.advance(arguments.steps * run.step)
        spent.append((time.process_time() - started) / arguments.steps)
    elements = sum(len(body.elements) for body in bodies.values())
    duration = table.duration
    assert duration is not None
    record = {
        "command": f"python -m validation.track_small {Path(sys.argv[1]).name}",
        "machine": machine(),
        "started": datetime.now(UTC).isoformat(timespec="seconds"),
        "elements": elements,
        "nodes": sum(len(body.nodes) for body in bodies.values()),
        "step": run.step,
        "seconds_a_step": spent[0],
        "seconds_a_step_audited": spent[1],
        "mels": elements / spent[0] / 1e6,
        "cpu_a_second": spent[0] / run.step,
        "duration": duration,
        "bogie_cpu": spent[1] * duration / run.step,
        "state": "The bed is at rest."
        if bed.stage == "rest"
        else f"Timed on a bed that is prepared as far as its stage `{bed.stage}`, on that stage's "
        "springs, with the step of Table 1's.",
        "rests": bed.rests,
    }
    write_whole(SMALL, json.dumps(record, indent=1) + "\n")


if __name__ == "__main__":
    main()
