"""docs/rigid-hard-cases.png: error against cost a step, engine by engine, over the hard cases."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

LEAST = 1e-17
"""Errors below it are drawn on it [m]."""
OURS = ("time-stepping", "acceleration")
MARKS = {"time-stepping": "o", "acceleration": "s", "MuJoCo": "^", "ODE": "v", "LMGC90": "D"}


def picture_points(lines: Sequence[dict[str, Any]]) -> dict[str, list[tuple[float, float]]]:
    """(CPU ms a step, error in m) by engine: scenes that rest or move by a known way, that ran."""
    points: dict[str, list[tuple[float, float]]] = {}
    for line in lines:
        known = line["unit"] == "m" and line["bar"].startswith("<=")
        if known and line["steps"] and line["value"] is not None and line["cpu_s"]:
            point = (1e3 * line["cpu_s"] / line["steps"], max(line["value"], LEAST))
            points.setdefault(line["method"], []).append(point)
    return points


def picture_draw(lines: Sequence[dict[str, Any]], path: Path) -> None:
    """Write the picture of a record's lines."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 4.4), layout="constrained")
    axes = figure.add_subplot(
        xscale="log", yscale="log", xlabel="CPU time a step [ms], one thread",
        ylabel="distance from the exact answer [m]",
    )  # fmt: skip
    for number, (method, points) in enumerate(picture_points(lines).items()):
        cost, error = zip(*points, strict=True)
        ours = method in OURS
        colour = f"C{number}"
        axes.scatter(
            cost, error, s=26, marker=MARKS.get(method.partition(" ")[0], "x"),
            facecolors=colour if ours else "none", edgecolors=colour,
            label=f"rigid_lcp, {method}" if ours else method,
        )  # fmt: skip
    axes.axhline(1e-9, color="0.6", linewidth=0.8)
    axes.grid(alpha=0.3)
    axes.legend(fontsize="small")
    figure.savefig(path, dpi=150)
