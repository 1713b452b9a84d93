"""The picture of docs/jump-control.md: error against cycles computed, two panels."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from validation import jump_study

Rows = Sequence[dict[str, Any]]


def draw(rows: Rows, runs: Rows, target: Path) -> None:
    """Left: curves with known laws; right: the coarse bed on LIGGGHTS."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    _curves(axes[0], rows)
    _beds(axes[1], runs)
    figure.savefig(target, dpi=90)
    plt.close(figure)


def _curves(axis: Any, rows: Rows) -> None:
    """Root mean square of the error at the end over laws and seeds, by setting."""
    tolerated = [row for row in rows if row["group"] == "tolerances"]
    points = []
    for tolerance in jump_study.TOLERANCES:
        these = [row for row in tolerated if row["tolerance"] == tolerance]
        points.append(
            (np.mean([row["computed"] for row in these]), _rms([row["error"] for row in these]))
        )
        axis.annotate(f" {tolerance:g}", (points[-1][0], 100 * points[-1][1]), fontsize=8)
    cost, error = np.transpose(points)
    axis.plot(cost, 100 * error, "o-", color="#0072B2", label="tolerance a jump")
    points = []
    for h in jump_study.FIXED:
        these = [row for row in rows if row["group"] == "fixed" and row["h"] == h]
        errors = [error for row in these for error in row["errors"]]
        points.append((np.mean([row["computed"] for row in these]), _rms(errors)))
        axis.annotate(f" h = {h}", (points[-1][0], 100 * points[-1][1]), fontsize=8)
    cost, error = np.transpose(points)
    axis.plot(cost, 100 * error, "s--", color="#E69F00", label="fixed k = 20, h, law log")
    axis.axvline(2000, color="0.6", lw=0.8)
    axis.set(
        xscale="log", yscale="log", xlabel="cycles computed of 2,000",
        ylabel="error at cycle 2,000, rms [%]",
    )  # fmt: skip
    axis.set_title(f"five laws, {jump_study.SEEDS} seeds, bursts as the paper's bed", fontsize=9)
    ticks = (200, 500, 1000, 2000)
    axis.set_xticks(ticks, [f"{tick:,}" for tick in ticks])
    axis.set_yticks((3, 4, 5, 6), ("3", "4", "5", "6"))
    axis.minorticks_off()
    axis.legend(frameon=False, fontsize=8)


def _beds(axis: Any, runs: Rows) -> None:
    """Absolute error against the full run of the same seed."""
    colours = {"tolerance 0.1": "#0072B2", "tolerance 0.05": "#56B4E9", "fixed h 20": "#E69F00"}
    full = {run["seed"]: run for run in runs if run["way"] == "full"}
    for way, colour in colours.items():
        these = [run for run in runs if run["way"] == way and run["seed"] in full]
        if not these:
            continue
        error = [
            100 * abs(run["rows"][-1][2] / full[run["seed"]]["rows"][-1][2] - 1) for run in these
        ]
        cost = [run["computed"] + sum(o["lost_cycles"] for o in run["lost"]) for run in these]
        axis.plot(cost, error, "o", color=colour, label=way)
    if full:
        axis.axvline(full[min(full)]["computed"], color="0.6", lw=0.8, label="full run")
    axis.set(xlabel="cycles computed", ylabel="error against the full run [%]", ylim=(0, None))
    axis.set_title("coarse bed on LIGGGHTS, a point a seed", fontsize=9)
    axis.legend(frameon=False, fontsize=8)


def _rms(values: Sequence[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
