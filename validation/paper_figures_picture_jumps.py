"""A picture of docs/paper-figures.md: figures 6 and 7 of Karrech et al. (2007)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from validation.paper_figures import (
    FIRST,
    FIRST_LONG,
    JUMPS,
    LATE_RUNS,
    LONG_RUN,
    NOTHING,
    PAPER_LARGEST,
    PAPER_LONG,
    RUN,
    WINDOWS,
    Row,
)
from validation.paper_figures_picture import PAPER

SHOWN_H = 40
"""Length of the jumps of which E_r is drawn over k."""
SHOWN_RUNS = (RUN, LATE_RUNS[0])
"""Of which E_r is drawn over k and h."""
SHOWN_FIRST = (10, 500)
"""k_i, drawn full and dashed, of jumps of which E_r is drawn over h."""
SHOWN_K = 20
"""Window of which what moving nothing errs by is drawn over h."""
FIRST_COLOURS = {10: "#0072B2", 50: "#E69F00", 200: "#c8553d", 500: "#6a4c93"}
WINDOW_COLOURS = {5: "#0072B2", 20: "#E69F00", 80: "#c8553d"}
BEDS = {
    (RUN, *LATE_RUNS): ("paper scale", "-"),
    (LONG_RUN,): ("150 softer grains", "--"),
}


def draw(rows: Sequence[Row], target: Path) -> None:
    """A line of panels a law: E_r over k, over h, and the largest of all over k_i."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    jumps = [row for row in rows if row["figure"] == "6, 7"]
    figure, axes = pyplot.subplots(2, 3, figsize=(14, 8.4), layout="constrained")
    for line, number, law in zip(axes, (6, 7), PAPER_LARGEST, strict=True):
        title = f"Fig. {number}: {law} law"
        draw_windows(line[0], [row for row in jumps if row["run"] in SHOWN_RUNS], law, title)
        draw_lengths(line[1], [row for row in jumps if row["run"] in SHOWN_RUNS], law, title)
        draw_largest(line[2], jumps, law, title)
    figure.savefig(target, dpi=110, metadata={"Software": None})
    pyplot.close(figure)


def draw_windows(axis: Any, rows: Sequence[Row], law: str, title: str) -> None:
    """E_r against k for one h, of displacements and of coordinates: the law, and nothing moved."""
    for k_i, colour in FIRST_COLOURS.items():
        mine = [row for row in rows if row["jump"][0] == k_i and row["jump"][2] == SHOWN_H]
        k = [row["jump"][1] for row in mine]
        for key in ("loading", "coordinates"):
            label = f"$k_i$ = {k_i}" if key == "loading" else None
            axis.plot(k, [row[key][law] for row in mine], "o-", ms=4, color=colour, label=label)
            axis.plot(k, [row[key][NOTHING] for row in mine], ":", color=colour)
    k_long, below = PAPER_LONG
    axis.plot([k_long, max(WINDOWS)], [below] * 2, "k-", lw=1.2, label="the paper: below")
    axis.set(ylim=(1e-4, 1))
    axis.text(0.03, 0.93, "of displacements since cycle 0", transform=axis.transAxes, fontsize=8)
    axis.text(0.03, 0.52, "of coordinates", transform=axis.transAxes, fontsize=8)
    finish(axis, "k", WINDOWS, f"{title}, h = {SHOWN_H} (dotted: nothing moved)", "lower left")


def draw_lengths(axis: Any, rows: Sequence[Row], law: str, title: str) -> None:
    """E_r against h for three k and two k_i, of displacements and of coordinates: the law."""
    for k_i, line in zip(SHOWN_FIRST, ("o-", "s--"), strict=True):
        for k, colour in WINDOW_COLOURS.items():
            mine = [row for row in rows if row["jump"][:2] == [k_i, k]]
            h = [row["jump"][2] for row in mine]
            for key in ("loading", "coordinates"):
                label = f"$k_i$ = {k_i}, k = {k}" if key == "loading" else None
                error = [row[key][law] for row in mine]
                axis.plot(h, error, line, ms=4, color=colour, label=label)
                if k == SHOWN_K:
                    axis.plot(h, [row[key][NOTHING] for row in mine], ":", color="0.4")
    k_long, below = PAPER_LONG
    axis.axhline(below, color="black", lw=1.2, label=f"the paper, k ≥ {k_long}: below")
    axis.set(ylim=(8e-5, 6))
    axis.text(0.03, 0.70, "of displacements", transform=axis.transAxes, fontsize=8)
    axis.text(0.66, 0.12, "of coordinates", transform=axis.transAxes, fontsize=8)
    finish(axis, "h", JUMPS, f"{title} (dotted: nothing moved, k = {SHOWN_K})", "upper left")


def draw_largest(axis: Any, rows: Sequence[Row], law: str, title: str) -> None:
    """The largest E_r of coordinates over all k and h against k_i, with what the paper prints."""
    for runs, (words, line) in BEDS.items():
        for method, colour in ((law, "#0072B2"), (NOTHING, "0.5")):
            found: dict[int, float] = {}
            for row in sorted(rows, key=lambda row: row["jump"]):
                if row["run"] in runs:
                    k_i, error = row["jump"][0], row["coordinates"][method]
                    found[k_i] = max(error, found.get(k_i, 0.0))
            label = f"{words}: {method}"
            axis.plot(
                list(found), list(found.values()), "o" + line, ms=4, color=colour, label=label
            )
    axis.plot([FIRST[0], FIRST_LONG[-1]], PAPER_LARGEST[law], **PAPER)
    axis.set(ylim=(4e-4, 0.3))
    finish(
        axis, "$k_i$", FIRST_LONG, f"{title}, coordinates: largest over k and h", "lower left", 1
    )


def finish(
    axis: Any, name: str, ticks: Sequence[int], title: str, place: str, columns: int = 2
) -> None:
    """Logarithmic axes, the study's values as ticks, a legend at ``place``."""
    axis.set(xscale="log", yscale="log", xlabel=name, ylabel="$E_r$")
    axis.set_xticks(ticks, [str(tick) for tick in ticks])
    axis.minorticks_off()
    axis.set_title(title, fontsize=10)
    axis.legend(fontsize=8, loc=place, ncols=columns)
