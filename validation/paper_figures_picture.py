"""The picture of docs/paper-figures.md: figures 3, 5, 6, 7 and 9 of Karrech et al. (2007)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from validation.paper_figures import NOTHING, SHARES, WINDOWS, Row

COLOURS = {10: "#0072B2", 50: "#E69F00", 200: "#c8553d"}
"""k_i -> colour."""
SHOWN_H = 40
"""Length of the jumps of Figs 6 and 7 as drawn."""
WAYS = {
    "before": ("before", "0.5", "-"),
    "estimate": ("estimate", "#E69F00", "-"),
    "karrech2007": ("eq. 29, frontier held", "#0072B2", "--"),
    "smallest-move": ("smallest move", "#c8553d", ":"),
}


def draw(rows: Sequence[Row], target: Path) -> None:
    """Six panels: two of Fig. 3, Fig. 5, Fig. 6, Fig. 7, Fig. 9."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(2, 3, figsize=(14, 8), layout="constrained")
    (rain,) = (row for row in rows if row["figure"] == "3")
    draw_rain(axes[0, 0], axes[0, 1], rain)
    draw_accuracy(axes[0, 2], [row for row in rows if row["figure"] == "5"])
    jumps = [row for row in rows if row["figure"] == "6, 7"]
    draw_jumps(axes[1, 0], jumps, "linear", "Fig. 6: linear law")
    draw_jumps(axes[1, 1], jumps, "log", "Fig. 7: log law")
    draw_overlaps(axes[1, 2], [row for row in rows if row["figure"] == "9"])
    figure.savefig(target, dpi=110, metadata={"Software": None})
    pyplot.close(figure)


def draw_rain(left: Any, right: Any, rain: Row) -> None:
    """Fig. 3: contacts and density to the left, weight and energies to the right."""
    left.plot(rain["time"], rain["coordination_number"], color="#0072B2", label="contacts a grain")
    left.set(xlabel="time [s]", ylabel="coordination number", title="Fig. 3: rain of grains")
    density = left.twinx()
    density.plot(rain["frame_time"], rain["relative_density"], "o-", ms=3, color="#c8553d")
    density.set_ylabel("relative density", color="#c8553d")
    weight = np.array(rain["apparent_weight"]) / rain["figures"]["weight"]
    right.plot(rain["time"], weight, color="0.2", label="force on the floor over weight")
    for name, colour in (("translational", "#0072B2"), ("rotational", "#009E73")):
        ratio = np.abs(rain[name])
        right.plot(rain["time"], ratio, color=colour, label=f"{name} energy over potential")
    right.set(yscale="log", xlabel="time [s]", title="Fig. 3: weight and energies", ylim=(1e-9, 10))
    right.legend(fontsize=8)


def draw_accuracy(axis: Any, rows: Sequence[Row]) -> None:
    """Fig. 5: g_u and f_xi against k."""
    for row, colour in zip(rows, ("#0072B2", "#c8553d"), strict=True):
        for key, words, line in (("g_u", "$g_u$", "-"), ("f_xi", r"$f_\xi$", "--")):
            k = np.arange(1, len(row[key]) + 1)
            label = f"{words}, $k_i$ = {row['k_i']}"
            axis.plot(k[1:], 1e6 * np.array(row[key])[1:], line, color=colour, label=label)
    k = np.array([2, 100])
    axis.plot(k, 400 * (k / 2.0) ** -0.5, color="0.7", lw=0.8, label="$k^{-1/2}$")
    axis.set(xscale="log", yscale="log", xlabel="k", ylabel="norm [µm]", title="Fig. 5")
    axis.legend(fontsize=8, loc="lower left", framealpha=0.6)


def draw_jumps(axis: Any, rows: Sequence[Row], law: str, title: str) -> None:
    """E_r against k for one h, of displacements and of coordinates: the law, and nothing moved."""
    for k_i, colour in COLOURS.items():
        mine = [row for row in rows if row["jump"][0] == k_i and row["jump"][2] == SHOWN_H]
        k = [row["jump"][1] for row in mine]
        for key in ("loading", "coordinates"):
            label = f"$k_i$ = {k_i}" if key == "loading" else None
            axis.plot(k, [row[key][law] for row in mine], "o-", ms=4, color=colour, label=label)
            axis.plot(k, [row[key][NOTHING] for row in mine], ":", color=colour)
    axis.set(xscale="log", yscale="log", xlabel="k", ylabel="$E_r$", ylim=(4e-4, 1))
    axis.set_xticks(WINDOWS, [str(k) for k in WINDOWS])
    axis.minorticks_off()
    axis.set_title(f"{title}, h = {SHOWN_H} (dotted: nothing moved)", fontsize=10)
    axis.text(0.03, 0.9, "of displacements since cycle 0", transform=axis.transAxes, fontsize=8)
    axis.text(0.03, 0.42, "of coordinates", transform=axis.transAxes, fontsize=8)
    axis.legend(fontsize=8, loc="lower left")


def draw_overlaps(axis: Any, rows: Sequence[Row]) -> None:
    """Fig. 9: distribution of overlaps."""
    for row in rows:
        words, colour, line = WAYS[row["way"]]
        overlaps = np.array(row["overlaps"])
        axis.plot(overlaps, SHARES, line, marker=".", color=colour, label=words)
    axis.set(
        xscale="log", xlabel="overlap [m]", ylabel="share of the contacts below", xlim=(1e-9, 1e-3)
    )
    axis.set_title("Fig. 9: overlaps, $k_i$ = k = h = 20, linear law", fontsize=10)
    axis.legend(fontsize=8)
