"""A study's one figure, written as PNG."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any


def draw_figure(size: tuple[float, float], draw: Callable[[Any], None], picture: Path) -> None:
    """A matplotlib figure of ``size`` [inch] that ``draw`` fills, its labels parted."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    FigureCanvasAgg(figure)
    draw(figure)
    part_labels(figure)
    figure.savefig(picture, dpi=90, metadata={"Software": None})


def label_point(axes: Any, name: str, place: tuple[float, float], colour: str = "black") -> None:
    """The name of a point beside it."""
    axes.annotate(name, place, (6, 2), textcoords="offset points", fontsize=7, color=colour)


def part_labels(figure: Any) -> None:
    """Move labels of `label_point` up until none covers another of its panel."""
    figure.draw_without_rendering()
    for axes in figure.axes:
        placed: list[Any] = []
        for label in sorted(axes.texts, key=lambda text: text.get_window_extent().y0):
            while any(label.get_window_extent().overlaps(other) for other in placed):
                x, y = label.xyann
                label.xyann = x, y + 1
            placed.append(label.get_window_extent())
