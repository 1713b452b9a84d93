"""The picture of ``docs/moves.md``: error of a jump's field against its cost."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from adapters.moves import DEFAULT
from validation.move_study import Row
from validation.move_study_offline import OTHER_MEMBER
from validation.move_study_reading import SCALES, cost_of, median_of, offline_rows, ways_of


def draw(rows: Sequence[Row], target: Path) -> None:
    """Each scale a panel: as estimated (hollow) and after the relaxation (full) over CPU time."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(1, len(SCALES), figsize=(11, 4.2), sharey=True)
    for axis, scale in zip(axes, SCALES, strict=True):
        draw_scale(axis, rows, scale)
    axes[0].set_ylabel("error of the field (1 = move nothing)")
    figure.tight_layout()
    figure.savefig(target, dpi=110)
    pyplot.close(figure)


def draw_scale(axis: Any, rows: Sequence[Row], scale: str) -> None:
    """A panel; runs of another member are no way to jump and are left out."""
    for way in ways_of(rows):
        mine = offline_rows(rows, scale, way)
        if not mine or way == OTHER_MEMBER:
            continue
        color = {DEFAULT: "#1b6ca8", "shrunk": "#c8553d"}.get(way, "0.35")
        cost, before = 1e3 * cost_of(mine), 1e3 * median_of(mine, "move_s")
        error, relaxed = median_of(mine, "field"), median_of(mine, "field_relaxed")
        axis.plot([max(before, 0.1), cost], [error, relaxed], "-", color=color, lw=0.8)
        axis.plot(max(before, 0.1), error, "o", mfc="none", color=color, ms=5)
        axis.plot(cost, relaxed, "o", color=color, ms=6)
        axis.annotate(
            way, (max(before, 0.1), error), fontsize=7, xytext=(-3, 5), textcoords="offset points"
        )
    axis.axhline(1, color="0.6", lw=0.7, ls=":")
    count = len({(row["run"], *row["jump"]) for row in rows if row["run"] in SCALES[scale]})
    axis.set(xscale="log", xlabel="CPU time of a jump, ms: estimate (hollow), with relaxation")
    axis.set_title(f"{scale}: {count} windows", fontsize=9)
