"""The page docs/size-ratio.md and its figure: paths of the small grain."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from adapters.scene.mechanics import find_wedge_ratio
from validation.figure import draw_figure
from validation.studies.size_ratio.bars import check_bars
from validation.studies.size_ratio.run import ENGINES, FRICTIONS, RATIOS, SHARES
from validation.study import describe_commits, format_table, summarise_bars

Row = dict[str, Any]


def describe(rows: Sequence[Row]) -> dict[str, str]:
    """The text for each mark of the page."""
    found = {(row["engine"], row["friction"], row["share"], row["ratio"]): row for row in rows}
    lines = []
    for engine in ENGINES:
        for friction in FRICTIONS:
            for share in SHARES:
                cells = []
                for ratio in RATIOS:
                    row = found.get((engine, friction, share, ratio))
                    cells.append("" if row is None else "falls" if row["falls"] else "**sticks**")
                lines.append([engine, f"{friction:g}", f"{share:g}", *cells])
    machines = "; ".join(dict.fromkeys(row["origin"]["machine"] for row in rows))
    commits = describe_commits(row["origin"]["commit"] for row in rows)
    return {
        "RUNS": format_table(["engine", "friction", "step", *(f"{r:g}" for r in RATIOS)], lines),
        "BARS": summarise_bars(check_bars(rows)),
        "OFF": f"{max(abs(row['off']) for row in rows):.1g}",
        "ORIGIN": f"{machines}; commits {commits}.",
    }


def draw(rows: Sequence[Row], picture: Path) -> None:
    """Where runs stick, over friction and size ratio, beside the wedge ratio."""

    def draw_panel(figure: Any) -> None:
        axes = figure.subplots()
        friction = np.linspace(0.2, 1.2, 101)
        axes.plot(friction, [find_wedge_ratio(one) for one in friction], "k",
                  label="friction alone holds a grain above")  # fmt: skip
        for stuck, style in ((False, "o"), (True, "X")):
            mine = [row for row in rows if row["falls"] != stuck and "sync" not in row["engine"]]
            axes.plot([row["friction"] for row in mine], [row["ratio"] for row in mine], style,
                      ms=9 if stuck else 5, color="#D55E00" if stuck else "#0072B2",
                      label="sticks in some runs" if stuck else "falls in some")  # fmt: skip
        axes.axhline(2.8, color="0.6", lw=0.8)
        axes.text(0.22, 2.9, "ballast 31.5/50 with its grading", fontsize=8)
        axes.set(xlabel="friction", ylabel="ratio of radii", yscale="log", ylim=(1.5, 40))
        axes.legend(fontsize=8)

    draw_figure((6, 4), draw_panel, picture)
