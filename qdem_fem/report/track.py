"""What a track run shows, after section 4: settlement, find_accelerations, spectra, mobility.

Displacements are counted from the prepared state.  Velocities and accelerations are first and
second differences of displacements sampled at 10 kHz: of a harmonic motion they are short by
sinc(f dt) and sinc^2(f dt), at 1 kHz by 1.6 and 3.3 %.  That is put right in the spectrum of
accelerations; mobility divides mean velocities over an interval by mean forces over it, which are
as short.  Neither has a zero below half the rate of samples, where round-off would be divided by
it.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from qdem_fem.files import Floats, Series, read_table
from qdem_fem.report import figures as pictures
from qdem_fem.report.spectra import BANDWIDTH, find_mobility, smooth_spectrum, transform_record

GRAINS = ("B1", "B2", "B3", "B2a")
SENSORS = ("S1", "S2", "S3")
HIGHEST = 1000.0  # frequency up to which the paper reads its spectra [Hz]
FEWEST_SAMPLES = 5  # of a record with spectra [-]: rest before them, second differences leave four


def find_accelerations(time: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Times and acceleration [m/s2], (k - 2,) each, of an even series of displacements (k,) [m]."""
    return time[1:-1], np.diff(values, 2) / _find_interval(time) ** 2


def find_acceleration_spectrum(time: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Frequencies [Hz] and smoothed linear spectrum [m/s] of the acceleration of a point that is
    displaced by ``values`` [m] from rest; up to `HIGHEST`.

    Before the first sample it rests there.  Without that the blow is missing which gives it the
    velocity v of the first interval, and v is left at all frequencies: of a grain that is let go
    and rings, more below 400 Hz than all of its motion there.
    """
    begin = time[0] - _find_interval(time)
    rested = np.concatenate([[begin], time]), np.concatenate([values[:1], values])
    frequency, spectrum = transform_record(*find_accelerations(*rested))
    size = np.abs(spectrum) / np.sinc(frequency * _find_interval(time)) ** 2
    seen = frequency <= HIGHEST
    return frequency[seen], smooth_spectrum(frequency, size, BANDWIDTH)[seen]


def find_grain_mobility(time: Floats, values: Floats, load: Series) -> tuple[Floats, Floats]:
    """Frequencies [Hz] and |V|/|F| [m/(s N)] of a grain displaced by ``values`` [m] under a load
    (k, 3) [N] (Fig. 12), smoothed as spectra are; nan where the load is silent."""
    when, velocity = (time[1:] + time[:-1]) / 2, np.diff(values) / _find_interval(time)
    force = average_between(time, load.times, load.values[:, 2])
    frequency, ratio = find_mobility(when, force, velocity, BANDWIDTH)
    seen = frequency <= HIGHEST
    return frequency[seen], ratio[seen]


def average_between(time: Floats, times: Floats, values: Floats) -> Floats:
    """Means (k - 1,) between instants (k,) [s] of a series that is linear between its ``times``
    (n,) [s], and constant before and behind them."""
    knots = np.union1d(time, times)
    between = np.interp(knots, times, values)
    area = np.cumsum([0.0, *(np.diff(knots) * (between[1:] + between[:-1]) / 2)])
    return np.diff(area[np.searchsorted(knots, time)]) / np.diff(time)


def _find_interval(time: Floats) -> float:
    """Between two samples of an even series [s]."""
    return float(time[-1] - time[0]) / (len(time) - 1)


def find_peaks(frequency: Floats, size: Floats, count: int = 5) -> list[float]:
    """Frequencies of the greatest local peaks of a smooth spectrum [Hz], by height."""
    inner = size[1:-1]
    at = 1 + np.flatnonzero((inner > size[:-2]) & (inner >= size[2:]))
    return [float(frequency[i]) for i in sorted(at, key=lambda i: -float(size[i]))[:count]]


def list_track_facts(path: Path, load: Series) -> dict[str, Any]:
    """Figures of the run in a folder: greatest and final displacement of each point [m] since the
    prepared state, along y and down; peaks of spectra and mobility [Hz], of a record
    of `FEWEST_SAMPLES` samples or more."""
    rows = read_table(path / "probes.csv")
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
        if len(time) < FEWEST_SAMPLES:
            continue
        if name != "sleeper":
            _, acceleration = find_accelerations(time, up)
            facts[name]["acceleration_greatest"] = float(np.abs(acceleration).max())
            facts[name]["peaks"] = find_peaks(*find_acceleration_spectrum(time, up))
        if name in GRAINS:
            facts[name]["mobility_peaks"] = find_peaks(*find_grain_mobility(time, up, load))
    return facts


def draw_track_pictures(path: Path, load: Series) -> Iterator[tuple[Path, str]]:
    """Draw what a track run shows; file and caption of each picture."""
    rows = read_table(path / "probes.csv")
    time = rows["time"]
    moved = {
        f"{name} {axis}": rows[f"{name}_{axis}"] - rows[f"{name}_{axis}"][0]
        for name in (*GRAINS, *SENSORS, "sleeper")
        for axis in "yz"
    }
    for axis, word in (("z", "Vertical"), ("y", "Lateral")):
        target = path / f"picture-track-{axis}.png"
        names = [f"{name} {axis}" for name in (*GRAINS, "sleeper")]
        pictures.draw_history(target, {n: (time, moved[n]) for n in names})
        yield (
            target,
            f"{word} displacement of grains and sleeper since the prepared state (Fig. 8).",
        )
    if len(time) < FEWEST_SAMPLES:
        return
    target = path / "picture-track-acceleration.png"
    curves = {s: find_accelerations(time, moved[f"{s} z"]) for s in SENSORS}
    pictures.draw_history(target, curves, quantity="acceleration", unit="m/s²")
    yield target, "Vertical acceleration of the sleeper, sampled at the output's rate (Fig. 9a)."
    smooth = describe_smoothing(time)
    spectra = {
        name: find_acceleration_spectrum(time, moved[f"{name} z"]) for name in SENSORS + GRAINS
    }
    mobilities = {g: find_grain_mobility(time, moved[f"{g} z"], load) for g in GRAINS}
    for name, curves, quantity, unit, caption in (
        ("spectra", {s: spectra[s] for s in SENSORS}, "spectrum", "m/s",
         f"Linear spectra of these, {smooth} (Figs. 9b, 10)."),
        ("grains", {g: spectra[g] for g in GRAINS}, "spectrum", "m/s",
         f"The same of grains, {smooth} (Fig. 11b)."),
        ("mobility", mobilities, "mobility", "m/(s N)",
         f"Mobility of grains: velocity over load, {smooth} (Fig. 12)."),
    ):  # fmt: skip
        target = path / f"picture-track-{name}.png"
        pictures.draw_history(
            target, curves, quantity=quantity, unit=unit, against="frequency (Hz)",
            logarithmic=True,
        )  # fmt: skip
        yield target, caption


def describe_smoothing(time: Floats) -> str:
    """How spectra of a record at these times [s] are smoothed, in words."""
    apart = 1 / (time[-1] - time[0])
    if apart > BANDWIDTH:
        return f"not smoothed: a record so short has a value every {apart:.3g} Hz"
    return f"Parzen window of {BANDWIDTH:g} Hz"
