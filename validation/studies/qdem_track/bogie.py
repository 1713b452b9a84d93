"""What a bogie does to 300 grains: settlement by axle, lateral motion, spectra."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from qdem_fem.files.arrays import Floats
from qdem_fem.files.errors import UsageError
from qdem_fem.files.output import read_table
from qdem_fem.report.spectra import BANDWIDTH, smooth_spectrum, transform_record
from qdem_fem.report.track import (
    GRAINS,
    HIGHEST,
    find_acceleration_spectrum,
    find_grain_mobility,
)
from qdem_fem.scene.checks import load_scene
from qdem_fem.track.enter import TrackPrepared, TrackScene
from qdem_fem.track.loads.train import Train
from qdem_fem.track.table import BogieTable
from validation.studies.qdem_track.trials import run_scene

SCENE = Path(__file__).parents[3] / "trackbed" / "scenes" / "track-small.toml"
SEEDS, FRICTIONS = range(1, 4), (0.577, 1.73)
"""Round-off decides how the same grains fall, so a seed is another packing on another version or
processor: three are the sample, and no sentence is about one of them."""
POINTS = (*GRAINS, "sleeper")
QUICKER = (
    "simulation.mass_scaling=1.2e-6", "track.bogie.lead=1.0", "track.bogie.rest=0.01",
    "simulation.duration=0.138",
)  # fmt: skip
"""A third of the cost: a step of 0.34 for 0.21 us, for which grains are 14 % heavier in the mean,
and a bogie that begins 1 m before the sleeper and ends as far behind it, for 2 m."""
APART = 8.0
"""Of the frequencies kept in the record [Hz]."""


def find_passages(bogie: BogieTable) -> tuple[Floats, Floats]:
    """Times at which the two axles are on the sleeper, and at which each passage ends (2,) [s].

    The first ends half-way to the second, the second when that axle is ``lead`` behind.
    """
    axles = Train(cars=1, axle_load=bogie.axle_load, speed=bogie.speed).axles[:2]
    on = (bogie.lead + axles) / bogie.speed
    return on, np.array([on.mean(), on[1] + bogie.lead / bogie.speed])


def find_settlement(time: Floats, down: Floats, ends: Floats) -> list[dict[str, float]]:
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


def measure_packing(folder: Path, bed: Path, seed: int, friction: float) -> dict[str, Any]:
    """One run of a packing from the ``bed``, made where it is missing: what it bears, points, and
    smoothed spectra of load, sleeper and a grain."""
    path = folder / SCENE.name
    path.write_text(SCENE.read_text(encoding="utf-8"), encoding="utf-8")
    prepared = load_scene(path, [
        f"track.seed={seed}", f"track.bed={bed}", f"contact.friction={friction}",
        "simulation.threads=1", *QUICKER,
    ])  # fmt: skip
    assert isinstance(prepared, TrackPrepared)
    assert isinstance(prepared.scene, TrackScene)
    trial = run_scene(prepared, folder / f"run-{seed}-{friction}")
    bogie, rows = prepared.scene.track.bogie, read_table(trial.folder / "probes.csv")
    assert bogie is not None
    _, ends = find_passages(bogie)
    points = {}
    for name in POINTS:
        aside, up = (rows[f"{name}_{axis}"] - rows[f"{name}_{axis}"][0] for axis in "yz")
        last = find_settlement(rows["time"], -up, ends)
        points[name] = {
            "first": last[0]["greatest"], "greatest": max(one["greatest"] for one in last),
            "end": last[-1]["end"],
            "lateral": float(np.abs(aside).max()),
            "lateral_over_vertical": float(np.abs(aside).max() / np.abs(up).max()),
        }  # fmt: skip
    return {
        "seed": seed, "friction": friction, "points": points, "trial": prepared.trial,
        "imbalance": trial.energy["relative_imbalance"], "cpu_s": trial.cpu, "step": trial.step,
        "curves": find_spectra(prepared, rows),
    }  # fmt: skip


def find_spectra(prepared: TrackPrepared, rows: dict[str, Floats]) -> dict[str, list[float]]:
    """Every `APART` Hz: the load [N s], acceleration of S2 [m/s], mobility of B2 [m/(s N)]."""
    time, load = rows["time"], prepared.load
    frequency, spectrum = transform_record(time, np.interp(time, load.times, load.values[:, 2]))
    smooth = smooth_spectrum(frequency, np.abs(spectrum), BANDWIDTH)
    up = {name: rows[f"{name}_z"] - rows[f"{name}_z"][0] for name in ("S2", "B2")}
    curves = {
        "load": (frequency, smooth),
        "S2": find_acceleration_spectrum(time, up["S2"]),
        "B2": find_grain_mobility(time, up["B2"], load),
    }
    grid = np.arange(0.0, HIGHEST, APART)
    return {
        name: [float(f"{one:.4g}") for one in np.interp(grid, at, np.nan_to_num(size))]
        for name, (at, size) in curves.items()
    }
