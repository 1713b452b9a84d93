"""The picture of docs/relaxation.md: overlap and contacts of a relaxation against its cost."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from validation.relaxation_reading import Ways, by_way, overlap_before, values
from validation.relaxation_runs import Row

SHOWN = {
    "smallest-move": ("smallest-move", "#c8553d", "*-"),
    "proximal": ("proximal", "#8c564b", "D-"),
    "hertz gradient": ("contacts alone, steepest descent", "#009E73", "-"),
    "hertz lbfgs": ("contacts alone, L-BFGS", "#0072B2", "-"),
    "hertz fire": ("contacts alone, FIRE", "#56B4E9", "-"),
    "eq29 gradient": ("eq. 29 (paper), steepest descent", "#E69F00", "--"),
    "eq29-free lbfgs": ("eq. 29, all free, L-BFGS", "#CC79A7", "--"),
    "liggghts drag": ("LIGGGHTS, drag", "0.2", "s:"),
    "liggghts limit": ("LIGGGHTS, limited steps", "0.55", "v:"),
    "lammps fire": ("LAMMPS fire", "0.75", "^:"),
}
"""Way at paper scale: words, colour, line."""
BEDS = {
    "smallest-move": "smallest-move",
    "proximal": "proximal",
    "hertz gradient, carried": "hertz gradient",
    "hertz lbfgs, carried": "hertz lbfgs",
    "hertz lbfgs": "hertz lbfgs",
    "hertz fire, carried": "hertz fire",
    "eq29 gradient": "eq29 gradient",
    "eq29-free lbfgs": "eq29-free lbfgs",
    "liggghts drag, 1000": "liggghts drag",
    "liggghts drag, 10000": "liggghts drag",
    "liggghts limit, 1000": "liggghts limit",
    "lammps fire, 1000": "lammps fire",
}
"""Way on live beds -> the way at paper scale whose colour it has."""


def draw(rows: Sequence[Row], target: Path) -> None:
    """Paper scale to the left and in the middle, the live beds' first cycle to the right."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    paper, beds = by_way(rows, "paper"), by_way(rows, "bed")
    figure, axes = pyplot.subplots(1, 3, figsize=(14, 4.6), layout="constrained")
    draw_ways(axes[0], paper, "overlap")
    axes[0].axhline(1, color="0.7", lw=0.8)
    axes[0].set_ylabel("greatest overlap over that before the jump")
    draw_ways(axes[1], paper, "coordination_error")
    axes[1].set_ylabel("error of contacts a grain")
    for axis in axes[:2]:
        axis.set(xscale="log", yscale="log", title="1,085 grains", xlabel="CPU time [s]")
    draw_beds(axes[2], beds)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=5, frameon=False, fontsize=8)
    figure.savefig(target, dpi=90)
    pyplot.close(figure)


def draw_ways(axis: Any, ways: Ways, key: str) -> None:
    """A figure against cost, median over the jumps, a line a way."""
    for way, (words, colour, line) in SHOWN.items():
        curves = list(ways.get(way, {}).items())
        if not curves:
            continue
        length = min(len(row["points"]) for _, row in curves)
        cost = np.median([values(row["points"][:length], "cpu_s") for _, row in curves], axis=0)
        scale = [overlap_before(ways, bed) if key == "overlap" else 1.0 for bed, _ in curves]
        error = np.median(
            [
                np.abs(values(row["points"][:length], key)) / each
                for (_, row), each in zip(curves, scale, strict=True)
            ],
            axis=0,
        )
        axis.plot(cost, np.maximum(error, 1e-4), line, color=colour, label=words, lw=1.3, ms=6)


def draw_beds(axis: Any, ways: Ways) -> None:
    """Settlement of the first cycle behind the jump against cost, a point a bed."""
    met = [row["met"]["settlement"] for row in ways.get("base", {}).values()]
    if met:
        first = 1e6 * np.array([row[1] - row[0] for row in met])
        axis.axhspan(first.min(), first.max(), color="0.9")
    for way, same in BEDS.items():
        _, colour, line = SHOWN[same]
        found = [
            (row["cpu_s"], row["after"]["settlement"])
            for row in ways.get(way, {}).values()
            if "refused" not in row and "refused" not in row["after"]
        ]
        if found:
            first = 1e6 * np.array([curve[1] - curve[0] for _, curve in found])
            marker = line.strip("-:") or "o"
            filled = colour if way.endswith("carried") or same not in ways else "none"
            axis.plot([c for c, _ in found], first, marker, color=colour, mfc=filled, ms=6)
    axis.set(xscale="log", xlabel="CPU time of the relaxation [s]", title="150 grains, LIGGGHTS")
    axis.set_yscale("symlog", linthresh=10)
    axis.set_ylabel("settlement in the first cycle behind the jump [µm]")
