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

from qdem_fem.output import write_whole
from qdem_fem.run_folder import machine
from qdem_fem.scene_checks import scene_load
from qdem_fem.track_bed import bed_read
from qdem_fem.track_scene import TrackPrepared, contact_of
from qdem_fem.track_stand import bed_stand
from validation.track_page import STAND


def stand_facts(scene: Path, duration: float) -> dict[str, Any]:
    """Friction in use at the start; sinking of the sleeper and work of sliders in ``duration`` [s]
    without the load."""
    prepared = scene_load(scene)
    assert isinstance(prepared, TrackPrepared)
    bed = bed_read(prepared.bed_file, prepared.recipe)
    stand = bed_stand(prepared.recipe, bed, contact_of(prepared), duration)
    return {
        "friction": stand.friction,
        "prepared_friction": prepared.recipe.friction,
        "mobilised": {
            "median": stand.median, "at_limit": stand.at_limit, "pairs": float(stand.pairs)
        },
        "elastic": stand.elastic,
        "sinking": stand.sinking,
        "slid": stand.slid,
        "rests": bed.rests,
    }  # fmt: skip


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
