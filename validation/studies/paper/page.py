"""The page docs/paper.md and its figure, from the record."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import Any

from validation.figure import draw_figure
from validation.studies.paper.bars import check_bars, count_nearer, find_max
from validation.studies.paper.run import DENOMINATORS, FIRST, LAWS, LENGTHS, NOTHING, OTHER
from validation.study import format_checks, format_table

Row = dict[str, Any]


def tabulate_largest(jumps: Sequence[Row]) -> str:
    """Largest E_r over all k and h, by way and denominator."""
    lines = []
    for number, words in enumerate(DENOMINATORS):
        for way in (*LAWS, NOTHING):
            cells = [f"{100 * find_max(jumps, way, k_i, number):.3g} %" for k_i in FIRST]
            lines.append([words, way, *cells])
    return format_table(["over", "way", *(f"kᵢ = {k_i}" for k_i in FIRST)], lines)


def describe(rows: Sequence[Row]) -> dict[str, str]:
    """The text for each mark of the page."""
    found = {row["part"]: row for row in rows}
    jumps, overlap = found["jumps"]["jumps"], found["cell"]["overlap"]
    both = [one for one in jumps if OTHER in one["errors"]]
    origin = rows[0]["origin"]
    return {
        "LARGEST": tabulate_largest(jumps),
        "JUMPS": str(len(jumps)),
        "LOG": str(count_nearer(jumps, "log", NOTHING)),
        "LINEAR": str(count_nearer(jumps, "linear", NOTHING)),
        "BESIDE": str(count_nearer(jumps, "log", "linear")),
        "BOTH": str(len(both)),
        "MEMBER": str(count_nearer(both, OTHER, NOTHING)),
        "CELL": ", ".join(f"{name} {1e6 * value:.2g} µm" for name, value in overlap.items()),
        "BARS": format_checks(check_bars(rows)),
        "ORIGIN": f"Commit `{origin['commit'][:10]}`, {origin['machine']}.",
    }


def draw(rows: Sequence[Row], picture: Path) -> None:
    """E_r of coordinates over h, a panel a k_i, a line a window; grey: nothing moved."""
    jumps = next(row for row in rows if row["part"] == "jumps")["jumps"]
    tried = sorted({one["h"] for one in jumps})

    def draw_panels(figure: Any) -> None:
        axes = figure.subplots(2, len(FIRST), sharey=True)
        for (row, law), (column, k_i) in product(enumerate(LAWS), enumerate(FIRST)):
            axis = axes[row, column]
            for number, k in enumerate(LENGTHS):
                of = [j for j in jumps if (j["k_i"], j["k"]) == (k_i, k)]
                line = sorted((j["h"], j["errors"]) for j in of)
                h = [place for place, _ in line]
                axis.plot(h, [100 * e[NOTHING][0] for _, e in line], color="0.75", lw=0.8)
                axis.plot(h, [100 * e[law][0] for _, e in line], "o-", color=f"C{number}", ms=3,
                          lw=1, label=f"k = {k}")  # fmt: skip
            axis.set(xscale="log", yscale="log", title=f"{law}, kᵢ = {k_i}", xlabel="h")
            axis.minorticks_off()
            axis.set_xticks(tried, [str(h) for h in tried])
        for axis in axes[:, 0]:
            axis.set_ylabel("E_r of coordinates [%]")
        axes[0, 0].legend(fontsize=7)

    draw_figure((13, 5), draw_panels, picture)
