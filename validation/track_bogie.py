"""What a bogie does to the small track: figures of finished runs of its scene.

    trackbed qdem scenes/track-small.toml --run-folder run
    python -m validation.track_bogie scenes/track-small.toml run [ANOTHER ...]

Writes ``validation/results/track-bogie.json``, by the name of each run's folder: settlement at each
passage of an axle, lateral over vertical motion, peaks of spectra and mobility, account and cost.
"""

from __future__ import annotations

import argparse
import json
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from qdem_fem.errors import UsageError
from qdem_fem.load_train import Train
from qdem_fem.mesh_checks import FloatArray
from qdem_fem.output import table_read, write_whole
from qdem_fem.run_folder import machine
from qdem_fem.scene_checks import scene_load
from qdem_fem.track_figures import GRAINS, SENSORS, track_facts
from qdem_fem.track_scene import TrackPrepared, TrackScene
from qdem_fem.track_table import BogieTable
from validation.track_page import BOGIE

POINTS = (*GRAINS, "sleeper")


def passages(bogie: BogieTable) -> tuple[FloatArray, FloatArray]:
    """Times at which the two axles are on the sleeper, and at which each passage ends (2,) [s].

    The first ends half-way to the second, the second when that axle is ``lead`` behind.
    """
    axles = Train(cars=1, axle_load=bogie.axle_load, speed=bogie.speed).axles[:2]
    on = (bogie.lead + axles) / bogie.speed
    return on, np.array([on.mean(), on[1] + bogie.lead / bogie.speed])


def settlement_at(time: FloatArray, down: FloatArray, ends: FloatArray) -> list[dict[str, float]]:
    """Greatest settlement within each passage, and that at its end [m], of a point that is ``down``
    [m] below where it was at ``time`` [s].

    Raises `UsageError` for a record that ends before the last passage does."""
    if time[-1] < ends[-1] - (time[-1] - time[0]) / (len(time) - 1):
        raise UsageError(
            f"the record ends at {time[-1]:.6g} s, the last passage of an axle at {ends[-1]:.6g} s",
            where="settlement", remedy="take a run of a longer simulation.duration",
        )  # fmt: skip
    found = []
    for begin, end in zip([0.0, *ends[:-1]], ends, strict=True):
        within = (time >= begin) & (time <= end)
        found.append({"greatest": float(down[within].max()), "end": float(down[within][-1])})
    return found


def run_facts(prepared: TrackPrepared, folder: Path) -> dict[str, Any]:
    """All figures of one run."""
    result, manifest = (
        json.loads((folder / name).read_text(encoding="utf-8"))
        for name in ("result.json", "manifest.json")
    )
    assert isinstance(prepared.scene, TrackScene)
    bogie = prepared.scene.track.bogie
    assert bogie is not None
    rows = table_read(folder / "probes.csv")
    on, ends = passages(bogie)
    facts = track_facts(folder, prepared.load)
    points = {}
    for name in POINTS:
        y, z = (rows[f"{name}_{axis}"] - rows[f"{name}_{axis}"][0] for axis in "yz")
        points[name] = {
            "passages": settlement_at(rows["time"], -z, ends),
            "final": facts[name]["settlement"],
            "lateral_greatest": float(np.abs(y).max()),
            "lateral_over_vertical": float(np.abs(y).max() / np.abs(z).max()),
        }
    scene = manifest["scene"]
    return {
        "friction": scene["contact"]["friction"],
        "prepared_friction": prepared.recipe.friction,
        "seed": scene["track"]["seed"],
        "threads": scene["simulation"]["threads"],
        "step": result["step"],
        "steps": result["steps"],
        "cost": result["cost"],
        "energy": result["energy"],
        "load_greatest": float(-prepared.load.values[:, 2].min()),
        "axles": on.tolist(),
        "points": points,
        "spectra": {name: facts[name]["peaks"] for name in SENSORS},
        "mobility": {name: facts[name]["mobility_peaks"] for name in GRAINS},
    }


def main() -> None:
    """Read the runs and write the record."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0] if __doc__ else None)
    parser.add_argument("scene", type=Path)
    parser.add_argument("run", type=Path, nargs="+")
    arguments = parser.parse_args()
    prepared = scene_load(arguments.scene)
    assert isinstance(prepared, TrackPrepared)
    names = [arguments.scene, *arguments.run]
    record = {
        "command": "python -m validation.track_bogie " + " ".join(path.name for path in names),
        "machine": machine(),
        "started": datetime.now(UTC).isoformat(timespec="seconds"),
        "runs": {path.name: run_facts(prepared, path) for path in arguments.run},
    }
    write_whole(BOGIE, json.dumps(record, indent=1) + "\n")


if __name__ == "__main__":
    main()
