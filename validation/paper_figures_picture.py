"""A picture of docs/paper-figures.md: figures 3, 5, 8 and 9 of Karrech et al. (2007)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from validation.paper_figures import CELL_DEPTH, SHARES, Row

WAYS = {
    "before": ("before", "0.5", "-"),
    "estimate": ("estimate", "#E69F00", "-"),
    "karrech2007": ("eq. 29, frontier held", "#0072B2", "--"),
    "smallest-move": ("smallest move", "#c8553d", ":"),
}
PAPER = {"color": "black", "marker": "*", "ls": "none", "ms": 10, "label": "the paper"}
"""How values that the paper prints are drawn."""
PAPER_CONTACTS, PAPER_DENSITY, PAPER_ENERGY = 5.0, (0.53, 0.5615), 1e-6
"""Fig. 3: coordination number, relative density read and corrected, kinetic over potential."""
PAPER_OVERLAPS = (CELL_DEPTH, 6e-5)
"""Fig. 9: greatest overlap of the estimate and after the relaxation [m]."""
CELLS = (("before", "estimate"), ("karrech2007", "smallest-move"))
"""Fig. 8a and 8b."""


def draw(rows: Sequence[Row], target: Path) -> None:
    """Six panels: two of Fig. 3, Fig. 5, Figs 8a and 8b, Fig. 9."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(2, 3, figsize=(14, 8), layout="constrained")
    (rain,) = (row for row in rows if row["figure"] == "3")
    draw_rain(axes[0, 0], axes[0, 1], rain)
    draw_accuracy(axes[0, 2], [row for row in rows if row["figure"] == "5"])
    cell = {row["way"]: row for row in rows if row["figure"] == "8"}
    for axis, letter, ways in zip(axes[1], "ab", CELLS, strict=False):
        draw_cell(axis, cell, ways, f"Fig. 8{letter}")
    draw_overlaps(axes[1, 2], [row for row in rows if row["figure"] == "9"])
    figure.savefig(target, dpi=110, metadata={"Software": None})
    pyplot.close(figure)


def draw_rain(left: Any, right: Any, rain: Row) -> None:
    """Fig. 3: contacts and density to the left, weight and energies to the right."""
    left.plot(rain["time"], rain["coordination_number"], color="#0072B2", label="contacts a grain")
    left.set(xlabel="time [s]", ylabel="coordination number", title="Fig. 3: rain of grains")
    left.set_ylim(top=5.6)
    density = left.twinx()
    density.plot(rain["frame_time"], rain["relative_density"], "o-", ms=3, color="#c8553d")
    density.set_ylabel("relative density", color="#c8553d")
    left.plot(rain["time"][-1], PAPER_CONTACTS, **PAPER)
    density.plot([rain["time"][-1]] * 2, PAPER_DENSITY, **PAPER | {"color": "#c8553d"})
    left.legend(fontsize=8, loc="lower right")
    weight = np.array(rain["apparent_weight"]) / rain["figures"]["weight"]
    right.plot(rain["time"], weight, color="0.2", label="force on the floor over weight")
    for name, colour in (("translational", "#0072B2"), ("rotational", "#009E73")):
        ratio = np.abs(rain[name])
        right.plot(rain["time"], ratio, color=colour, label=f"{name} energy over potential")
    right.plot([rain["time"][-1]] * 2, (1.0, PAPER_ENERGY), **PAPER)
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


def draw_cell(axis: Any, cell: Mapping[str, Row], ways: Sequence[str], title: str) -> None:
    """Fig. 8: the cell cut along x = y, where the middle grain and four corners show in full."""
    from matplotlib.patches import Circle

    for way in ways:
        row, (words, colour, line) = cell[way], WAYS[way]
        place = 1e3 * np.array(row["position"])
        cut = np.isclose(place[:, 0], place[:, 1], rtol=0, atol=1e-3)
        for number in np.flatnonzero(cut):
            across, up = place[number, 0] * np.sqrt(2), place[number, 2]
            radius = 1e3 * row["radius"][number]
            axis.add_patch(Circle((across, up), radius, fc="none", ec=colour, ls=line, lw=1.4))
            axis.plot(across, up, ".", color=colour, ms=4)
        axis.plot([], [], line, color=colour, label=f"{words}: {length(row['overlap'])}")
    axis.set(xlabel="along x = y [mm]", ylabel="z [mm]", xlim=(-10, 10), ylim=(-10.2, 7.5))
    axis.set_aspect("equal")
    axis.set_title(f"{title}: nine grains cut along x = y, greatest overlap", fontsize=10)
    axis.legend(fontsize=8, loc="lower center")


def length(metres: float) -> str:
    """A length in a unit that reads well; nothing where it is round-off of the places."""
    if metres < 1e-10:
        return "none"
    return f"{1e3 * metres:.1f} mm" if metres > 1e-4 else f"{1e6 * metres:.2g} µm"


def draw_overlaps(axis: Any, rows: Sequence[Row]) -> None:
    """Fig. 9: distribution of overlaps."""
    for row in rows:
        words, colour, line = WAYS[row["way"]]
        overlaps = np.array(row["overlaps"])
        axis.plot(overlaps, SHARES, line, marker=".", color=colour, label=words)
    axis.plot(PAPER_OVERLAPS, (1, 1), **PAPER | {"label": "the paper: 1.8e-3 -> 6e-5 m"})
    axis.set(
        xscale="log", xlabel="overlap [m]", ylabel="share of the contacts below", xlim=(1e-9, 4e-3)
    )
    axis.set_title("Fig. 9: overlaps, $k_i$ = k = h = 20, linear law", fontsize=10)
    axis.legend(fontsize=8)
