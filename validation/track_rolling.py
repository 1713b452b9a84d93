"""What rolling on rough rails adds to the made-up train: levels, and a picture of the load.

    python -m validation.track_rolling

Writes ``validation/results/track-rolling.json`` and ``docs/qdem-track-load.png``.
"""

from __future__ import annotations

import json
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from qdem_fem.load_rolling import Rolling, force_response, rail_receptance, seat_response
from qdem_fem.load_roughness import RAIL, WHEEL, Roughness, roughness_power
from qdem_fem.load_train import Track, Train
from qdem_fem.mesh_checks import FloatArray
from qdem_fem.output import write_whole
from qdem_fem.run_folder import machine
from qdem_fem.spectra import fourier_spectrum, parzen_smoothed
from qdem_fem.track_load import bogie_series

ROOT = Path(__file__).parents[1]
ROLLING = ROOT / "validation" / "results" / "track-rolling.json"
PICTURE = ROOT / "docs" / "qdem-track-load.png"
BANDS = ((10, 90), (90, 250), (250, 500), (500, 1000), (1000, 2000))
"""[Hz]"""
LEAD = 2.0
"""Of the small track's scene [m]."""


def band_roots(power: FloatArray, frequency: FloatArray) -> list[float]:
    """Root mean squares in `BANDS` of a power over even frequencies [Hz]."""
    step = frequency[1] - frequency[0]
    inside = [(frequency >= low) & (frequency < high) for low, high in BANDS]
    return [float(np.sqrt(power[some].sum() * step)) for some in inside]


def levels(rail: str, wheel: str) -> dict[str, Any]:
    """Root mean squares of the contact force, and of a seat under the wheel, 1 and 2 m off [N]."""
    train, track, rolling = Train(cars=1), Track(), Rolling()
    frequency = np.arange(10.0, 2000.0, 1.0)
    heights = sum(
        roughness_power(one, frequency, train.speed) for one in (RAIL[rail], WHEEL[wheel])
    )
    load = float(train.wheel_loads[0])
    response = force_response(frequency, train.speed, load, track, rolling)
    force = np.asarray(heights * np.abs(response) ** 2)
    taken = np.abs(seat_response(np.array([0.0, 1.0, 2.0]), frequency, track, rolling)) ** 2
    return {
        "contact": band_roots(force, frequency),
        "contact_all": float(np.sqrt(force.sum())),
        "seat": band_roots(force * taken[0], frequency),
        "seat_all": [float(np.sqrt((force * one).sum())) for one in taken],
    }


def peaks(frequency: FloatArray, size: FloatArray) -> list[float]:
    """Frequencies of local maxima [Hz]."""
    inner = size[1:-1]
    at = np.flatnonzero((inner > size[:-2]) & (inner >= size[2:])) + 1
    return [float(frequency[i]) for i in at]


def rolling_facts() -> dict[str, Any]:
    """All figures."""
    track, rolling, train = Track(), Rolling(), Train(cars=1)
    frequency = np.arange(10.0, 2000.0, 1.0)
    load = float(train.wheel_loads[0])
    response = np.abs(force_response(frequency, train.speed, load, track, rolling))
    under = np.abs(seat_response(np.zeros(1), frequency, track, rolling)[0])
    return {
        "load": load,
        "levels": {f"{rail}, {wheel}": levels(rail, wheel) for rail in RAIL for wheel in WHEEL},
        "receptance_peaks": peaks(frequency, np.abs(rail_receptance(frequency, track, rolling))),
        "force_peaks": peaks(frequency, response),
        "seat_peaks": peaks(frequency, under),
        "both_peaks": peaks(frequency, response * under),
    }


def picture(path: Path) -> None:
    """The load of a bogie on the slice, even and rough, and its spectra."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 7), layout="constrained")
    FigureCanvasAgg(figure)
    above, below = figure.subplots(2, 1)
    for name, rough, colour in (
        ("rail average, wheel disc", Roughness("average"), "#cc0000"),
        ("even", None, "#0b5394"),
    ):
        series = bogie_series(Train(cars=1), Track(), 0.4, LEAD, 0.05, roughness=rough)
        force = -series.values[:, 2]
        above.plot(series.times, force / 1e3, color=colour, lw=0.8, label=name)
        frequency, spectrum = fourier_spectrum(series.times, force)
        smooth = parzen_smoothed(frequency, np.abs(spectrum), 20.0)
        seen = frequency <= 2000
        below.semilogy(frequency[seen], smooth[seen], color=colour, lw=0.9, label=name)
    above.set(xlabel="time [s]", ylabel="force on the slice [kN]",
              title="One bogie at 32 m/s on the slice (made up)")  # fmt: skip
    below.set(xlabel="frequency [Hz]", ylabel="spectrum [N s]", ylim=(1e-3, None),
              title="Linear spectra, Parzen window of 20 Hz")  # fmt: skip
    for axes in (above, below):
        axes.legend(fontsize=8)
    figure.savefig(path, dpi=110, metadata={"Software": None})


def rolling_text(record: dict[str, Any]) -> str:
    """What rolling adds, as a table."""
    names = " | ".join(f"{low} to {high} Hz" for low, high in BANDS)
    lines = [
        f"`{record['command']}`, {record['machine']}, {record['started'][:10]}.  Wheel load "
        f"{record['load'] / 1e3:g} kN, 32 m/s; root mean squares [N].",
        "",
        f"| rail, wheel | force | {names} | all | 1 m off | 2 m off |",
        f"|---|---|{len(BANDS) * '---|'}---|---|---|",
    ]
    for name, row in record["levels"].items():
        contact, seat = (" | ".join(f"{one:.0f}" for one in row[k]) for k in ("contact", "seat"))
        lines.append(f"| {name} | of contact | {contact} | {row['contact_all']:.0f} | | |")
        whole = " | ".join(f"{one:.0f}" for one in row["seat_all"])
        lines.append(f"| | on the seat | {seat} | {whole} |")

    def told(key: str) -> str:
        return ", ".join(f"{one:.0f}" for one in record[key])

    return "\n".join([
        *lines, "",
        f"Peaks of the closed forms below 2 kHz: rail's receptance {told('receptance_peaks')} Hz; "
        f"contact force over roughness {told('force_peaks')} Hz; seat under the wheel over contact "
        f"force {told('seat_peaks')} Hz; seat over roughness {told('both_peaks')} Hz.", "",
    ])  # fmt: skip


def main() -> None:
    """Compute, and write the record and the picture."""
    record = {
        "command": "python -m validation.track_rolling",
        "machine": machine(),
        "started": datetime.now(UTC).isoformat(timespec="seconds"),
        **rolling_facts(),
    }
    write_whole(ROLLING, json.dumps(record, indent=1) + "\n")
    picture(PICTURE)


if __name__ == "__main__":
    main()
