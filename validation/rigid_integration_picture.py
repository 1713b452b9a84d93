"""docs/rigid-integration.png: error against cost and step, the step in time, drift of gaps."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

from validation.rigid_hard_picture import LOOKS

LEAST = 1e-16
"""Smaller errors are drawn there."""
Lines = Sequence[dict[str, Any]]


def picture_draw(lines: Lines, path: Path) -> None:
    """Write the picture of a record's lines."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.0, 11.0), layout="constrained")
    panels = figure.subplots(3, 3).ravel()
    order = [line for line in lines if line["table"] == "order" and line["error"] is not None]
    for axes, (problem, group) in zip(
        panels, groupby(order, lambda line: line["problem"]), strict=False
    ):
        _cost(axes, problem, list(group))
    panels[0].legend(fontsize="x-small")
    panels[1].legend(fontsize="x-small")
    traces = [line for line in lines if line["table"] == "trace"]
    for axes, trace in zip(panels[6:8], traces, strict=False):
        _steps(axes, trace)
    _drift(panels[8], [line for line in lines if line["table"] == "drift"])
    figure.savefig(path, dpi=110)


def _cost(axes: Any, problem: str, rows: Lines) -> None:
    from matplotlib.ticker import NullFormatter

    for method, group in groupby(rows, lambda line: line["method"]):
        mine = list(group)
        mark, colour = LOOKS[method.partition(" ")[0]]
        axes.loglog(
            [1e3 * line["cpu_s"] for line in mine], [max(line["error"], LEAST) for line in mine],
            marker=mark, color=colour, linestyle="--" if method.endswith("RK4") else "-",
            markerfacecolor="none" if mine[0]["peer"] else colour, linewidth=0.8, label=method,
        )  # fmt: skip
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set(title=problem, xlabel="CPU time, ms", ylabel="error, m or rad")
    axes.grid(alpha=0.3)


def _steps(axes: Any, trace: dict[str, Any]) -> None:
    for kept, colour, size, words in (
        (True, "#0072B2", 5, "kept"), (False, "#D55E00", 3, "taken back"),
    ):  # fmt: skip
        chosen = [(1e3 * t, 1e3 * h) for t, h, was_kept in trace["steps"] if was_kept is kept]
        axes.scatter(*zip(*chosen, strict=True), s=size, color=colour, label=words, linewidths=0)
    axes.set(yscale="log", title=trace["way"], xlabel="time, ms", ylabel="step, ms")
    axes.set_ylim(1e-9, 10)
    axes.legend(fontsize="x-small")
    axes.grid(alpha=0.3)


def _drift(axes: Any, rows: Lines) -> None:
    for line in rows:
        if "rolls" in line["scene"]:
            continue
        tenth = line["rounds"] / len(line["gap"])
        control = "" if line["control"] else ", not controlled"
        axes.semilogy(
            [tenth * (k + 1) for k in range(len(line["gap"]))],
            [max(gap, LEAST) for gap in line["gap"]],
            marker="o", markersize=3, label=line["method"] + control,
            color=LOOKS[line["method"]][1], linestyle="-" if line["control"] else ":",
        )  # fmt: skip
    axes.set(title="disc slides round a disc", xlabel="rounds", ylabel="gap over the radius")
    axes.legend(fontsize="x-small")
    axes.grid(alpha=0.3)
