"""The style of a report's figures, and how one is written; matplotlib is loaded to draw one."""

from __future__ import annotations

from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from trackbed.run_files import write_whole

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STYLE: Any = {
    "font.size": 9.5, "figure.constrained_layout.use": True, "savefig.dpi": 170,
    "svg.hashsalt": "trackbed", "svg.fonttype": "path",
    "axes.titlesize": 10, "axes.titlelocation": "left", "axes.linewidth": 0.8,
    "axes.spines.top": False, "axes.spines.right": False, "axes.edgecolor": "#555555",
    "axes.grid": True, "axes.axisbelow": True, "grid.color": "#e3e3e3", "grid.linewidth": 0.6,
    "xtick.color": "#333333", "ytick.color": "#333333", "lines.linewidth": 1.5,
    "legend.frameon": False, "legend.fontsize": 8.5,
}  # fmt: skip


def save_figure(draw: Callable[[], Figure], path: Path) -> Path:
    """Draw a figure and write it to ``path`` (svg or png), whole; the same bytes each time."""
    import matplotlib

    with matplotlib.rc_context(STYLE):
        write_whole(path, encode_figure(draw(), path.suffix))
    return path


def encode_figure(figure: Figure, suffix: str) -> bytes:
    """The file of a figure, ``.svg`` or ``.png``, without date and name of the program."""
    stream = BytesIO()
    plain = {"Date": None} if suffix == ".svg" else {"Software": None}
    figure.savefig(stream, format=suffix.removeprefix("."), metadata=plain)
    return stream.getvalue()
