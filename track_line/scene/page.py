"""The report of a line: one page that loads nothing, its table and its picture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from track_line.arrays import Floats
from track_line.scene.file import LEFT_OUT
from track_line.scene.run import PLAN, RunFolder, collect_records
from track_line.settling import BANDS, Record
from trackbed.report import save_figure, write_run_page
from trackbed.run_files import write_csv

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLUMNS = (
    "axles", "tonnage_mgt", "settlement_m", "d1_low_m", "d1_median_m", "d1_high_m",
    "hanging_over_0.1_mm", "hanging_over_1_mm", "reached_limit",
)  # fmt: skip
CAPTION = (
    "Above: standard deviation of D1 (3 to 25 m, EN 13848) of the loaded line in sections of about "
    "200 m (a shorter line is one), median and the band of nine sections in ten over all "
    "realisations, the line is the limit; and the share of sections that have reached it, whose "
    "next tamping is due.  Below: root mean square of the loaded level in thirds of an octave, at "
    "equal steps of tonnage; and where sleepers hang by more than 0.1 mm, as a share of the "
    "realisations."
)
BLUE, RED = "#0b5fa5", "#d1495b"
TIMES = 4
"""Spectra that are drawn, at equal steps of tonnage to the last."""


def tabulate_records(records: Sequence[Record], tonnage: float, limit: float) -> Floats:
    """A row for each record, in the order of `COLUMNS`; ``tonnage`` of all [MGT], ``limit`` [m]."""
    deviation = collect_records(records, "deviation")
    band = np.quantile(deviation, PLAN.band, axis=(1, 2))
    reached = (np.maximum.accumulate(deviation) >= limit).mean(axis=(1, 2))
    settled = collect_records(records, "settlement").mean(axis=1)
    voids = collect_records(records, "voids").mean(axis=2)
    cycle = collect_records(records, "cycle")
    return np.column_stack([cycle, tonnage * cycle / cycle[-1], settled, *band, *voids.T, reached])


def write_report(
    folder: RunFolder, records: Sequence[Record], manifest: dict[str, Any], summary: dict[str, Any],
    *, draw: bool,
) -> Path:  # fmt: skip
    """Write ``geometry.csv`` and the report of a finished run, with its picture if ``draw``; its
    path.  Raises as `write_whole`."""
    table = tabulate_records(records, summary["tonnage_mgt"], summary["limit_m"])
    write_csv(folder.path / "geometry.csv", COLUMNS, table.tolist())
    picture = None
    if draw:
        picture = save_figure(
            lambda: draw_geometry(table, summary["limit_m"], records, summary["length_m"]),
            folder.path / "geometry.svg",
        )
    title = summary["title"] or "A line under its axles"
    rows = [
        (key.replace("_", " "), f"{value:.4g}" if isinstance(value, float) else str(value or "-"))
        for key, value in summary.items() if key not in ("title", "sentence")
    ]  # fmt: skip
    return write_run_page(
        folder.path, title, summary["sentence"], [(picture, CAPTION)], rows,
        (*manifest["beds"], *LEFT_OUT), manifest["provenance"],
    )  # fmt: skip


def draw_geometry(
    table: Floats, limit: float, records: Sequence[Record], length: float
) -> Figure:  # fmt: skip
    """D1 with its band and the sections at their limit against tonnage, from the rows of
    `tabulate_records`; spectra of the level; voids over ``length`` [m] and tonnage."""
    from matplotlib.figure import Figure

    _, tonnage, _, low, median, high, _, _, reached = table.T
    figure = Figure(figsize=(9, 6.4))
    (deviation, tamping), (waves, voids) = figure.subplots(2, 2)
    deviation.fill_between(tonnage, 1e3 * low, 1e3 * high, color=BLUE, alpha=0.2, lw=0)
    deviation.plot(tonnage, 1e3 * median, color=BLUE)
    deviation.axhline(1e3 * limit, color=RED, lw=1)
    deviation.set(title="D1", ylabel="standard deviation [mm]", ylim=(0, None))
    tamping.plot(tonnage, 100 * reached, color=RED)
    tamping.set(title="Next tamping", ylabel="sections at their limit [%]", ylim=(0, 100))
    for axes in (deviation, tamping):
        axes.set(xlabel="MGT", xlim=(0, tonnage[-1]))
    for part in np.arange(1, TIMES + 1) / TIMES:
        at = int(np.argmin(abs(tonnage - part * tonnage[-1])))
        level = np.where(records[at].spectrum > 0, 1e3 * records[at].spectrum, np.nan)
        waves.plot(np.sqrt(BANDS[1:] * BANDS[:-1]), level, color=BLUE, alpha=part,
                   label=f"{tonnage[at]:.3g} MGT")  # fmt: skip
    waves.set(title="Spectrum", xlabel="wavelength [m]", xscale="log", ylabel="level [mm]",
              yscale="log")  # fmt: skip
    waves.legend()
    hanging = 100 * np.array([one.hanging for one in records])
    place = np.linspace(0, length, hanging.shape[1])
    map_of_voids = voids.pcolormesh(place, tonnage, hanging, cmap="Reds", rasterized=True)
    figure.colorbar(map_of_voids, label="hang [%]")
    voids.set(title="Voids", xlabel="along the line [m]", ylabel="MGT")
    return figure


def draw_members(rows: Sequence[Mapping[str, Any]]) -> Figure:
    """D1 and the next tamping of lines one behind the other, such as the kilometres of a sweep:
    medians and bands of the summaries ``rows``, with their limits; a gap where one is missing, and
    a band of tonnage that has no end goes to that of the run."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 5))
    panels = figure.subplots(2, sharex=True)
    place, names = np.arange(1, len(rows) + 1), ("low", "median", "high")
    for axes, key, scale in zip(panels, ("d1_{}_m", "tamping_{}_mgt"), (1e3, 1.0), strict=True):
        found = (np.array([row.get(key.format(name)) for row in rows], float) for name in names)
        low, median, high = (scale * one for one in found)
        end = np.array([row.get("tonnage_mgt") for row in rows], float)
        axes.vlines(place, low, np.where(np.isnan(high), end, high), color=BLUE, alpha=0.3, lw=4)
        axes.plot(place, median, "o", color=BLUE)
    limit = 1e3 * np.array([row.get("limit_m") for row in rows], float)
    panels[0].step(place, limit, where="mid", color=RED, lw=1)
    panels[0].set(title="D1 at the end", ylabel="standard deviation [mm]")
    panels[1].set(title="Next tamping", ylabel="MGT", xlabel="line, in the order of members.csv")
    panels[1].xaxis.get_major_locator().set_params(integer=True)
    return figure
