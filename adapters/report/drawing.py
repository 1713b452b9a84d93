"""Colours and axes of a report's figures; matplotlib is loaded when one is drawn."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

COMPUTED, HEALING, JUMPED, CONTROL, OTHER = "#0b5fa5", "#e07b00", "#8c8c8c", "#111111", "#2a9d6f"
"""Colours of computed, healing and jumped cycles, of the full run, and of anything else."""


SPAN = "#e9e9e9"
"""Shade of a jumped span."""


WIDTH = 7.2
"""Width of a figure [inch]."""


def make_panels(rows: int, columns: int, height: float, **keywords: Any) -> tuple[Figure, Any]:
    """A figure of the report's width and its array of axes."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH, height))
    return figure, figure.subplots(rows, columns, squeeze=False, **keywords)


def set_logarithmic(panel: Axes, name: Literal["x", "y"]) -> None:
    """A logarithmic axis with plain numbers at 1, 2 and 5 where there is room, else at decades."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    panel.set(**{f"{name}scale": "log"})
    axis: Axis = panel.xaxis if name == "x" else panel.yaxis
    low, high = panel.get_xlim() if name == "x" else panel.get_ylim()
    roomy = abs(np.log10(high / low)) < 2.2
    axis.set_major_locator(LogLocator(subs=(1, 2, 5) if roomy else (1,)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def shade_spans(axes: Axes, spans: Sequence[tuple[int, int]]) -> None:
    for first, last in spans:
        axes.axvspan(first, last, color=SPAN, lw=0, zorder=0)
