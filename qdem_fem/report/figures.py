"""Pictures of a run as PNG, without a display: histories, spectra, energies, and their style.

matplotlib is loaded when a picture is drawn.  Fields come in SI units and are shown in the
multiple (um, mm; kPa, MPa) that leaves few digits.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from math import floor, log10
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from qdem_fem.files import Floats
from qdem_fem.report.spectra import Mode, find_amplitudes
from trackbed.report import STYLE, encode_figure
from trackbed.run_files import write_whole

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Curve = tuple[Floats, Floats]
"""Times [s] and values."""

COLOURS = ("#0b5fa5", "#2a9d6f", "#7a4fa3", "#b02020", "#6b6b6b", "#00838f")
PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))
LINES = {"lines.linewidth": 1.3}
"""What is thinner here than in other reports."""


def draw_history(
    path: Path, curves: Mapping[str, Curve], *, quantity: str = "displacement", unit: str = "m",
    against: str = "time (s)", logarithmic: bool = False,
) -> None:  # fmt: skip
    """Draw histories by name against time, or spectra.

    ``against``: what the first of each curve's arrays is; ``logarithmic``: of the values."""
    greatest = max(float(np.nanmax(np.abs(v), initial=0.0)) for _, v in curves.values())
    scale, name = choose_unit(greatest, unit)
    with write_figure(path, (7.2, 3.2)) as figure:
        panel = figure.subplots()
        for label, (time, values) in curves.items():
            panel.plot(time, values / scale, label=label)
        panel.set(xlabel=against, ylabel=f"{quantity} ({name})")
        if logarithmic:
            panel.set_yscale("log")
        panel.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=4)


def draw_spectrum(path: Path, curves: Mapping[str, Curve], modes: Sequence[Mode] = ()) -> None:
    """Draw the amplitude spectra (Hann) of displacements, and lines at the frequencies of modes."""
    with write_figure(path, (7.2, 3.2)) as figure:
        panel = figure.subplots()
        highest = 0.0
        for label, (time, values) in curves.items():
            frequency, amplitude = find_amplitudes(time, values)
            panel.plot(frequency[1:], amplitude[1:], label=label)
            highest = max(highest, float(frequency[-1]))
        for mode in modes:
            panel.axvline(mode.frequency, color="#888888", lw=0.8, ls=":")
            panel.text(
                mode.frequency, 1.01, f"{mode.frequency:.4g} Hz", fontsize=8, ha="center",
                va="bottom", rotation=35, transform=panel.get_xaxis_transform(),
            )  # fmt: skip
        shown = max((mode.frequency for mode in modes), default=highest / 4)
        panel.set(xlim=(0, min(2 * shown, highest)), yscale="log")
        top = max(float(np.max(line.get_ydata())) for line in panel.lines[: len(curves)])
        if top > 0:
            panel.set_ylim(1e-7 * top, 3 * top)
        panel.set(xlabel="frequency (Hz)", ylabel="amplitude of displacement (m)")
        panel.legend(loc="upper right")


def draw_energy(path: Path, energy: Mapping[str, Floats]) -> None:
    """Draw the energies [J] of a run against ``energy["time"]``."""
    time = energy["time"]
    names = [name for name in energy if name != "time"]
    scale, unit = choose_unit(max(float(np.abs(energy[n]).max(initial=0.0)) for n in names), "J")
    with write_figure(path, (7.2, 2.8)) as figure:
        panel = figure.subplots()
        for name in names:
            panel.plot(time, energy[name] / scale, label=name)
        total = (energy["kinetic"] + energy["elastic"]) / scale
        panel.plot(time, total, color="#111111", lw=0.9, ls="--", label="kinetic + elastic")
        panel.set(xlabel="time (s)", ylabel=f"energy ({unit})")
        panel.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=4)


def choose_unit(greatest: float, unit: str) -> tuple[float, str]:
    """SI multiple in which a quantity is shown: its size, and its name such as ``kPa``."""
    for size, prefix in PREFIXES:
        if greatest >= size:
            return size, prefix + unit
    return (1.0, unit) if greatest == 0 else (PREFIXES[-1][0], PREFIXES[-1][1] + unit)


def round_below(value: float) -> float:
    """The greatest of 1, 2, 5 times a power of ten that is not above ``value``."""
    power = 10.0 ** floor(log10(value))
    return float(max(digit for digit in (1, 2, 5) if digit * power <= value * (1 + 1e-9)) * power)


@contextmanager
def write_figure(path: Path, size: tuple[float, float]) -> Iterator[Figure]:
    """A figure that is written to ``path``, atomically, at the end."""
    import matplotlib
    from matplotlib.figure import Figure
    from matplotlib.rcsetup import cycler

    curves = cycler(ls=["-", "-."]) * cycler(color=COLOURS)
    with matplotlib.rc_context(STYLE | LINES | {"axes.prop_cycle": curves}):
        figure = Figure(figsize=size)
        yield figure
        write_whole(path, encode_figure(figure, path.suffix))
