"""The report of a line: one page that loads nothing, its table and its picture."""

from __future__ import annotations

import json
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from track_line.arrays import Floats
from track_line.scene.file import LEFT_OUT
from track_line.scene.run import PLAN, RunFolder, collect_records
from track_line.settling import Record
from trackbed.report import (
    make_list,
    make_page,
    make_paragraph,
    make_picture,
    make_section,
    make_table,
    save_figure,
)
from trackbed.run_files import write_whole

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLUMNS = (
    "axles", "tonnage_mgt", "settlement_m", "d1_low_m", "d1_median_m", "d1_high_m",
    "hanging_over_0.1_mm", "hanging_over_1_mm",
)  # fmt: skip
CAPTION = (
    "Standard deviation of D1 (3 to 25 m, EN 13848) of the loaded line in sections of about 200 m "
    "(a shorter line is one): median, and the band of nine sections in ten, over all realisations; "
    "the line is the limit."
)


def tabulate_records(records: Sequence[Record], tonnage: float) -> Floats:
    """A row for each record, in the order of `COLUMNS`; ``tonnage`` of all [MGT]."""
    band = np.quantile(collect_records(records, "deviation"), PLAN.band, axis=(1, 2))
    settled = collect_records(records, "settlement").mean(axis=1)
    voids = collect_records(records, "voids").mean(axis=2)
    cycle = collect_records(records, "cycle")
    return np.column_stack([cycle, tonnage * cycle / cycle[-1], settled, *band, *voids.T])


def write_report(
    folder: RunFolder, records: Sequence[Record], manifest: dict[str, Any], summary: dict[str, Any],
    *, draw: bool,
) -> Path:  # fmt: skip
    """Write ``geometry.csv`` and the report of a finished run, with its picture if ``draw``; its
    path.  Raises as `write_whole`."""
    table = tabulate_records(records, summary["tonnage_mgt"])
    lines = [",".join(COLUMNS), *(",".join(map(repr, row)) for row in table.tolist())]
    write_whole(folder.path / "geometry.csv", "\n".join(lines) + "\n")
    picture = None
    if draw:
        picture = save_figure(
            lambda: draw_geometry(table, summary["limit_m"]), folder.path / "geometry.svg"
        )
    title = summary["title"] or "A line under its axles"
    rows = [
        (key.replace("_", " "), f"{value:.4g}" if isinstance(value, float) else str(value or "-"))
        for key, value in summary.items() if key not in ("title", "sentence")
    ]  # fmt: skip
    parts = [
        f"<h1>{escape(title)}</h1>",
        make_paragraph(escape(summary["sentence"]), "claim"),
        make_picture(picture, CAPTION, escape(CAPTION)),
        make_section("Figures", make_table("", (), rows)),
        make_section("Left out", make_list(escape(text) for text in LEFT_OUT)),
        make_section("Again", f"<pre>{escape(json.dumps(manifest['provenance'], indent=1))}</pre>"),
    ]
    path = folder.path / "report.html"
    write_whole(path, make_page(title, parts))
    return path


def draw_geometry(table: Floats, limit: float) -> Figure:
    """D1 with its band against tonnage, from the rows of `tabulate_records`."""
    from matplotlib.figure import Figure

    _, tonnage, _, low, median, high, *_ = table.T
    figure = Figure(figsize=(7, 3.6))
    axes = figure.add_subplot()
    axes.fill_between(tonnage, 1e3 * low, 1e3 * high, color="#0b5fa5", alpha=0.2, lw=0)
    axes.plot(tonnage, 1e3 * median, color="#0b5fa5")
    axes.axhline(1e3 * limit, color="#d1495b", lw=1)
    axes.set(xlabel="MGT", ylabel="standard deviation of D1 [mm]")
    axes.set(xlim=(0, tonnage[-1]), ylim=(0, None))
    return figure
