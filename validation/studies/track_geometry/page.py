"""The page docs/track-geometry.md and its figure: error against cost."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from validation.bench.qdem.checks import describe_origin
from validation.figure import draw_figure, label_point
from validation.studies.track_geometry.bars import check_bars
from validation.study import format_checks, format_table

Row = dict[str, Any]


def describe(rows: Sequence[Row]) -> dict[str, str]:
    """The text for each mark of the page."""
    rates = [
        [row["part"].removeprefix("rate, "), f"{1e3 * row['early']:.2f}", f"{1e3 * row['d1']:.2f}",
         f"{1e5 * row['rate']:.2f}", f"{1e3 * row['settlement']:.1f}",
         f"{row['d1'] / row['settlement']:.3f}", f"{100 * row['hanging']:.0f} %"]
        for row in rows if "rate" in row
    ]  # fmt: skip
    ground = [
        [row["law"], f"{100 * row['worst_poor']:.0f} %", f"{100 * row['poor']:.0f} %",
         f"{row['with_stiffness']:+.2f}", f"{row['with_gradient']:+.2f}"]
        for row in rows if "poor" in row
    ]  # fmt: skip
    head = ["beds and track", "D1 at 20 MGT", "at 100", "mm/100 MGT", "settlement", "D1 over it",
            "hang"]  # fmt: skip
    ways = ["law", "of the worst 5 %", "of all", "with stiffness", "with its gradient"]
    return {
        "RATES": format_table(head, rates), "GROUND": format_table(ways, ground),
        "BARS": format_checks(check_bars(rows)), "ORIGIN": describe_origin(rows),
    }  # fmt: skip


def draw(rows: Sequence[Row], picture: Path) -> None:
    """Error of D1 against processor time a kilometre of line and 5e6 axles, by what is refined."""

    def draw_panel(figure: Any) -> None:
        axes = figure.subplots()
        for row in rows:
            for way, style, what in (("blocks", "o-", "blocks, over stability's"),
                                     ("comb", "s--", "seats between wheels")):  # fmt: skip
                if way not in row:
                    continue
                number, seconds, error = zip(*row[way], strict=True)
                colour = "#0072B2" if row["law"] == "shenton" else "#009E73"
                axes.loglog(seconds, error, style, color=colour, label=f"{row['law']}: {what}")
                for place in zip(number, seconds, error, strict=True):
                    label_point(axes, f"{place[0]:g}", place[1:])
            if row["part"] == "cost, lines":
                number, seconds, error = zip(*row["lines"], strict=True)
                axes.loglog(seconds, error, "^-", color="#D55E00", label="scatter by lines")
                for place in zip(number, seconds, error, strict=True):
                    label_point(axes, f"{place[0]:g}", place[1:])
        axes.set(
            xlabel="processor time [s]; of one line but for the last", ylabel="error of D1 [-]"
        )
        axes.legend(fontsize=8)

    draw_figure((6.5, 4.2), draw_panel, picture)
