"""Whether prepared beds stand: a short march without their load, and how much friction they use.

    python -m validation.track_stand scenes/track-small.toml [ANOTHER.toml ...] [--time 2e-3]

Kinetic damping stops what moves, so a bed whose grains lie at Coulomb's limit passes for one at
rest, and creeps when it is let go.  Writes ``validation/results/track-stand.json``, by scene.
"""

from __future__ import annotations

import argparse
import json
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from qdem_fem.contact_sphere_state import SphereContacts
from qdem_fem.contact_spheres import pair_stiffness
from qdem_fem.output import write_whole
from qdem_fem.run_folder import machine
from qdem_fem.scene_build import simulation_of
from qdem_fem.scene_checks import scene_load
from qdem_fem.simulation import Simulation
from qdem_fem.track_bed import SLEEPER, BedRecipe, bed_read
from qdem_fem.track_scene import TrackPrepared
from validation.track_page import STAND

NEARLY = 0.99
"""Of Coulomb's limit, what counts as being there."""


def mobilised(run: Simulation, recipe: BedRecipe, friction: float) -> dict[str, float]:
    """Median of ``|F_t|/(mu F_n)`` of pairs that touch, share of them near Coulomb's limit [-], and
    their number.

    ``F_n`` is k_n times the overlap; what else there is of the force is across it.
    """
    assert isinstance(run.contacts, SphereContacts)
    run.contacts.refresh()
    found = run.contacts.touching()
    sleeper = np.maximum(found.first, found.second) >= run.first_node[-2]
    push = found.overlap * np.where(sleeper, pair_stiffness(*recipe.stiffness), recipe.stiffness[0])
    across = np.sqrt(np.maximum((found.force**2).sum(axis=1) - push**2, 0.0))
    share = across / (friction * push)
    return {
        "median": float(np.median(share)),
        "at_limit": float((share > NEARLY).mean()),
        "pairs": float(len(share)),
    }


def stand_facts(scene: Path, duration: float) -> dict[str, Any]:
    """Friction in use at the start; sinking of the sleeper and work of sliders in ``duration`` [s]
    without the load."""
    prepared = scene_load(scene)
    assert isinstance(prepared, TrackPrepared)
    assert prepared.scene.contact is not None
    friction = prepared.scene.contact.friction
    run, bodies = simulation_of(prepared)
    at_start = mobilised(run, prepared.recipe, friction)
    for load in list(run.conditions.loads):
        run.remove(load)
    before = bodies[SLEEPER].displacement[:, 2].mean()
    energy = run.energy()
    run.advance(duration)
    return {
        "friction": friction,
        "prepared_friction": prepared.recipe.friction,
        "mobilised": at_start,
        "elastic": energy.elastic + energy.contact,
        "sinking": float(before - bodies[SLEEPER].displacement[:, 2].mean()),
        "slid": run.energy().friction,
        "rests": bed_read(prepared.bed_file, prepared.recipe).rests,
    }


def main() -> None:
    """March each scene's bed and write the record."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0] if __doc__ else None)
    parser.add_argument("scene", type=Path, nargs="+")
    parser.add_argument("--time", type=float, default=2e-3)
    arguments = parser.parse_args()
    names = " ".join(path.name for path in arguments.scene)
    record = {
        "command": f"python -m validation.track_stand {names} --time {arguments.time:g}",
        "machine": machine(),
        "started": datetime.now(UTC).isoformat(timespec="seconds"),
        "time": arguments.time,
        "beds": {path.name: stand_facts(path, arguments.time) for path in arguments.scene},
    }
    write_whole(STAND, json.dumps(record, indent=1) + "\n")


if __name__ == "__main__":
    main()
