"""The figures of a report, one function each; matplotlib is loaded when one is drawn.

Every function returns a figure that `save_figure` writes.  Lengths come in m and are shown in
um or mm, shares in per cent.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from adapters.bed import FloatArray
from adapters.procedure import FORCE_ERROR_GOAL, FORCE_START_CYCLES, History
from adapters.report.drawing import (
    COMPUTED,
    CONTROL,
    HEALING,
    JUMPED,
    OTHER,
    SPAN,
    WIDTH,
    make_panels,
    set_logarithmic,
    shade_spans,
)
from adapters.report.error import Comparison, CostLine
from adapters.report.preparation import PreparationSeries
from adapters.report.spheres import draw_spheres, extent_of
from adapters.report.verdict import CostSplit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


ERROR_SHOWN = 0.05
"""Least error of a settlement shown [%]: no single run of a chaotic bed says anything below."""


def draw_settlement(
    run: History,
    control: History | None,
    others: Sequence[tuple[str, History]],
    spans: Sequence[tuple[int, int]],
    title: str,
) -> Figure:
    """Settlement against load cycles, linear and logarithmic: the picture of the report."""
    figure, axes = make_panels(1, 2, 3.7, sharey=True)
    for panel in axes[0]:
        draw_settlement_panel(panel, run, control, others, spans)
    axes[0, 0].set_ylabel("mean settlement of the grains (µm)")
    axes[0, 0].invert_yaxis()
    set_logarithmic(axes[0, 1], "x")
    axes[0, 0].set_xlim(left=0)
    axes[0, 1].set_title(title, loc="right")
    axes[0, 0].set_xlabel("load cycles")
    axes[0, 1].set_xlabel("load cycles (logarithmic)")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=5, columnspacing=1.2)
    return figure


def draw_settlement_panel(
    panel: Axes,
    run: History,
    control: History | None,
    others: Sequence[tuple[str, History]],
    spans: Sequence[tuple[int, int]],
) -> None:
    shade_spans(panel, spans)
    for name, other in others:
        panel.plot(other.cycle, 1e6 * other.settlement, color=OTHER, lw=0.9, label=name)
    if control is not None:
        panel.plot(
            control.cycle,
            1e6 * control.settlement,
            color=CONTROL,
            lw=1.1,
            label="full run (control)",
        )
        if spans:
            still = cut_out_jumps(run, control, spans)
            panel.plot(
                run.cycle, 1e6 * still, ":", color=JUMPED, lw=1.2, label="jump, move nothing"
            )
    kinds = np.array(run.kind)
    label: str | None = "jumped"
    for first, last in spans:
        ends = [np.flatnonzero(run.cycle == cycle) for cycle in (first, last)]
        if all(len(end) for end in ends):
            rows = [int(end[0]) for end in ends]
            x, y = run.cycle[rows], 1e6 * run.settlement[rows]
            panel.plot(x, y, "--", color=COMPUTED, lw=1.1, label=label)
            label = None
    for kind, colour in (("computed", COMPUTED), ("healing", HEALING)):
        if (kinds == kind).any():
            # A line for the eye through dots; a gap wherever another kind of cycle lies between.
            shown = np.where(kinds == kind, 1e6 * run.settlement, np.nan)
            size = 3 if len(kinds) < 150 else 1.8
            panel.plot(
                run.cycle, shown, ".-", ms=size, color=colour, label=f"{kind} cycles", lw=1.1
            )


def cut_out_jumps(run: History, control: History, spans: Sequence[tuple[int, int]]) -> FloatArray:
    """Settlement of the full run with the jumped cycles cut out, at the rows of ``run``."""
    jumped = [sum(last - first for first, last in spans if last <= c) for c in run.cycle]
    return np.interp(run.cycle - np.array(jumped), control.cycle, control.settlement, right=np.nan)


def draw_error_cost(
    rows: Sequence[Comparison],
    lines: Sequence[tuple[str, CostLine]],
    scatter: float,
    scatter_name: str,
) -> Figure:
    """Work against precision: error of the settlement against CPU time, both logarithmic.

    ``scatter``: relative error below which two full runs are not distinguishable; nan for unknown.
    """
    figure, axes = make_panels(1, 1, 3.6)
    panel = axes[0, 0]
    for (name, line), (style, colour) in zip(lines, (("-", JUMPED), (".-", OTHER)), strict=False):
        seen = np.abs(line.settlement_error) > 0
        panel.plot(
            line.cpu_s[seen],
            100 * np.abs(line.settlement_error[seen]),
            style,
            color=colour,
            label=name,
        )
    marks = ("o", "s", "D", "^", "v", "P", "X")
    shown = [row for row in rows if row.settlement_error and np.isfinite(row.settlement_error)]
    for row, mark in zip(shown, marks, strict=False):
        first = row is rows[0]
        panel.plot(
            row.cpu_s,
            100 * abs(row.settlement_error),
            mark,
            ms=10 if first else 7,
            color=COMPUTED if first else HEALING,
            mec="white",
            label=f"{row.name}: {row.computed} cycles computed",
            zorder=5,
        )
    if np.isfinite(scatter):
        panel.axhspan(0, 100 * scatter, color=SPAN, lw=0, label=scatter_name)
    full = rows[-1].cpu_s
    panel.axvline(full, color=CONTROL, lw=1.1, label="cost of the full run")
    panel.set_xlim(left=full / 20)
    panel.set_ylim(bottom=ERROR_SHOWN)
    set_logarithmic(panel, "x")
    set_logarithmic(panel, "y")
    panel.set_xlabel("CPU time from the start of loading (s)")
    panel.set_ylabel("|error of the settlement| (%)")
    figure.legend(loc="outside right upper")
    return figure


def draw_coordination(
    run: History, control: History | None, spans: Sequence[tuple[int, int]]
) -> Figure:
    """Coordination number and relative density against load cycles."""
    columns = (
        ("coordination_number", "coordination number\n(contacts with grains)"),
        ("relative_density", "relative density"),
    )
    figure, axes = make_panels(2, 1, 4.4, sharex=True)
    for panel, (column, label) in zip(axes[:, 0], columns, strict=True):
        shade_spans(panel, spans)
        if control is not None:
            panel.plot(
                control.cycle,
                getattr(control, column),
                color=CONTROL,
                lw=0.9,
                label="full run (control)",
            )
        kinds = np.array(run.kind)
        for kind, colour, mark in (
            ("computed", COMPUTED, "."),
            ("healing", HEALING, "."),
            ("jumped", "#b02020", "x"),
        ):
            if (kinds == kind).any():
                name = "after a jump, relaxed" if kind == "jumped" else f"{kind} cycles"
                rows = kinds == kind
                panel.plot(
                    run.cycle[rows],
                    getattr(run, column)[rows],
                    mark,
                    color=colour,
                    ms=5,
                    label=name,
                )
        panel.set_ylabel(label)
    axes[1, 0].set_xlabel("load cycles")
    axes[1, 0].set_xlim(left=0)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=4)
    return figure


def draw_penetration(jumps: Sequence[tuple[str, dict[str, FloatArray]]]) -> Figure:
    """Histograms of the penetrations before each jump, as estimated, and relaxed [m]."""
    figure, axes = make_panels(len(jumps), 1, 0.9 + 1.75 * len(jumps), sharex=True)
    known = np.concatenate([each for _, beds in jumps for each in beds.values()])
    low = max(float(np.quantile(known, 0.005)), 1e-12)
    bins = np.geomspace(low, max(1.1 * float(known.max()), 10 * low), 45)
    styles = {"before": (CONTROL, "-"), "estimated": (HEALING, "-"), "relaxed": (COMPUTED, "--")}
    for panel, (name, beds) in zip(axes[:, 0], jumps, strict=True):
        for when, overlap in beds.items():
            count, _ = np.histogram(np.maximum(overlap, low), bins)
            panel.stairs(
                count,
                1e6 * bins,
                color=styles[when][0],
                ls=styles[when][1],
                lw=1.4,
                label=f"{when}",
            )
        panel.set_title(name)
        panel.set_ylabel("contacts")
    set_logarithmic(axes[-1, 0], "x")
    axes[-1, 0].set_xlabel("penetration (µm)")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=3)
    return figure


def draw_sample(panels: Sequence[tuple[str, FloatArray, FloatArray]], radius: FloatArray) -> Figure:
    """The sample at several instants: title, centres [m], (n, 3), residual moves [m], (n,)."""
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import PowerNorm
    from matplotlib.ticker import MaxNLocator

    longest = max(float(np.quantile(displacement, 0.98)) for _, _, displacement in panels)
    # The square root spreads the many small moves; a linear scale would show the few large ones.
    norm = PowerNorm(0.5, 0.0, 1e6 * longest if longest > 0 else 1.0)
    extent = extent_of([position for _, position, _ in panels], radius)
    aspect = (extent[3] - extent[2]) / (extent[1] - extent[0])
    figure, axes = make_panels(1, len(panels), 1.0 + WIDTH / len(panels) * min(aspect, 2.0))
    for panel, (title, position, displacement) in zip(axes[0], panels, strict=True):
        colour = colormaps["viridis"](norm(1e6 * displacement))[:, :3]
        panel.imshow(
            draw_spheres(position, radius, colour, extent, 640),
            extent=[1e3 * end for end in extent],
            interpolation="antialiased",
        )
        panel.set_title(title, loc="center")
        panel.set_axis_off()
    _scale_bar(axes[0, 0], extent)
    figure.colorbar(
        ScalarMappable(norm, "viridis"),
        ax=list(axes[0]),
        orientation="horizontal",
        shrink=0.55,
        aspect=40,
        ticks=MaxNLocator(4),
        extend="max",
        label="residual displacement since the start of loading (µm)",
    )
    return figure


def _scale_bar(panel: Axes, extent: tuple[float, float, float, float]) -> None:
    """A bar of a round number of millimetres below the sample."""
    width = 1e3 * (extent[1] - extent[0])
    length = 10.0 ** np.floor(np.log10(width / 2))
    x, y = 1e3 * extent[0] + 0.02 * width, 1e3 * extent[2] + 0.02 * width
    panel.plot([x, x + length], [y, y], color=CONTROL, lw=2, clip_on=False)
    panel.annotate(
        f"{length:g} mm", (x + length / 2, y), (0, 4), textcoords="offset points", ha="center"
    )


def draw_preparation(
    series: PreparationSeries, paper_density: float | None, paper_coordination: float | None
) -> Figure:
    """The rain of grains in time, as Fig. 3 of the paper (a to d)."""
    figure, axes = make_panels(2, 2, 4.8, sharex=True)
    mark = "." if len(series.time) < 40 else ""
    panels = axes.ravel()
    panels[0].plot(series.time, series.apparent_weight, mark + "-", color=COMPUTED)
    panels[0].set_title("a  apparent weight (N)")
    panels[1].plot(series.time, series.coordination_number, mark + "-", color=COMPUTED)
    panels[1].set_title("b  coordination number (grains)")
    panels[2].plot(series.frame_time, series.relative_density, mark + "-", color=COMPUTED)
    panels[2].set_title("c  relative density")
    for name, energy, colour in (
        ("translational", series.translational, COMPUTED),
        ("rotational", series.rotational, HEALING),
    ):
        seen = energy > 0
        panels[3].plot(series.time[seen], energy[seen], mark + "-", color=colour, label=name)
    panels[3].axhline(1e-6, color=CONTROL, ls="--", lw=1, label="criterion")
    panels[3].set_yscale("log")
    panels[3].set_title("d  kinetic over potential energy")
    panels[3].legend(loc="best")
    for panel, value in ((panels[1], paper_coordination), (panels[2], paper_density)):
        if value is not None:
            panel.axhline(value, color=CONTROL, ls=":", lw=1.1, label=f"paper: {value:g}")
            panel.legend(loc="lower right")
    for panel in panels[2:]:
        panel.set_xlabel("time (s)")
    return figure


def draw_piston(
    run: History,
    spans: Sequence[tuple[int, int]],
    cycle: int,
    phase: FloatArray,
    target: FloatArray,
    contact: FloatArray,
) -> Figure:
    """Force error of every cycle; target and contact force [N] over one ``cycle`` (phase 0-1)."""
    figure, axes = make_panels(1, 2, 3.2)
    panel = axes[0, 0]
    shade_spans(panel, spans)
    rows = np.isfinite(run.force_error) & (run.force_error > 0)
    early = run.cycle <= FORCE_START_CYCLES
    for which, colour, name in (
        (rows & ~early, COMPUTED, "each cycle"),
        (rows & early, HEALING, "first three cycles"),
    ):
        if which.any():
            panel.plot(
                run.cycle[which], 100 * run.force_error[which], ".", color=colour, label=name
            )
    bar = 100 * FORCE_ERROR_GOAL
    panel.axhline(bar, color=CONTROL, ls="--", lw=1, label=f"bar {bar:g} %")
    set_logarithmic(panel, "y")
    panel.set_xlabel("load cycles")
    panel.set_ylabel("rms force error over peak (%)")
    panel.legend()
    panel = axes[0, 1]
    panel.plot(phase, target, color=CONTROL, lw=2.6, alpha=0.35, label="target")
    panel.plot(phase, contact, color=COMPUTED, lw=1.1, label="contact force")
    panel.set_title(f"cycle {cycle}")
    panel.set_xlabel("phase in the cycle")
    panel.set_ylabel("force on the piston (N)")
    panel.legend()
    return figure


def draw_cost(costs: Sequence[CostSplit]) -> Figure:
    """CPU time by purpose, one bar for each run."""
    parts = (
        ("engine", "engine: time steps", COMPUTED),
        ("start_up", "engine: start-up", "#8cc0e8"),
        ("failed_jumps", "failed jumps", "#b02020"),
        ("parse", "parse", HEALING),
        ("fit", "fit", OTHER),
        ("relax", "relax", "#7b3fa0"),
        ("other_python", "other Python", "#c9c9c9"),
    )
    figure, axes = make_panels(1, 1, 1.5 + 0.45 * len(costs))
    panel = axes[0, 0]
    left = np.zeros(len(costs))
    names = [cost.name for cost in costs]
    for field_, label, colour in parts:
        seconds = np.array([max(getattr(cost, field_), 0.0) for cost in costs])
        if seconds.any():
            panel.barh(names, seconds, left=left, color=colour, height=0.6, label=label)
        left += seconds
    panel.invert_yaxis()
    panel.grid(axis="y", visible=False)
    panel.set_xlabel("CPU time from the start of loading (s)")
    figure.legend(loc="outside upper center", ncols=4)
    return figure
