"""The picture of the record of `rigid_runs`: work-precision, profile, Dantzig's algorithm."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from validation import rigid_report as report
from validation.rigid_report import Row

PICTURE = Path(__file__).parents[1] / "docs" / "rigid-solvers.png"
STYLE = {
    "rigid_lcp": ("o", "#0b5394"),
    "rigid_lcp interior-point": ("^", "#3d9be9"),
    "rigid_lcp newton": ("v", "#76a5af"),
    "rigid_lcp gauss-seidel": ("x", "#3d9be9"),
    "rigid_lcp pivoting": ("P", "#8e7cc3"),
    "rigid_lcp dantzig": ("d", "#b4a7d6"),
    "Clarabel + Newton": ("D", "#cc0000"),
    "Clarabel": ("s", "#cc7a00"),
    "OSQP polished": ("p", "#e06666"),
    "Siconos 2D_NSGS": ("1", "#6aa84f"),
    "Siconos 2D_CPG": ("2", "#38761d"),
    "Siconos 2D_LEMKE": ("3", "#93c47d"),
    "Siconos 3D_NSGS": ("1", "#6aa84f"),
    "Siconos 3D_ADMM": ("2", "#38761d"),
    "Siconos 3D_NSN_AC": ("3", "#93c47d"),
    "Siconos 3D_NSN_FB": ("4", "#b6d7a8"),
    "Siconos 3D_PROX": ("+", "#274e13"),
}
PROFILED = tuple(name for name in STYLE if name not in ("rigid_lcp pivoting", "rigid_lcp dantzig"))
LEVELS = 10.0 ** np.arange(-2, -16, -1)
"""Residuals at which costs are compared."""
ROUND_OFF = 1e-17
"""Residuals of zero are drawn here."""
LAST = 12
"""Changes of lists that are drawn."""
FACTORS = np.logspace(0, 4, 200)


def picture(rows: Sequence[Row], path: Path) -> None:
    """Draw a panel a family, the performance profile, and Dantzig's algorithm."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    names = report.families(rows)
    dantzig = any(row["case"] == "rigid-dantzig" for row in rows)
    panels = len(names) + 1 + 2 * dantzig
    down = -(-panels // 3)
    figure = Figure(figsize=(15, 4.4 * down), layout="constrained")
    FigureCanvasAgg(figure)
    axes = list(np.ravel(figure.subplots(down, 3)))
    for panel, family in zip(axes, names, strict=False):
        _work_precision(panel, rows, family)
    _profile(axes[len(names)], rows)
    if dantzig:
        _success(axes[len(names) + 1], rows)
        _cycle(axes[len(names) + 2], rows)
    for panel in axes[panels:]:
        panel.set_axis_off()
    drawn: dict[str, Any] = {}
    for panel in axes[: len(names) + 1]:
        handles, names_of = panel.get_legend_handles_labels()
        drawn = dict(zip(names_of, handles, strict=True)) | drawn  # the first have markers
    figure.legend(
        list(drawn.values()), list(drawn), loc="outside lower center", ncols=6, fontsize=8
    )
    temporary = path.with_name(path.name + ".partial")
    figure.savefig(temporary, dpi=100, format="png")
    temporary.replace(path)


def _work_precision(axes: Any, rows: Sequence[Row], family: str) -> None:
    """Faint: runs.  Joined: median over the problems of the cost of each residual, as long as half
    of them reached it."""
    found = report.problems(rows, family)
    for name, (marker, colour) in STYLE.items():
        mine = [report.of(each, name) for each in found.values()]
        mine = [each for each in mine if each]
        runs = [row for each in mine for row in each if row["error"] is not None]
        if not runs:
            continue
        axes.plot(
            [max(row["cost_s"], 1e-4) for row in runs],
            [max(row["error"], ROUND_OFF) for row in runs],
            marker, color=colour, alpha=0.3, markersize=3,
        )  # fmt: skip
        costs = [np.median([report.cost_to(each, level) for each in mine]) for level in LEVELS]
        kept = np.isfinite(costs)
        axes.plot(
            np.maximum(np.asarray(costs)[kept], 1e-4), LEVELS[kept], marker=marker, color=colour,
            label=name, markersize=5, linewidth=2 if name == report.OURS else 1,
        )  # fmt: skip
    contacts = [each[0]["contacts"] for each in found.values()]
    axes.set(
        xscale="log", yscale="log", ylim=(ROUND_OFF, 10),
        title=f"{family}:\n{len(found)} problems, {min(contacts):,} to {max(contacts):,} contacts",
        xlabel="processor time of one thread [s]", ylabel="scale-free natural residual",
    )  # fmt: skip
    axes.grid(True, alpha=0.25)


def _profile(axes: Any, rows: Sequence[Row]) -> None:
    """Share of the problems brought to their bar within a factor of the fastest."""
    for name in PROFILED:
        mine = report.of(report.races(rows), name)
        if not mine:
            continue
        among = {row["problem"] for row in mine}
        shared = [row for row in report.races(rows) if row["problem"] in among]
        axes.step(
            FACTORS, report.profile(shared, name, PROFILED, FACTORS), where="post",
            color=STYLE[name][1], label=name, linewidth=2 if name == report.OURS else 1,
            linestyle="--" if name.startswith("Siconos") else "-",
        )  # fmt: skip
    axes.set(
        xscale="log",
        ylim=(0, 1.02),
        title="performance profile, all problems, to the bar",
        xlabel="cost over the least cost (1 ms at least)",
        ylabel="share of the problems a method was run on",
    )
    axes.grid(True, alpha=0.25)


def _success(axes: Any, rows: Sequence[Row]) -> None:
    """Share of the orders of contacts that Dantzig's algorithm solved."""
    for bed, line in zip(report.dantzig_beds(rows), ("o-", "^:", "s--"), strict=False):
        for method, colour in (("dantzig", "#0b5394"), ("dantzig, reversal", "#cc7a00")):
            found = report.dantzig_success(rows, method, bed)
            shares = [solved / orders for solved, orders in found.values()]
            axes.plot(list(found), shares, line, color=colour, label=f"{method}: {bed}")
    axes.set(
        title="the paper's modified Dantzig\nalgorithm on packings", xlabel="friction",
        ylabel="orders of contacts solved, share", ylim=(-0.03, 1.03),
    )  # fmt: skip
    axes.legend(fontsize=8)
    axes.grid(True, alpha=0.25)


def _cycle(axes: Any, rows: Sequence[Row]) -> None:
    """The lists that contacts leave and enter, event after event, until it cycles."""
    shown = report.trace(rows)
    if shown is None:
        axes.set_axis_off()
        return
    lists = ["NC", "C_F", "C+", "C-"]
    events = shown["events"][-LAST:]
    first = shown["work"] - len(events)
    for place, (_, _, contact, origin, target, step, _) in enumerate(events, first):
        low, high = lists.index(origin), lists.index(target)
        colour = "#cc0000" if step == 0 else "#0b5394"
        axes.annotate(
            "", (place, high), (place, low), arrowprops={"arrowstyle": "->", "color": colour}
        )
        axes.plot(place, low, "o", markersize=4, color=colour)
        axes.text(
            place + 0.12, (low + high) / 2, f"{contact}", fontsize=8, color=colour, va="center"
        )
    axes.set_xlim(first - 0.5, shown["work"] + 0.2)
    axes.set_ylim(-0.3, 3.3)
    axes.set_yticks(range(4), lists)
    axes.set(
        title=f"how it cycles: friction {shown['setting']['friction']:g}, order {shown['seed']}",
        xlabel="change of lists; beside it the contact, red: a step of length zero",
        ylabel="lists that it leaves and enters",
    )  # fmt: skip
    axes.grid(True, alpha=0.25)
