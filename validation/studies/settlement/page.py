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
    FIGURES,
    by_packing,
    cheaper_at_equal_step,
    cheaper_by,
    errors_of,
    mean_cost,
    nest,
    profile_error,
    select_rows,
    summarise_reference,
)
from validation.study import describe_commits, format_checks, format_table, mean_interval

Row = dict[str, Any]
MARKS = {"confined": (60, 100, 200, 500), "coarse": (200, 500, 2000, 10_000)}
"""Cycles told of the full runs."""
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


def tell_error(errors: FloatArray) -> str:
    """Mean and half of Student's interval over packings [%], bold where it leaves out zero."""
    mean, half = mean_interval(errors)
    text = f"{100 * mean:+.0f} ± {100 * half:.0f} %" if half == half else f"{100 * mean:+.0f} %"
    return f"**{text}**" if abs(mean) > half else text


def read_table(row: Row, name: str, cycle: float) -> float:
    """A column of a full run's thinned table, between its rows along ln N."""
    table = row["table"]
    return float(np.interp(np.log(cycle), np.log(table["cycle"]), table[name]))


def tabulate_reference(rows: Sequence[Row], kind: Kind) -> str:
    """What the full runs of a bed settle, grains and piston."""
    runs, lines = select_rows(rows, kind, EVERY), []
    for words, name, sign in (
        ("settlement of the mean grain since kᵢ, µm", "settlement", 1.0),
        ("way of the piston since kᵢ, µm", "piston_height", -1.0),
    ):
        cells = []
        for mark in MARKS[kind.name]:

            def gain(row: Row, mark: int = mark, name: str = name, sign: float = sign) -> float:
                change = read_table(row, name, mark) - read_table(row, name, kind.k_i)
                return 1e6 * sign * change

            found = nest(list(by_packing(runs, gain).values()))
            cells.append(
                f"{found.mean:.0f} ± {found.half:.0f} ({found.half_given:.0f}; "
                f"{found.between:.0f}, {found.within:.0f})"
            )
        lines.append([words, *cells])
    head = [f"{kind.title}, after cycle", *(f"{mark:,}" for mark in MARKS[kind.name])]
    return format_table(head, lines)


def tabulate_ways(rows: Sequence[Row], kind: Kind) -> str:
    """A line a way: cost and errors."""
    truth = {figure: summarise_reference(rows, kind, figure) for figure in FIGURES}
    full = select_rows(rows, kind, EVERY)
    chaos = [f"± {100 * found.alone / found.mean:.0f} %" for found in truth.values()]
    head = [
        "way to the last cycle", "runs", "cycles computed", "cheaper by", "at equal cost a step",
        *FIGURES, "density profile",
    ]  # fmt: skip
    lines = [
        [f"{EVERY}: chaos alone", str(len(full)), str(full[0]["computed"]), "1", "1", *chaos, ""]
    ]
    for name, _ in list_ways(kind):
        mine = select_rows(rows, kind, name)
        if not mine:
            continue
        whole = "state" in mine[0]
        lines.append([
            name, str(len(mine)), f"{np.mean([row['computed'] for row in mine]):.0f}",
            f"{cheaper_by(rows, kind, name):.1f}",
            f"{cheaper_at_equal_step(rows, kind, name):.1f}",
            *(tell_error(errors_of(rows, kind, name, figure))
              if whole or figure == "settlement" else "-" for figure in FIGURES),
            f"{100 * profile_error(rows, kind, name):.1f} %" if whole else "-",
        ])  # fmt: skip
    return format_table(head, lines)


def tell_refused(rows: Sequence[Row], kind: Kind) -> str:
    """Which ways did not come to the end, and why."""
    lines = []
    for method in list_methods(kind):
        mine = [row for row in rows if row["bed"] == kind.name and row["method"] == method.name]
        ended = [row for row in mine if "settlement" not in row]
        if ended:
            why = shorten(ended[0]["refused"])
            lines.append(f"- *{method.name}*: {len(ended)} of {len(mine)} did not end ({why}).")
    return "\n".join(lines)


def shorten(why: str) -> str:
    """A refusal without its place and its remedy."""
    return why.rpartition("sentinel line: ")[2].removeprefix("ERROR: ").partition(". Please")[0]


def describe(rows: Sequence[Row]) -> dict[str, str]:
    """The text for each mark of the page."""
    parts: dict[str, str] = {}
    for name, kind in KINDS.items():
        truth = summarise_reference(rows, kind, "settlement")
        full = select_rows(rows, kind, EVERY)
        piston = nest(list(by_packing(full, lambda row: float(row["piston"])).values()))
        parts |= {
            f"{name.upper()}_REFERENCE": tabulate_reference(rows, kind),
            f"{name.upper()}_WAYS": tabulate_ways(rows, kind),
            f"{name.upper()}_REFUSED": tell_refused(rows, kind),
            f"{name.upper()}_MEAN": f"{1e6 * truth.mean:.0f}",
            f"{name.upper()}_RATIO": f"{piston.mean / truth.mean:.1f}",
            f"{name.upper()}_HOURS": f"{mean_cost(full) / 3600:.2f}",
        }
    engines = ", ".join(dict.fromkeys(row["engine"] for row in rows if row.get("engine")))
    machines = "; ".join(dict.fromkeys(row["origin"]["machine"] for row in rows))
    spent = sum(sum_cost(row["cost"]) for row in rows if not row["method"].startswith("law"))
    return parts | {
        "BARS": format_checks(check_bars(rows)),
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
    figure.savefig(picture, dpi=75)
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
        mean, half = mean_interval(100 * errors_of(rows, kind, name, "settlement"))
        cost = 1 / cheaper_by(rows, kind, name)
        axis.errorbar(
            cost, mean, half, fmt="o", ms=4, lw=0.7, color=COLOURS[family], label=f"{number} {name}"
        )
        axis.annotate(str(number), (cost, mean), fontsize=7, xytext=(3, 3),
                      textcoords="offset points")  # fmt: skip
    axis.set_yscale("symlog", linthresh=50)
    axis.set(xscale="log", xlabel="CPU time over that of every cycle")
    axis.set_ylabel("error of the mean grain's settlement since kᵢ [%]")
    axis.legend(fontsize=6, ncols=3, loc="upper center", bbox_to_anchor=(0.5, -0.14))
