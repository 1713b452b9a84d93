"""The picture of the record of `qdem_work_precision`: error against cost, a panel a question."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from validation.qdem_work_report import COMPARED, LEVELS, Row, family, frontier, rows_read

STYLE = {
    "QDEM float64": ("o", "#0b5394"),
    "QDEM float32": ("^", "#3d9be9"),
    "QDEM, shorter steps": ("x", "#0b5394"),
    "QDEM on gmsh's meshes": ("P", "#8e7cc3"),
    "P1 central difference": ("s", "#6aa84f"),
    "P1 Newmark": ("D", "#cc7a00"),
    "P2 Newmark": ("*", "#cc0000"),
}
TITLES = {
    "bending": "Slow bending of the cantilever, three periods",
    "pulse": "A 50 µs pulse through the bar",
}


def plot(record: Path, picture: Path) -> None:
    """Draw error against cost, a panel a question.

    Faint: every run.  Joined: each family's frontier of `dependable` errors.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    rows = rows_read(record)
    figure = Figure(figsize=(13, 6.6), layout="constrained")
    FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2)
    for axes, question in zip((left, right), LEVELS, strict=True):
        _panel(axes, rows, question)
    figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=len(STYLE),
                  fontsize=8)  # fmt: skip
    temporary = picture.with_name(picture.name + ".partial")
    figure.savefig(temporary, dpi=110, format="png")
    temporary.replace(picture)


def _panel(axes: Any, rows: Sequence[Row], question: str) -> None:
    for name, (marker, colour) in STYLE.items():
        every = family(rows, question, name)
        if not every:
            continue
        joined = name in COMPARED  # their frontier is a line: runs differ by what a user chooses
        best = frontier(every) if joined else every
        axes.plot(
            [r["cost_s"] for r in every], [r["error"] for r in every], marker, color=colour,
            alpha=0.35 if joined else 0.8, markersize=4,
        )  # fmt: skip
        axes.plot(
            *([r[key] for r in best] for key in ("cost_s", "error")), marker=marker,
            linestyle="-" if joined else "none", color=colour, label=name, markersize=6,
        )  # fmt: skip
        if name in ("QDEM float64", "P1 Newmark", "P2 Newmark"):
            for row in {row["elements"]: row for row in best}.values():
                axes.annotate(
                    _label(row, question), (row["cost_s"], row["error"]), fontsize=6, color=colour,
                    xytext=(4, 4), textcoords="offset points",
                )  # fmt: skip
    reference = next(
        r for r in rows if r["case"] == f"qdem-cost-{question}" and r["method"] == "reference"
    )
    axes.set(
        xscale="log", yscale="log", title=TITLES[question],
        xlabel="processor time of one thread, set-up included [s]",
        ylabel=f"error: {next(r['error_kind'] for r in rows if question in r['case'])}",
    )  # fmt: skip
    axes.text(
        0.02, 0.02, transform=axes.transAxes, fontsize=8,
        s=f"reference uncertain by {reference['error']:.1g}\n"
        "faint: errors as they came; joined: none smaller than a finer run's",
    )  # fmt: skip
    axes.grid(True, which="both", alpha=0.25)


def _label(row: Row, question: str) -> str:
    count = row["elements"]
    size = f"{count}" if count < 1000 else f"{count / 1000:.0f}k"
    steps = row["setting"].get("steps_per_unit")
    return size if steps is None else f"{size}, {'T' if question == 'bending' else 'pulse'}/{steps}"
