"""The page: every run; the figure: error against cost."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from validation.bench.qdem.checks import describe_origin
from validation.figure import draw_figure
from validation.studies.qdem_elements.bars import check_bars
from validation.study import Row, format_checks, format_table

HEAD = ["", "element", "elements", "step (µs)", "error (%)", "cost (s)"]
FIGURES = {"step_s": 1e6, "error": 100, "cost_s": 1}


def describe(rows: Sequence[Row]) -> dict[str, str]:
    """The text for each mark of the page."""
    lines = [
        [row["part"], run["element"], f"{run['elements']:,}",
         *(f"{factor * run[key]:.2g}" for key, factor in FIGURES.items())]
        for row in rows
        for run in row["runs"]
    ]  # fmt: skip
    return {
        "runs": format_table(HEAD, lines),
        "bars": format_checks(check_bars(rows)),
        "made": describe_origin(rows),
    }


def draw(rows: Sequence[Row], picture: Path) -> None:
    """Error against cost, a panel a body."""

    def draw_panels(figure: Any) -> None:
        for axes, row in zip(figure.subplots(1, 3), rows, strict=True):
            for element, style in (("linear", "o-"), ("quadratic", "*-")):
                runs = [run for run in row["runs"] if run["element"] == element]
                cost, error = ([run[key] for run in runs] for key in ("cost_s", "error"))
                axes.loglog(cost, error, style, label=element)
            axes.set(title=row["part"], xlabel="processor time [s]", ylabel="error")
            axes.xaxis.set_minor_formatter("")
            axes.grid(True, which="both", alpha=0.25)
        figure.axes[0].legend(fontsize=8)

    draw_figure((11, 3.6), draw_panels, picture)
