"""What a step of the small track costs, and what it consists of: a short march from its bed.

    python -m validation.track_small scenes/track-small.toml [--steps 300]

Writes ``validation/results/track-small.json``.  One thread and two take turns within one process,
three times; the medians are kept.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from qdem_fem.assembly import NO_LOADS, NO_PROBES
from qdem_fem.contact_spheres import CONTACTS
from qdem_fem.contact_step import allowed_bound, step_with_contact
from qdem_fem.contact_window import advance_of
from qdem_fem.output import write_whole
from qdem_fem.run_folder import machine
from qdem_fem.scene_build import simulation_of
from qdem_fem.scene_checks import scene_load
from qdem_fem.simulation import Simulation
from qdem_fem.track_bed import bed_read
from qdem_fem.track_scene import TrackPrepared
from validation.track_page import SMALL

ROUNDS = 3


def seconds(work: Callable[[], object], times: int) -> tuple[float, float]:
    """Wall and processor time that one of so many calls takes [s]."""
    wall, spent = time.perf_counter(), time.process_time()
    for _ in range(times):
        work()
    return (time.perf_counter() - wall) / times, (time.process_time() - spent) / times


def parts_of(run: Simulation, times: int) -> dict[str, float]:
    """Processor time of the parts of a step on one thread [s]."""
    assembly, contacts = run.assembly, run.contacts
    assert contacts is not None
    state, held = assembly.state, run.packed_lists()[1]
    nothing, work = np.ones((2, 1)), np.zeros(3)
    for name in ("displacement", "velocity"):
        getattr(assembly.scratch, name)[:] = getattr(state, name)
    still = assembly.scratch
    done: dict[str, Callable[[], Any]] = {
        "elements and motion": lambda: assembly.kernel_run(
            still, 1, 0.0, NO_LOADS, held, NO_PROBES, nothing, None, work
        ),
        "contact": lambda: advance_of(
            contacts.kernel, None, state.displacement, state.velocity, 0.0
        ),
        "a search for pairs": contacts.pairs_find,
    }
    for one in done.values():
        one()  # the first call may compile
    return {name: seconds(one, times)[1] for name, one in done.items()}


def main() -> None:
    """Measure and write the record."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0] if __doc__ else None)
    parser.add_argument("scene", type=Path)
    parser.add_argument("--steps", type=int, default=300)
    arguments = parser.parse_args()
    runs = {}
    for threads in (1, 2):
        prepared = scene_load(arguments.scene, [f"simulation.threads={threads}"])
        assert isinstance(prepared, TrackPrepared)
        runs[threads], _ = simulation_of(prepared)
        runs[threads].advance(20 * runs[threads].step)  # the first steps compile
        if runs[threads].assembly.threads != threads:
            sys.exit("two threads are to be measured: NUMBA_NUM_THREADS=2")
    found: dict[int, list[tuple[float, float]]] = {1: [], 2: []}
    for _ in range(ROUNDS):
        for threads, run in runs.items():
            march = lambda run=run: run.advance(arguments.steps * run.step)  # noqa: E731
            found[threads].append(seconds(march, 1))
    wall, spent = (
        {n: float(np.median([one[i] for one in found[n]])) / arguments.steps for n in found}
        for i in (0, 1)
    )
    one, two = runs[1], runs[2]
    same = all(
        np.array_equal(one.assembly.field(name), two.assembly.field(name))
        for name in ("displacement", "velocity")
    )
    contacts, elements = one.contacts, one.elements_critical_step.value
    assert contacts is not None
    three = allowed_bound(contacts.one, contacts.inverse_mass, CONTACTS)
    duration = prepared.scene.simulation.duration
    assert duration is not None
    assert isinstance(prepared, TrackPrepared)
    record = {
        "command": f"python -m validation.track_small {arguments.scene.name}",
        "machine": machine(),
        "started": datetime.now(UTC).isoformat(timespec="seconds"),
        "elements": len(one.assembly.elements),
        "nodes": len(one.assembly.mass),
        "step": one.step,
        "step_three": one.safety * step_with_contact(elements, three, viscous=one.viscous),
        "step_elements": one.safety * elements,
        "wall_a_step": wall,
        "cpu_a_step": spent,
        "same_bits": same,
        "parts": parts_of(one, arguments.steps // 10),
        "duration": duration,
        "rests": bed_read(prepared.bed_file, prepared.recipe).rests,
    }
    write_whole(SMALL, json.dumps(record, indent=1) + "\n")


if __name__ == "__main__":
    main()
