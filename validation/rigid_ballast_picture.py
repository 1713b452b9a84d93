"""docs/rigid-ballast.png: error against cost, settlement against cycles, force chains."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rigid_lcp.contacts import ContactForces
from rigid_lcp.motion import Motion
from rigid_lcp.pictures import draw_bodies_2d, draw_chain_legend, draw_chains, force_scale
from validation.rigid_ballast_bed import FRICTION, Bed, bed_scene
from validation.rigid_ballast_judge import Summary
from validation.rigid_ballast_md import STEP_SHARE
from validation.rigid_ballast_measures import MOBILISED
from validation.rigid_ballast_push import Push
from validation.rigid_ballast_runs import TOLERANCE

Row = dict[str, Any]
COLOURS = {"rigid": "#0b5fa5", "soft": "#d1495b"}
LEAST_ERROR = 1e-2
"""Errors are drawn no smaller [-]."""


def short_name(summary: Summary) -> str:
    """What is written beside a mark: the step in ms or the stiffness, others than usual with
    their residual or their share of the step."""
    value, extra = summary.level["value"], summary.level["extra"]
    if summary.method == "rigid":
        control = "" if extra == TOLERANCE else f", res. {extra:.0e}".replace("e-0", "e-")
        return f"h = {1e3 * value:g} ms{control}"
    control = "" if extra == STEP_SHARE else f", {extra / STEP_SHARE:g} x the step"
    return f"k = {value:.0e}{control}".replace("e+0", "e").replace("e+", "e")


def draw_pushes(axes: Any, pushes: Sequence[Push]) -> None:
    """The first push: error of the sleeper's way against processor time, all beds and medians."""
    rigid = sorted(p.cost for p in pushes if p.method == "rigid")
    for p in pushes:
        colour = COLOURS[p.method]
        cost = [p.costs[seed] for seed in p.errors]
        axes.plot(cost, [1e6 * e for e in p.errors.values()], ".", color=colour, alpha=0.3,
                  markersize=4)  # fmt: skip
        axes.plot(p.cost, 1e6 * p.error, "o", color=colour, markersize=7,
                  fillstyle="none" if p.is_limit else "full")  # fmt: skip
        value = p.level["value"]
        name = f"{1e3 * value:g} ms" if p.method == "rigid" else f"{value:.0e}".replace("e+", "e")
        place, side = (6, -9), "left"
        if p.method == "rigid":  # neighbours cost alike: in turns above and below
            place, side = (0, (7, -13)[rigid.index(p.cost) % 2]), "center"
        axes.annotate(name, (p.cost, 1e6 * p.error), fontsize=7, color=colour, ha=side,
                      xytext=place, textcoords="offset points")  # fmt: skip
    axes.set(xscale="log", yscale="log", xlabel="processor time, one thread [s]",
             ylabel="distance from the reference [um]")  # fmt: skip
    axes.grid(alpha=0.3, which="both")
    axes.set_title("First push: error of the sleeper's way, bed by bed", fontsize=8, loc="left")


def draw_errors(axes: Any, found: Sequence[Summary]) -> None:
    """Every level: error of the mean settlement, with its interval, against processor time.

    Soft grains have their names at the foot, rigid ones above: levels may cost alike.
    """
    for method, colour in COLOURS.items():
        for s in found:
            if s.method != method:
                continue
            ends = [max(abs(s.error) - s.error_interval, LEAST_ERROR),
                    abs(s.error) + s.error_interval]  # fmt: skip
            axes.plot([s.cost, s.cost], ends, color=colour, linewidth=1, alpha=0.5)
            axes.plot([s.cost], [max(abs(s.error), LEAST_ERROR)], "o", color=colour, markersize=7,
                      fillstyle="none" if s.is_limit else "full")  # fmt: skip
            label_at, place = (LEAST_ERROR, (6, 4)) if method == "soft" else (ends[1], (0, 3))
            axes.annotate(short_name(s), (s.cost, label_at), rotation=90, fontsize=7,
                          ha="center", xytext=place, color=colour,
                          textcoords="offset points")  # fmt: skip
        axes.plot([], [], "o", color=colour, label={
            "rigid": "rigid grains (step h)", "soft": "soft grains, MD (k in N/m)",
        }[method])  # fmt: skip
    axes.set(xscale="log", yscale="log", ylim=(LEAST_ERROR, 40),
             xlabel="processor time of a run, one thread [s]",
             ylabel="|mean - reference| / reference of the settlement [-]")  # fmt: skip
    axes.grid(alpha=0.3, which="both")
    axes.legend(fontsize=8, loc="upper right")
    axes.set_title("Five cycles, 95 %; hollow: finest, judged by the other's",
                   fontsize=8, loc="left")  # fmt: skip


def spread(heights: Sequence[float], apart: float) -> list[float]:
    """Heights of labels, in their order, moved down until each is ``apart`` below the next."""
    order = np.argsort(heights)[::-1]
    placed = np.array(heights, dtype=float)
    for above, here in itertools.pairwise(order):
        placed[here] = min(placed[here], placed[above] - apart)
    return list(placed)


def draw_settlements(axes: Any, found: Sequence[Summary]) -> None:
    """Mean settlement against the number of cycles, and the interval of the limits."""
    ends = [1e3 * s.curve[-1] for s in found]
    top = 1.2 * sorted(ends)[-2]  # one level may leave the picture
    label_at = spread([min(end, 0.95 * top) for end in ends], 0.035 * top)
    for s, height in zip(found, label_at, strict=True):
        cycles = np.arange(1, len(s.curve) + 1)
        axes.plot(cycles, 1e3 * s.curve, color=COLOURS[s.method], linewidth=2 if s.is_limit else 1,
                  alpha=1 if s.is_limit else 0.6)  # fmt: skip
        axes.annotate(short_name(s), (cycles[-1], height), fontsize=7, xytext=(6, -2),
                      textcoords="offset points", color=COLOURS[s.method])  # fmt: skip
        if s.is_limit:
            axes.errorbar(cycles[-1], 1e3 * s.settlement, yerr=1e3 * s.interval, capsize=3,
                          color=COLOURS[s.method], linewidth=1)  # fmt: skip
    last = max(len(s.curve) for s in found)
    axes.set(xlabel="load cycle", xlim=(0.8, 1.45 * last), ylim=(0, top),
             ylabel="mean residual settlement [mm]", xticks=range(1, last + 1))  # fmt: skip
    axes.grid(alpha=0.3, which="both")
    axes.set_title("Residual settlement of the sleeper; wide: finest levels", fontsize=8,
                   loc="left")  # fmt: skip


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
    draw_chain_legend(axes, scale, "N/m")
    half = 0.5 * row["bed"]["width"]
    axes.set(xlim=(-1.03 * half, 1.03 * half), ylim=(-0.01, 0.30), aspect="equal", xticks=[],
             yticks=[])  # fmt: skip
    level = row["level"]
    name = (f"rigid grains, h = {1e3 * level['value']:g} ms" if level["method"] == "rigid"
            else f"soft grains, k = {level['value']:.0e} N/m".replace("e+0", "e"))  # fmt: skip
    axes.set_title(f"{name}: peak of cycle {row['cycle'] + 0.5:.0f}", fontsize=8, loc="left")


def picture_draw(
    rows: Sequence[Row], found: Sequence[Summary], pushes: Sequence[Push], path: Path
) -> None:
    """Write the picture."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.6, 8.6), layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(2, 6, height_ratios=(1.2, 1.0))
    draw_errors(figure.add_subplot(grid[0, 0:2]), found)
    draw_pushes(figure.add_subplot(grid[0, 2:4]), pushes)
    draw_settlements(figure.add_subplot(grid[0, 4:6]), found)
    states = [row for row in rows if row["kind"] == "state"][:2]
    for column, row in enumerate(states):
        draw_chains_of(figure.add_subplot(grid[1, 3 * column : 3 * column + 3]), row)
    figure.savefig(path, dpi=110)
