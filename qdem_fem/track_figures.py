"""What a track run shows, after section 4: settlement, accelerations, spectra, mobility.

Displacements are counted from the prepared state.  Accelerations are second differences of
displacements sampled at 10 kHz: of a harmonic motion they are short by sinc^2(f dt), 1.6 % at
1 kHz, and that is put right in spectra.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from qdem_fem import pictures
from qdem_fem.mesh_checks import FloatArray
from qdem_fem.output import table_read
from qdem_fem.scene_series import TimeSeries
from qdem_fem.spectra import fourier_spectrum, parzen_smoothed

GRAINS = ("B1", "B2", "B3", "B2a")
SENSORS = ("S1", "S2", "S3")
BANDWIDTH = 20.0
"""Of the Parzen window [Hz], as in Figs. 9 to 12."""
FREQUENCY = "frequency (Hz)"
HIGHEST = 1000.0
"""Frequency up to which the paper reads its spectra [Hz]."""


def differences(time: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Times, velocity and acceleration (k - 2,) by central differences of an even series (k,)."""
    step = float(time[-1] - time[0]) / (len(time) - 1)
    velocity = (values[2:] - values[:-2]) / (2 * step)
    acceleration = (values[2:] - 2 * values[1:-1] + values[:-2]) / step**2
    return time[1:-1], velocity, acceleration


def acceleration_spectrum(time: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Frequencies [Hz] and smoothed linear spectrum [m/s] of the acceleration of a point that is
    displaced by ``values`` [m]; up to `HIGHEST`."""
    when, _, acceleration = differences(time, values)
    frequency, spectrum = fourier_spectrum(when, acceleration)
    step = float(when[1] - when[0])
    size = parzen_smoothed(frequency, np.abs(spectrum) / np.sinc(frequency * step) ** 2, BANDWIDTH)
    seen = frequency <= HIGHEST
    return frequency[seen], size[seen]


def mobility(
    time: FloatArray, values: FloatArray, load: TimeSeries
) -> tuple[FloatArray, FloatArray]:
    """Frequencies [Hz] and |V|/|F| [m/(s N)] of a grain displaced by ``values`` [m] under a load
    (k, 3) [N] (Fig. 12); nan where the load is silent."""
    when, velocity, _ = differences(time, values)
    force = np.interp(when, load.times, load.values[:, 2])
    frequency, of_force = fourier_spectrum(when, force)
    _, of_grain = fourier_spectrum(when, velocity)
    step = float(when[1] - when[0])
    grain = np.abs(of_grain) / np.sinc(2 * frequency * step)
    seen = frequency <= HIGHEST
    above, below = (
        parzen_smoothed(frequency, np.abs(x), BANDWIDTH)[seen] for x in (grain, of_force)
    )
    silent = below <= 1e-9 * below.max(initial=0.0)
    return frequency[seen], np.where(silent, np.nan, above / np.where(silent, 1.0, below))


def peaks_of(frequency: FloatArray, size: FloatArray, count: int = 5) -> list[float]:
    """Frequencies of the greatest local peaks of a smooth spectrum [Hz], by height."""
    inner = size[1:-1]
    at = 1 + np.flatnonzero((inner > size[:-2]) & (inner >= size[2:]))
    return [float(frequency[i]) for i in sorted(at, key=lambda i: -float(size[i]))[:count]]


def track_facts(path: Path, load: TimeSeries) -> dict[str, Any]:
    """Figures of the run in a folder: greatest and final displacement of each point [m] since the
    prepared state, along y and down; peaks of spectra and mobility [Hz]."""
    rows = table_read(path / "probes.csv")
    time = rows["time"]
    facts: dict[str, Any] = {}
    for name in (*GRAINS, *SENSORS, "sleeper"):
        across, up = (rows[f"{name}_{axis}"] - rows[f"{name}_{axis}"][0] for axis in "yz")
        facts[name] = {
            "settlement": -float(up[-1]),
            "settlement_greatest": -float(up.min()),
            "lateral": float(across[-1]),
            "lateral_greatest": float(np.abs(across).max()),
        }
        if name in SENSORS:
            _, _, acceleration = differences(time, up)
            facts[name]["acceleration_greatest"] = float(np.abs(acceleration).max())
            facts[name]["peaks"] = peaks_of(*acceleration_spectrum(time, up))
        if name in GRAINS:
            facts[name]["mobility_peaks"] = peaks_of(*mobility(time, up, load))
    return facts


def track_pictures(path: Path, load: TimeSeries) -> Iterator[tuple[Path, str]]:
    """Draw what a track run shows; file and caption of each picture."""
    rows = table_read(path / "probes.csv")
    time = rows["time"]
    moved = {
        f"{name} {axis}": rows[f"{name}_{axis}"] - rows[f"{name}_{axis}"][0]
        for name in (*GRAINS, *SENSORS, "sleeper")
        for axis in "yz"
    }
    for axis, word in (("z", "Vertical"), ("y", "Lateral")):
        target = path / f"picture-track-{axis}.png"
        names = [f"{name} {axis}" for name in (*GRAINS, "sleeper")]
        pictures.picture_history(target, {n: (time, moved[n]) for n in names})
        yield (
            target,
            f"{word} displacement of grains and sleeper since the prepared state (Fig. 8).",
        )
    target = path / "picture-track-acceleration.png"
    shown = {s: differences(time, moved[f"{s} z"]) for s in SENSORS}
    curves = {s: (one[0], one[2]) for s, one in shown.items()}
    pictures.picture_history(target, curves, quantity="acceleration", unit="m/s²")
    yield target, "Vertical acceleration of the sleeper, sampled at the output's rate (Fig. 9a)."
    target = path / "picture-track-spectra.png"
    curves = {s: acceleration_spectrum(time, moved[f"{s} z"]) for s in SENSORS}
    pictures.picture_history(
        target, curves, quantity="spectrum", unit="m/s", against=FREQUENCY, logarithmic=True
    )
    yield target, "Linear spectra of these, Parzen window of 20 Hz (Figs. 9b, 10)."
    target = path / "picture-track-mobility.png"
    curves = {g: mobility(time, moved[f"{g} z"], load) for g in GRAINS}
    pictures.picture_history(
        target, curves, quantity="mobility", unit="m/(s N)", against=FREQUENCY, logarithmic=True
    )
    yield target, "Mobility of grains: velocity over load (Fig. 12)."
