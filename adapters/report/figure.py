"""The picture of a report, settlement against load cycles; matplotlib is loaded to draw it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from adapters.bed import FloatArray
from adapters.procedure import History, Record

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COMPUTED, HEALING, JUMPED, CONTROL = "#0b5fa5", "#e07b00", "#8c8c8c", "#111111"
"""Colours of computed, healing and jumped cycles, and of the full run."""
SPAN = "#e9e9e9"
"""Shade of a jumped span."""


def make_panels(title: str) -> tuple[Figure, Axes, Axes]:
    """A figure with settlement (µm, downwards) against load cycles, linear and logarithmic."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.2, 3.8))
    linear, logarithmic = figure.subplots(1, 2, sharey=True)
    linear.set(ylabel="settlement of the loaded body (µm)", xlabel="load cycles")
    linear.invert_yaxis()
    logarithmic.set(xscale="log", xlabel="load cycles (logarithmic)")
    logarithmic.xaxis.set_major_formatter("{x:g}")
    logarithmic.set_title(title, loc="right")
    return figure, linear, logarithmic


def add_legend(figure: Figure, columns: int) -> None:
    """The legend of all curves above the figure; the linear axis of cycles begins at 0."""
    linear = figure.axes[0]
    linear.set_xlim(left=0)  # behind the curves: it keeps the axis from growing with them
    handles, labels = linear.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=columns, columnspacing=1.2)


def draw_settlement(
    run: History, control: History | None, spans: Sequence[tuple[int, int]], title: str,
    members: Sequence[Record] = (),
) -> Figure:  # fmt: skip
    """Settlement of the loaded body of a run, its jumped ``spans``, the full run beside it, and
    other ``members``."""
    figure, *panels = make_panels(title)
    for panel in panels:
        draw_members(panel, members)
        draw_curves(panel, run, control, spans)
    add_legend(figure, 5)
    return figure


def draw_members(panel: Axes, members: Sequence[Record]) -> None:
    """A thin line for the loaded body of each member, and for that of its full run."""
    for number, one in enumerate(members):
        tracks = {"full runs of members": one.control, "members": one.run}
        for (name, track), colour in zip(tracks.items(), (CONTROL, COMPUTED), strict=True):
            if track is not None:
                sunk, label = 1e6 * track.history.loaded_body, None if number else name
                panel.plot(track.history.cycle, sunk, color=colour, lw=0.6, alpha=0.6, label=label)


def draw_curves(
    panel: Axes, run: History, control: History | None, spans: Sequence[tuple[int, int]]
) -> None:
    for first, last in spans:
        panel.axvspan(first, last, color=SPAN, lw=0, zorder=0)
    if control is not None:
        full = 1e6 * control.loaded_body
        panel.plot(control.cycle, full, color=CONTROL, lw=1.1, label="full run (control)")
    if control is not None and spans:
        still = 1e6 * cut_out_jumps(run, control, spans)
        panel.plot(run.cycle, still, ":", color=JUMPED, lw=1.2, label="jump, move nothing")
    label: str | None = "jumped"
    for span in spans:
        ends = np.isin(run.cycle, span)
        if ends.sum() == 2:
            jumped = 1e6 * run.loaded_body[ends]
            panel.plot(run.cycle[ends], jumped, "--", color=COMPUTED, lw=1.1, label=label)
            label = None
    kinds = np.array(run.kind)
    size = 3 if len(kinds) < 150 else 1.8
    for kind, colour in (("computed", COMPUTED), ("healing", HEALING)):
        if (kinds == kind).any():
            # A line for the eye through dots; a gap wherever another kind of cycle lies between.
            shown = np.where(kinds == kind, 1e6 * run.loaded_body, np.nan)
            name = f"{kind} cycles"
            panel.plot(run.cycle, shown, ".-", ms=size, color=colour, label=name, lw=1.1)


def cut_out_jumps(run: History, control: History, spans: Sequence[tuple[int, int]]) -> FloatArray:
    """That of the full run with the jumped cycles cut out, at the rows of ``run``."""
    jumped = [sum(last - first for first, last in spans if last <= c) for c in run.cycle]
    return np.interp(run.cycle - np.array(jumped), control.cycle, control.loaded_body, right=np.nan)
