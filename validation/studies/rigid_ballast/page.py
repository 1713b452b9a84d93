"""The page and the figure of the ballast study."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from validation.figure import draw_figure, label_point
from validation.studies.rigid_ballast.bars import Summary, list_ends, list_runs, summarise
from validation.studies.rigid_ballast.run import Row
from validation.study import describe_commits, estimate_mean, format_table

COLOURS = {"rigid": "#0b5fa5", "soft": "#d1495b"}


def describe(rows: Sequence[Row]) -> dict[str, str]:
    """The text for each mark of the page."""
    return {
        "LIMITS": _describe_limits(rows),
        "LEVELS": _tabulate_levels(rows, summarise(rows)),
        "COMMITS": describe_commits(row["origin"]["commit"] for row in rows),
    }


def _describe_limits(rows: Sequence[Row]) -> str:
    rigid, soft = (list_ends(rows, method) for method in ("rigid", "soft"))
    apart, wide = estimate_mean(rigid - soft)
    mean = float(np.mean((rigid + soft) / 2))
    verdict = "differ" if abs(apart) > wide else "cannot be distinguished"
    return (
        f"**The two limits {verdict}.** The finest rigid level less the finest soft one is "
        f"{1e3 * apart:+.2f} ± {1e3 * wide:.2f} mm in the mean of {len(rigid)} beds, that is "
        f"{100 * apart / mean:+.0f} ± {100 * wide / mean:.0f} % of their mean, "
        f"{1e3 * mean:.2f} mm."
    )


def _tabulate_levels(rows: Sequence[Row], found: Sequence[Summary]) -> str:
    """Settlement, error and cost of every level, the cost also over that of rigid steps of 1 ms."""
    paper = next(each for each in found if each.level.name == "rigid, h = 1 ms")
    table = []
    for each in found:
        mean, wide = estimate_mean(each.settlement[:, -1])
        middle, half = estimate_mean(np.log(each.cost / paper.cost))
        low, ratio, high = np.exp([middle - half, middle, middle + half])
        recoil = np.median([run["recoil"] for run in list_runs(rows, each.level)])
        table.append([
            each.level.name + " (finest)" * each.is_limit,
            f"{1e3 * each.settlement[:, 0].mean():.2f}", f"{1e3 * mean:.2f} ± {1e3 * wide:.2f}",
            f"{100 * each.error[0]:+.0f} ± {100 * each.error[1]:.0f}", f"{1e3 * recoil:.4f}",
            f"{each.cost.mean():.2g}", f"{each.steps:,.0f}",
            f"{ratio:.2g} ({low:.2g} to {high:.2g})",
        ])  # fmt: skip
    head = ("level", "after 1 cycle [mm]", "after 5 [mm]", "error [%]", "elastic recoil [mm]",
            "CPU s a run", "steps", "cost over h = 1 ms")  # fmt: skip
    return format_table(head, table)


def draw(rows: Sequence[Row], picture: Path) -> None:
    """Error of the mean settlement against cost, and settlement against cycles."""

    def draw_panels(figure: Any) -> None:
        left, right = figure.subplots(1, 2)
        for each in summarise(rows):
            colour, name = COLOURS[each.level.method], each.level.name.partition(", ")[2]
            error, wide = (100 * value for value in each.error)
            left.errorbar(each.cost.mean(), error, yerr=wide, color=colour, marker="o", capsize=3,
                          fillstyle="none" if each.is_limit else "full")  # fmt: skip
            label_point(left, name, (each.cost.mean(), error), colour)
            curve = 1e3 * each.settlement.mean(axis=0)
            right.plot(np.arange(1, len(curve) + 1), curve, color=colour)
            if each.is_limit or each.level.method == "soft":
                label_point(right, name, (len(curve), curve[-1]), colour)
        left.axhline(0.0, color="0.6", linewidth=0.8)
        left.set(xscale="log", xlabel="processor time of a run, one thread [s]",
                 ylabel="error of the mean settlement [%]",
                 title="blue rigid, red soft; hollow: finest, judged by the other's")  # fmt: skip
        right.set(xlabel="load cycle", ylabel="mean residual settlement [mm]")
        for axes in (left, right):
            axes.grid(alpha=0.3)
            axes.margins(x=0.15)
            axes.title.set_fontsize(8)

    draw_figure((9.6, 4.0), draw_panels, picture)
