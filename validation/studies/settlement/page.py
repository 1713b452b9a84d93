"""The page docs/settlement.md and its figure, from the record."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from adapters.bed.state import FloatArray
from adapters.procedure.history import sum_cost
from validation.studies.settlement.bars import check_bars
from validation.studies.settlement.beds import EVERY, KINDS, LAWS, Kind, list_methods
from validation.studies.settlement.reading import (
    find_cost,
    find_errors,
    find_speedup,
    find_step_speedup,
    group_runs,
    nest,
    select_rows,
    summarise_reference,
)
from validation.study import describe_commits, estimate_mean, format_table, summarise_bars

Row = dict[str, Any]
SHOWN = (
    "2 jumps", "5 jumps", "2 jumps, nothing moved", "5 jumps, nothing moved",
    "2 jumps, by history", "5 jumps, by history", "2 jumps, by history, profile",
    "5 jumps, by history, profile", "5 growing jumps, by history, profile",
    "5 growing jumps, by history, profile, step x 2", "tolerance 0.02", "tolerance 0.1",
    "step x 2", "step x 4", "E/10", "100 Hz", "density x 10", "h = 0", "law auto, 100 cycles",
)  # fmt: skip
"""Ways of the table; the figure has all."""
COLOURS = {
    "jumps by the law": "#0072B2", "nothing moved": "#E69F00", "law": "#56B4E9",
    "tolerance": "#0072B2", "softer": "#D55E00", "longer step": "#009E73", "frequency": "#CC79A7",
    "density": "#000000", "h = 0": "#999999", "jumps by history": "#882255",
    "jumps by history, profile": "#CC6677",
}  # fmt: skip
"""One a family (Okabe and Ito, Tol)."""


def list_ways(kind: Kind) -> list[tuple[str, str]]:
    """Names and families of all ways of a bed, the laws last."""
    ways = [(method.name, method.family) for method in list_methods(kind)]
    return [*ways, *((f"law {law}, {cycles} cycles", "law") for law, cycles in LAWS)]


def format_error(errors: FloatArray) -> str:
    """Mean and half of Student's interval over packings [%], bold where it excludes zero."""
    mean, half = estimate_mean(errors)
    text = f"{100 * mean:+.0f} ± {100 * half:.0f} %" if half == half else f"{100 * mean:+.0f} %"
    return f"**{text}**" if abs(mean) > half else text


def tabulate_reference(rows: Sequence[Row]) -> str:
    """What the full runs of the beds settle, what a run of them strays by, and their cost."""
    lines = []
    for kind in KINDS.values():
        runs, found = select_rows(rows, kind, EVERY), summarise_reference(rows, kind, "settlement")
        lines.append([
            kind.title, str(kind.k_i), str(kind.packings), str(len(runs)),
            f"{1e6 * found.mean:.0f} ± {1e6 * found.half:.0f} µm",
            f"{1e6 * found.between:.0f} µm", f"{1e6 * found.within:.0f} µm",
            f"{find_cost(runs) / 3600:.2f} h",
        ])  # fmt: skip
    head = [
        "bed", "kᵢ", "packings", "full runs", "settlement", "deviation between packings",
        "within one", "CPU time a run",
    ]  # fmt: skip
    return format_table(head, lines)


def tabulate_ways(rows: Sequence[Row]) -> str:
    """A line a way: cost and errors on both beds."""
    figures = ("settlement", "elastic deflection")
    alone = [summarise_reference(rows, kind, figure) for kind in KINDS.values()
             for figure in figures]  # fmt: skip
    chaos = [f"± {100 * found.alone / found.mean:.0f} %" for found in alone]
    lines = [[f"{EVERY}: chaos alone", "1", *chaos[:2], "1", *chaos[2:]]]
    for name in SHOWN:
        cells = []
        for kind in KINDS.values():
            mine = select_rows(rows, kind, name)
            if not mine:
                cells += ["", "", ""]
                continue
            equal = find_step_speedup(rows, kind, name)
            cells += [
                f"{find_speedup(rows, kind, name):.1f} ({equal:.1f})",
                *(format_error(find_errors(rows, kind, name, figure))
                  if "state" in mine[0] or figure == "settlement" else "" for figure in figures),
            ]  # fmt: skip
        lines.append([name, *cells])
    head = ["way to cycle 500"]
    for kind in KINDS.values():
        head += [f"{kind.name}: cheaper by", *figures]
    return format_table(head, lines)


def list_refused(rows: Sequence[Row]) -> str:
    """Which ways did not reach the end in how many of their runs."""
    words = []
    for kind in KINDS.values():
        for method in list_methods(kind):
            mine = [r for r in rows if r["bed"] == kind.name and r["method"] == method.name]
            ended = sum("settlement" not in row for row in mine)
            if ended:
                words.append(f"{method.name} ({kind.name}) {ended} of {len(mine)}")
    return ", ".join(words)


def describe(rows: Sequence[Row]) -> dict[str, str]:
    """The text for each mark of the page."""
    ratios = {}
    for name, kind in KINDS.items():
        full = select_rows(rows, kind, EVERY)
        piston = nest(list(group_runs(full, lambda row: float(row["piston"])).values()))
        mean = summarise_reference(rows, kind, "settlement").mean
        ratios[f"{name.upper()}_RATIO"] = f"{piston.mean / mean:.1f}"
    engines = ", ".join(dict.fromkeys(row["engine"] for row in rows if row.get("engine")))
    machines = "; ".join(dict.fromkeys(row["origin"]["machine"] for row in rows))
    spent = sum(sum_cost(row["cost"]) for row in rows if not row["method"].startswith("law"))
    return ratios | {
        "REFERENCE": tabulate_reference(rows),
        "WAYS": tabulate_ways(rows),
        "REFUSED": list_refused(rows),
        "BARS": summarise_bars(check_bars(rows)),
        "SPENT": f"{spent / 3600:.0f}",
        "ORIGIN": f"{engines}; {machines}; commits "
        f"{describe_commits(row['origin']['commit'] for row in rows)}.",
    }


def draw(rows: Sequence[Row], picture: Path) -> None:
    """Full runs above, errors against cost below: a column a bed."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(2, len(KINDS), figsize=(12, 10), layout="constrained")
    for column, kind in enumerate(KINDS.values()):
        over, below = axes[0, column], axes[1, column]
        for row in select_rows(rows, kind, EVERY):
            table = row["table"]
            colour = f"C{row['seed'] - 1}"
            over.plot(table["cycle"], 1e6 * np.array(table["settlement"]), color=colour, lw=1)
            sunk = table["piston_height"][0] - np.array(table["piston_height"])
            over.plot(table["cycle"], 1e6 * sunk, color=colour, lw=0.7, ls=":")
        over.axvline(kind.k_i, color="0.7", lw=0.8)
        over.set(xscale="log", xlabel="load cycle", title=kind.title)
        over.set_ylabel("settlement [µm]: mean grain; dotted: piston")
        draw_errors(below, rows, kind)
    figure.savefig(picture, dpi=100)
    plt.close(figure)


def draw_errors(axis: Any, rows: Sequence[Row], kind: Kind) -> None:
    """Error of the settlement of every way against its cost; the band is what chaos makes."""
    truth = summarise_reference(rows, kind, "settlement")
    band = 100 * truth.alone / truth.mean
    axis.axhspan(-band, band, color="0.9")
    axis.axhline(0, color="0.5", lw=0.8)
    for number, (name, family) in enumerate(list_ways(kind), 1):
        if not select_rows(rows, kind, name):
            continue
        mean, half = estimate_mean(100 * find_errors(rows, kind, name, "settlement"))
        cost = 1 / find_speedup(rows, kind, name)
        axis.errorbar(
            cost, mean, half, fmt="o", ms=4, lw=0.7, color=COLOURS[family], label=f"{number} {name}"
        )
        axis.annotate(str(number), (cost, mean), fontsize=7, xytext=(3, 3),
                      textcoords="offset points")  # fmt: skip
    axis.set_yscale("symlog", linthresh=50)
    axis.set(xscale="log", xlabel="CPU time over that of every cycle")
    axis.set_xticks([0.05, 0.1, 0.2, 0.5, 1], labels=["0.05", "0.1", "0.2", "0.5", "1"])
    axis.set_xticks([], minor=True)
    axis.set_ylabel("error of the mean grain's settlement since kᵢ [%]")
    axis.legend(fontsize=6, ncols=3, loc="upper center", bbox_to_anchor=(0.5, -0.14))
