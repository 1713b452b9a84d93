"""Rest of 20 grains under a periodic width: bodies stopped one by one, or all together.

    python -m validation.track_periodic    writes validation/results/track-periodic.json

The stages on soft springs once, then the last two both ways, each for at most `LIMIT`.
"""

from __future__ import annotations

import json
import tempfile
import time
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from unittest import mock

from qdem_fem import track_bed
from qdem_fem.errors import NotConverged
from qdem_fem.kinetic_damping import Rest, rest_find
from qdem_fem.output import write_whole
from qdem_fem.run_folder import machine
from qdem_fem.track_bed import STAGES, Bed, stage_run
from qdem_fem.track_recipe import BedRecipe, grains_of
from validation.track_trials import scene_at

RECORD = Path(__file__).parent / "results" / "track-periodic.json"
LIMIT = 0.12
"""Simulated time of a stage on hard springs [s]."""
WIDTH = 'contact.periodic={axis="y", width=0.42}'


def last_stages(recipe: BedRecipe, firm: Bed, each: bool) -> dict[str, Any]:
    """What the stages ``hard`` and ``rest`` come to from a firm bed."""
    found: dict[str, Any] = {}

    def find(run: Any, *shares: Any, **_: Any) -> Rest:
        last: list[Rest] = []
        began = time.process_time()
        try:
            bars = shares[0], shares[1], shares[2]
            last.append(rest_find(run, *bars, LIMIT, last.append, each=each))
            found[stage] = {"reached": True}
        except NotConverged:
            found[stage] = {"reached": False}
        found[stage] |= {**asdict(last[-1]), "cpu_s": time.process_time() - began}
        return last[-1]

    bed = firm
    for stage in STAGES[-2:]:
        with mock.patch.object(track_bed, "rest_find", find):
            bed = stage_run(recipe, grains_of(recipe), stage, bed, 1, None)
        if not found[stage]["reached"]:
            break
    return found


def main() -> None:
    """Measure and write the record."""
    with tempfile.TemporaryDirectory() as name:
        recipe = scene_at(Path(name), WIDTH).recipe
    started = datetime.now(UTC).isoformat(timespec="seconds")
    bed = None
    for stage in STAGES[:-2]:
        bed = stage_run(recipe, grains_of(recipe), stage, bed, 1, None)
    assert bed is not None
    record = {
        "command": "python -m validation.track_periodic", "machine": machine(), "started": started,
        "soft": bed.rests, "one by one": last_stages(recipe, bed, True),
        "all together": last_stages(recipe, bed, False),
    }  # fmt: skip
    write_whole(RECORD, json.dumps(record, indent=1) + "\n")


if __name__ == "__main__":
    main()
