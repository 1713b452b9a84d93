"""docs/rigid-indeterminacy.png: error of the forces against stiffness, loading time and cost."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from validation.rigid_indeterminacy import LIGGGHTS, LIMIT, RELAXATION, SPRINGS

LEAST = 1e-16
"""Smaller errors are drawn there."""
MARKS = {SPRINGS: "o", LIGGGHTS: "^", RELAXATION: "s", LIMIT: "*"}
COLOURS = ("#0072B2", "#D55E00", "#009E73")
LINES = ("-", "--", ":")
"""Colours of Okabe and Ito, which the colour-blind tell apart, and a line each."""
SHOWN = ("beam on three supports", "pyramid of 15", "pyramid of 55")
SLIDING = ("pyramid of 15, friction 0.3", "pyramid of 55, friction 0.3")
Lines = Sequence[dict[str, Any]]


def curve(
    lines: Lines, scene: str, method: str, across: str, only: str = "error"
) -> tuple[list[float], list[float]]:
    """Values of ``across`` and errors of a method on a scene, in the order of the record."""
    rows = [
        (line[across], max(line[only], LEAST))
        for line in lines
        if line["scene"] == scene and line["method"] == method and line["error"] is not None
    ]
    return [x for x, _ in rows], [y for _, y in rows]


def picture_draw(lines: Lines, path: Path) -> None:
    """Write the picture of a record's lines."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 4.2), layout="constrained")
    stiff, cost, slow = figure.subplots(1, 3)
    for number, scene in enumerate(SHOWN):
        for method in (SPRINGS, LIGGGHTS):
            x, y = curve(lines, scene, method, "stiffness")
            if x:
                stiff.plot(x, y, MARKS[method] + LINES[number], color=COLOURS[number], markersize=4,
                           label=f"{method}, {scene}")  # fmt: skip
        for method in (SPRINGS, LIGGGHTS, RELAXATION, LIMIT):
            x, y = curve(lines, scene, method, "cpu_s")
            style = "" if method == LIMIT else LINES[number]
            if x:
                cost.plot(x, y, MARKS[method] + style, color=COLOURS[number], linewidth=0.8,
                          markersize=11 if method == LIMIT else 4,
                          label=method if number == 2 else None)  # fmt: skip
    for number, scene in enumerate(SLIDING):
        for method in (SPRINGS, LIGGGHTS):
            x, y = curve(lines, scene, method, "ramp")
            if x:
                slow.plot([max(v, 100) for v in x], y, MARKS[method] + LINES[number],
                          color=COLOURS[number], markersize=4,
                          label=f"{method}, {scene}")  # fmt: skip
    stiff.set(xscale="log", yscale="log", xlabel="stiffness, weights a metre",
              ylabel="greatest error of a contact force / weight", title="stiff limit")  # fmt: skip
    cost.set(xscale="log", yscale="log", xlabel="CPU time [s], one thread", title="cost")
    slow.set(xscale="log", yscale="log", xlabel="steps in which gravity grew (100: at once)",
             title="contacts that slide")  # fmt: skip
    for axes in (stiff, cost, slow):
        axes.grid(alpha=0.3)
        axes.legend(fontsize="x-small")
    figure.savefig(path, dpi=140)
