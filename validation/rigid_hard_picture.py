"""docs/rigid-hard-cases.png: error against cost a step, engine by engine, over the hard cases."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

LEAST = 1e-17
"""Errors below it are drawn on it [m]."""
OURS = ("time-stepping", "acceleration")
LOOKS = {
    "time-stepping": ("o", "#0072B2"), "acceleration": ("s", "#56B4E9"),
    "MuJoCo": ("^", "#D55E00"), "ODE": ("v", "#009E73"), "LMGC90": ("D", "#CC79A7"),
}  # fmt: skip
"""Mark and colour of each engine; colours of Okabe and Ito, which the colour-blind tell apart."""
BAR = 1e-9
"""The bar of most scenes [m]."""


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
    for method, points in picture_points(lines).items():
        cost, error = zip(*points, strict=True)
        ours = method in OURS
        mark, colour = LOOKS[method.partition(" ")[0]]
        axes.scatter(
            cost, error, s=26, marker=mark, facecolors=colour if ours else "none",
            edgecolors=colour, label=f"rigid_lcp, {method}" if ours else method,
        )  # fmt: skip
    axes.axhline(BAR, color="0.4", linewidth=0.8, label=f"bar of most scenes, {BAR:g} m")
    axes.axhline(LEAST, color="0.8", linewidth=0.8, linestyle=":", label=f"{LEAST:g} m or less")
    axes.grid(alpha=0.3)
    axes.legend(fontsize="small")
    figure.savefig(path, dpi=150)
