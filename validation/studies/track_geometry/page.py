"""The page docs/track-geometry.md and its figure: error against cost, D1 on two gradings."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import t

from validation.bench.qdem.checks import describe_origin
from validation.figure import draw_figure, label_point
from validation.studies.track_geometry.bars import check_bars
from validation.studies.track_geometry.grading import TONNAGE
from validation.study import format_checks, format_table

Row = dict[str, Any]
COLOURS = "#0072B2", "#009E73"


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
    beds = [
        [row["grading"], str(row["beds"]), str(row["law"]), f"{1e3 * row['gain']:.1f}",
         show_band(row["variation"]), show_band(row["persistence"]),
         *(f"{1e3 * np.interp(at, row['tonnage'], row['d1'][1]):.2g}" for at in TONNAGE)]
        for row in rows if "grading" in row
    ]  # fmt: skip
    graded = ["grading", "packings", "law", "gain to 500", "its variation", "persistence",
              *(f"D1 at {at:g} MGT" for at in TONNAGE)]  # fmt: skip
    head = ["beds and track", "D1 at 20 MGT", "at 100", "mm/100 MGT", "settlement", "D1 over it",
            "hang"]  # fmt: skip
    ways = ["law", "of the worst 5 %", "of all", "with stiffness", "with its gradient"]
    return {
        "RATES": format_table(head, rates), "GROUND": format_table(ways, ground),
        "GRADING": format_table(graded, beds), "RATIO": describe_ratio(rows),
        "BARS": format_checks(check_bars(rows)), "ORIGIN": describe_origin(rows),
    }  # fmt: skip


def show_band(one: Row) -> str:
    """A value and its interval."""
    return f"{one['value']:.2g} ({one['low']:.2g} to {one['high']:.2g})"


def describe_ratio(rows: Sequence[Row]) -> str:
    """Ratio of D1 of two gradings, its interval by leaving out packings, and how many of each would
    tell half as much again."""
    first, other = (row for row in rows if "grading" in row)
    freedom, said = first["beds"] + other["beds"] - 2, []
    for place, at in enumerate(TONNAGE):
        d1 = [np.interp(at, row["tonnage"], row["d1"][1]) for row in (first, other)]
        left = [np.array(row["left"])[:, place] for row in (first, other)]
        error = float(np.sqrt(sum((len(one) - 1) * one.var() for one in left)))
        half, log = float(t.ppf(0.95, freedom)) * error, float(np.log(d1[1] / d1[0]))
        low, middle, high = np.exp([log - half, log, log + half])
        need = freedom / 2 * (half / np.log(1.5)) ** 2
        said.append(
            f"{middle:.2g} ({low:.2g} to {high:.2g}) at {at:g} MGT, which "
            f"{'tells' if abs(log) > half else 'does not tell'} them apart (about {need:.0f} "
            "packings of each would, if one had half as much again)"
        )
    return "; ".join(said)


def draw(rows: Sequence[Row], picture: Path) -> None:
    """Error of D1 against processor time a kilometre of line and 5e6 axles, by what is refined; D1
    against tonnage on beds of two gradings, nine sections in ten."""

    def draw_panel(figure: Any) -> None:
        axes, graded = figure.subplots(1, 2)
        for row, colour in zip((one for one in rows if "grading" in one), COLOURS, strict=True):
            low, median, high = 1e3 * np.array(row["d1"])
            graded.fill_between(row["tonnage"], low, high, color=colour, alpha=0.2, lw=0)
            graded.plot(row["tonnage"], median, color=colour, label=row["grading"])
        graded.axvline(TONNAGE[0], color="0.3", ls="--", lw=1, label="beds were simulated so far")
        graded.set(xscale="log", xlabel="MGT", ylabel="D1 [mm]", xlim=(1e-3, None), ylim=(0, None))
        graded.legend(fontsize=8)
        for row in rows:
            for way, style, what in (("blocks", "o-", "blocks, over stability's"),
                                     ("comb", "s--", "seats between wheels")):  # fmt: skip
                if way not in row:
                    continue
                number, seconds, error = zip(*row[way], strict=True)
                colour = COLOURS[row["law"] != "shenton"]
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

    draw_figure((10, 4.2), draw_panel, picture)
