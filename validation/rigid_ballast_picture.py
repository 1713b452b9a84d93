"""docs/rigid-ballast.png: error against cost, settlement against cycles, force chains."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rigid_lcp.contacts import ContactForces
from rigid_lcp.motion import Motion
from rigid_lcp.pictures import draw_bodies_2d, draw_chains, force_scale
from validation.rigid_ballast_bed import FRICTION, Bed, bed_scene
from validation.rigid_ballast_judge import Limits, Summary
from validation.rigid_ballast_measures import MOBILISED

Row = dict[str, Any]
COLOURS = {"rigid": "#0b5fa5", "soft": "#d1495b"}


def short_name(summary: Summary) -> str:
    """What is written beside a mark: the step in ms or the stiffness, controls with their own."""
    value, extra = summary.level["value"], summary.level["extra"]
    if summary.method == "rigid":
        control = "" if extra == 1e-9 else f", res. {extra:.0e}"
        return f"h = {1e3 * value:g} ms{control}"
    control = "" if extra == 0.05 else ", half step"
    return f"k = {value:.0e}{control}".replace("e+0", "e").replace("e+", "e")


def draw_errors(axes: Any, found: Sequence[Summary], limits: Limits) -> None:
    """Every level: errors of median and mean settlement against processor time."""
    for method, colour in COLOURS.items():
        mine = [s for s in found if s.method == method and s.name != limits.rigid]
        cost = [s.cost for s in mine]
        error = [max(abs(s.median_bias), 1e-2) for s in mine]
        for s, x, y in zip(mine, cost, error, strict=True):
            mean = max(abs(s.bias), 1e-2)
            ends = [max(mean - s.bias_interval, 1e-2), mean + s.bias_interval]
            axes.plot([x, x], ends, color=colour, linewidth=1, alpha=0.4)
            axes.plot(x, mean, "o", color=colour, markersize=6, fillstyle="none")
            axes.plot(x, y, "o", color=colour, markersize=7)
            axes.annotate(short_name(s), (x, y), xytext=(6, 4), textcoords="offset points",
                          fontsize=7, color=colour)  # fmt: skip
        axes.plot([], [], "o", color=colour, label={
            "rigid": "rigid grains (step h)", "soft": "soft grains, MD (stiffness k in N/m)",
        }[method])  # fmt: skip
    axes.set(xscale="log", yscale="log", xlabel="processor time of 10 load cycles, one thread [s]",
             ylabel="error of the settlement, of the reference's [-]")  # fmt: skip
    axes.grid(alpha=0.3, which="both")
    axes.legend(fontsize=8, loc="best")
    axes.set_title(
        f"Error against cost; full: median; hollow: mean, 95 %; reference: {limits.rigid}",
        fontsize=8, loc="left",
    )  # fmt: skip


def draw_settlements(axes: Any, found: Sequence[Summary]) -> None:
    """Mean settlement against the number of cycles."""
    for s in found:
        cycles = np.arange(1, len(s.curve) + 1)
        axes.plot(cycles, np.maximum(1e3 * s.curve, 1e-4), color=COLOURS[s.method],
                  linestyle="--" if s.is_limit else "-", linewidth=1.2)  # fmt: skip
        axes.annotate(short_name(s), (cycles[-1], max(1e3 * s.curve[-1], 1e-4)), fontsize=6,
                      xytext=(3, -2), textcoords="offset points",
                      color=COLOURS[s.method])  # fmt: skip
    axes.set(xscale="log", yscale="log", xlabel="load cycle", xlim=(1, 22),
             ylabel="mean residual settlement [mm]")  # fmt: skip
    axes.grid(alpha=0.3, which="both")
    axes.set_title("Residual settlement of the sleeper", fontsize=9, loc="left")


def state_forces(row: Row) -> tuple[Motion, ContactForces]:
    """State and contact forces of a recorded line."""
    position, angle = np.array(row["position"]), np.array(row["angle"])
    contacts = {name: np.array(values, dtype=float) for name, values in row["contacts"].items()}
    bodies, force = contacts["bodies"].astype(np.int64), contacts["force"]
    none = np.zeros(len(force))
    sliding = np.abs(force[:, 1]) >= MOBILISED * FRICTION * force[:, 0]
    status = np.where(force[:, 0] <= 0, "open", np.where(sliding, "slide", "stick"))
    found = ContactForces(
        bodies[:, 0], bodies[:, 1], contacts["point"], contacts["normal"], contacts["gap"],
        np.arange(len(force)), none, none, none + FRICTION, none,
        normal_force=force[:, 0], tangential_force=force[:, 1], status=status,
    )  # fmt: skip
    return Motion(position, angle, 0 * position, 0 * angle), found


def draw_chains_of(axes: Any, row: Row) -> None:
    """Force chains of a state under the peak load."""
    scene = bed_scene(Bed(**row["bed"]))
    motion, forces = state_forces(row)
    scale = force_scale([forces.normal_force])
    draw_bodies_2d(axes, scene, motion)
    draw_chains(axes, scene, motion, forces, scale, (0, 1))
    half = 0.5 * row["bed"]["width"]
    axes.set(xlim=(-1.03 * half, 1.03 * half), ylim=(-0.01, 0.30), aspect="equal", xticks=[],
             yticks=[])  # fmt: skip
    method = "rigid" if row["level"]["method"] == "rigid" else "soft"
    axes.set_title(f"{method} grains, {row['name']}; widest line {1e-3 * scale:.2g} kN/m",
                   fontsize=8, loc="left")  # fmt: skip


def picture_draw(rows: Sequence[Row], found: Sequence[Summary], limits: Limits, path: Path) -> None:
    """Write the picture."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 8.6), layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(2, 2, height_ratios=(1.25, 1.0), width_ratios=(1.25, 1.0))
    draw_errors(figure.add_subplot(grid[0, 0]), found, limits)
    draw_settlements(figure.add_subplot(grid[0, 1]), found)
    states = [row for row in rows if row["kind"] == "state"][:2]
    for column, row in enumerate(states):
        draw_chains_of(figure.add_subplot(grid[1, column]), row)
    figure.savefig(path, dpi=110)
