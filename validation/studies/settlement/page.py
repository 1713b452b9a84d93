"""The page docs/settlement.md and its figure, from the record as far as it goes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from adapters.bed.state import FloatArray
from adapters.procedure.history import sum_cost
from validation.figure import draw_figure
from validation.studies.settlement.bars import GROWING, MARGINS, check_bars
from validation.studies.settlement.beds import EVERY, KINDS, Kind, list_methods
from validation.studies.settlement.reading import (
    LEVEL,
    find_cost,
    find_errors,
    find_step_speedup,
    select_rows,
)
from validation.study import describe_commits, estimate_mean, format_table, summarise_bars

Row = dict[str, Any]
COLOURS = {
    "growing": "#0072B2", "tolerance": "#56B4E9", "nothing moved": "#E69F00", "law": "#CC6677",
    "longer step": "#009E73", "softer grains": "#D55E00", "faster load": "#CC79A7",
}  # fmt: skip
"""One a family (Okabe and Ito, Tol)."""
DOUBLED = "step x 2"
"""How ways of twice the time step end, which have a mark of their own."""
SHARES = (0.05, 0.1, 0.2, 0.5, 1)
"""Costs marked on the axis."""


def list_ways(kind: Kind) -> list[tuple[str, str]]:
    """Names and families of all ways of a bed, the law last."""
    ways = [(method.name, method.family) for method in list_methods(kind)]
    return [*ways, ("law of as many cycles", "law")]


def format_error(errors: FloatArray) -> str:
    """Mean and half of its interval [%], bold where it excludes zero; of one packing no half."""
    if not len(errors):
        return ""
    mean, half = estimate_mean(errors, LEVEL)
    text = f"{100 * mean:+.0f} ± {100 * half:.0f} %" if half == half else f"{100 * mean:+.0f} %"
    return f"**{text}**" if abs(mean) > half else text


def tabulate_reference(rows: Sequence[Row]) -> str:
    """What the full runs of the beds settle by, how stiff they stand, and their cost."""
    lines = []
    for kind in KINDS.values():
        runs = list(select_rows(rows, kind, EVERY).values())
        if len(runs) < 2:
            continue
        body, mean = (1e6 * np.array([row[name] for row in runs])
                      for name in ("loaded_body", "settlement"))  # fmt: skip
        stiffness = np.nanmean([row["stiffness"] for row in runs])
        lines.append([
            kind.name, kind.title, f"{kind.k_i} to {kind.last:,}",
            f"{len(runs)} of {len(kind.seeds)}", f"{body.mean():.0f} ± {body.std(ddof=1):.0f} µm",
            f"{mean.mean():.0f} ± {mean.std(ddof=1):.0f} µm", f"{1e-6 * stiffness:.2f} kN/mm",
            f"{find_cost(runs) / 60:.2g} min",
        ])  # fmt: skip
    head = ["bed", "what it is", "cycles", "packings", "loaded body", "mean grain", "stiffness",
            "CPU time a run"]  # fmt: skip
    return format_table(head, lines)


def tabulate_ways(rows: Sequence[Row]) -> str:
    """A line for each way of each bed that the record has: cost and errors."""
    lines = []
    for kind in KINDS.values():
        for name, _ in list_ways(kind):
            errors = find_errors(rows, kind, name, "loaded_body")
            if not len(errors):
                continue
            has_bed = "stiffness" in next(iter(select_rows(rows, kind, name).values()))
            others = [
                format_error(find_errors(rows, kind, name, figure)) if has_bed else ""
                for figure in ("stiffness", "settlement")
            ]
            spread = f"{100 * errors.std(ddof=1):.0f} %" if len(errors) > 1 else ""
            lines.append([
                kind.name, name, str(len(errors)), f"{find_step_speedup(rows, kind, name):.1f}",
                format_error(errors), spread, *others,
            ])  # fmt: skip
    head = ["bed", "way", "packings", "cheaper by", "error, loaded body", "scatter a packing",
            "stiffness", "mean grain"]  # fmt: skip
    return format_table(head, lines)


def describe_answer(rows: Sequence[Row]) -> str:
    """What growing jumps say of the loaded body, a line a bed that has two packings or more."""
    lines = []
    for kind in KINDS.values():
        errors = find_errors(rows, kind, GROWING, "loaded_body")
        if len(errors) > 1:
            cheaper = find_step_speedup(rows, kind, GROWING)
            lines.append(
                f"* **{kind.title}**, {len(errors)} of {len(kind.seeds)} packings: growing jumps "
                f"err by {format_error(errors).strip('*')} at {cheaper:.1f} times less cost."
            )
    return "\n".join(lines) or "No bed has two packings yet."


def list_failed(rows: Sequence[Row]) -> str:
    """Which ways did not reach the end in how many of their runs."""
    words = []
    for kind in KINDS.values():
        for method in list_methods(kind):
            mine = [r for r in rows if r["bed"] == kind.name and r["way"] == method.name]
            if ended := sum("loaded_body" not in row for row in mine):
                words.append(f"{method.name} ({kind.name}) {ended} of {len(mine)}")
    return ", ".join(words) or "none"


def describe(rows: Sequence[Row]) -> dict[str, str]:
    """The text for each mark of the page."""
    spent = sum(sum_cost(row["cost"]) for row in rows if not row["way"].startswith("law"))
    engines = ", ".join(dict.fromkeys(row["engine"] for row in rows if row.get("engine")))
    machines = "; ".join(dict.fromkeys(row["origin"]["machine"] for row in rows))
    commits = describe_commits(row["origin"]["commit"] for row in rows)
    return {
        "ANSWER": describe_answer(rows),
        "REFERENCE": tabulate_reference(rows),
        "WAYS": tabulate_ways(rows),
        "FAILED": list_failed(rows),
        "BARS": summarise_bars(check_bars(rows)),
        "LEFT": "; ".join(
            f"{kind.name}, {way}"
            for kind, way, *_ in MARGINS
            if len(find_errors(rows, kind, way, "loaded_body")) < 2
        )
        or "nothing",
        "SPENT": f"{spent / 3600:.1f}",
        "ORIGIN": f"{engines}; {machines}; commits {commits}.",
    }


def draw(rows: Sequence[Row], picture: Path) -> None:
    """Error of the loaded body's settlement against cost, a panel a bed."""
    from matplotlib.ticker import NullLocator

    kinds = [kind for kind in KINDS.values()
             if len(find_errors(rows, kind, GROWING, "loaded_body"))]  # fmt: skip

    def draw_panels(figure: Any) -> None:
        panels = figure.subplots(1, max(len(kinds), 1), squeeze=False, sharey=True)
        for axes, kind in zip(panels[0], kinds, strict=False):
            axes.axhline(0, color="0.5", lw=0.8)
            for name, family in list_ways(kind):
                errors = 100 * find_errors(rows, kind, name, "loaded_body")
                if not len(errors):
                    continue
                mean, half = estimate_mean(errors, LEVEL)
                cost = 1 / find_step_speedup(rows, kind, name)
                mark = "s" if name.endswith(DOUBLED) else "^" if name.endswith("k = 30") else "o"
                axes.errorbar(cost, mean, half if half == half else 0.0, fmt=mark, ms=5, lw=1,
                              capsize=3, color=COLOURS[family], label=name)  # fmt: skip
            axes.set(xscale="log", xlim=(0.03, 1.2), ylim=(-120, 200), title=kind.title,
                     xlabel="cost over that of every cycle")  # fmt: skip
            axes.set_xticks(SHARES, [f"{share:g}" for share in SHARES])
            axes.xaxis.set_minor_locator(NullLocator())
            axes.legend(fontsize=7)
        panels[0, 0].set_ylabel("error of the loaded body's settlement [%]")

    draw_figure((5 * max(len(kinds), 1), 4.5), draw_panels, picture)
