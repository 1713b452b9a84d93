"""What `trackbed advise SCENE --check` says of a track, as a record.

    python -m validation.advise_track scenes/track-small.toml --duration 0.1

Prepares the bed where its file is not there.  Writes ``validation/results/advise-track.json``;
docs/qdem-bodies.md shows it.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from qdem_fem.advise_check import advice_check, advise_scene
from qdem_fem.output import write_whole
from qdem_fem.run_folder import machine

RECORD = Path(__file__).parent / "results" / "advise-track.json"
TOLERANCE = 0.01


def main() -> None:
    """Advise, check, write the record."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0] if __doc__ else None)
    parser.add_argument("scene", type=Path)
    parser.add_argument("--duration", type=float, default=0.1, help="of both runs [s]")
    arguments = parser.parse_args()
    marks = [f"simulation.duration={arguments.duration}", "simulation.threads=1"]
    started = datetime.now(UTC).isoformat(timespec="seconds")
    advice = advise_scene(arguments.scene, marks, TOLERANCE)
    checked = advice_check(arguments.scene, marks, advice)
    *grains, sleeper = advice
    errors = [one.error for one in grains]
    record = {
        "command": f"python -m validation.advise_track scenes/{arguments.scene.name} "
        f"--duration {arguments.duration:g}",
        "machine": machine(), "started": started, "duration": arguments.duration,
        "grains": len(grains), "rigid": sum(one.rigid for one in advice),
        "error_least": min(errors), "error_median": float(np.median(errors)),
        "error_greatest": max(errors), "sleeper": asdict(sleeper), "check": asdict(checked),
    }  # fmt: skip
    write_whole(RECORD, json.dumps(record, indent=1) + "\n")


if __name__ == "__main__":
    main()
