"""The page and the figure of the unique forces."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from validation.studies.rigid_indeterminacy.run import (
    LIGGGHTS,
    RELAXATION,
    SCENES,
    SLOW,
    SPRINGS,
    Row,
)
from validation.study import describe_commits, format_table

SHOWN = (1e2, 1e4, 1e6, 1e8, 1e10)
LEAST = 1e-16
"""Smaller errors are drawn there."""
MARKS = {SPRINGS: "o", LIGGGHTS: "^", RELAXATION: "s"}
COLOURS, LINES = ("#0072B2", "#D55E00", "#009E73"), ("-", "--", ":")
"""Colours of Okabe and Ito, which the colour-blind tell apart, and a line each."""


def describe(rows: Sequence[Row]) -> dict[str, str]:
    """The text for each mark of the page."""
    scenes = [row for row in rows if row["part"] in SCENES]
    resting = [row for row in scenes if not SCENES[row["part"]].slides]
    return {
        "STIFF": _tabulate_stiff(resting),
        "COSTS": _tabulate_costs(resting),
        "SLIDING": _tabulate_sliding([row for row in scenes if SCENES[row["part"]].slides]),
        "ORDER": _tabulate_order(next(row for row in rows if row["part"] == "order")),
        "COMMITS": describe_commits(row["origin"]["commit"] for row in rows),
    }


def _format(value: float | None) -> str:
    return "-" if value is None else f"{value:.1e}"


def _list_runs(row: Row, method: str) -> list[Row]:
    return [run for run in row["runs"] if run["method"] == method]


def _tabulate_stiff(rows: Sequence[Row]) -> str:
    """Errors by stiffness, and of the direct limit against dense least squares."""
    table = []
    for row in rows:
        ramp = SLOW if SCENES[row["part"]].friction else 0
        for method in (SPRINGS, LIGGGHTS):
            error = {run["stiffness"]: run["error"] for run in _list_runs(row, method)
                     if run["ramp"] == ramp}  # fmt: skip
            if error:
                table.append([
                    row["part"], str(row["contacts"]), str(row["redundant"]),
                    _format(row["dense"]), method, *(_format(error.get(k)) for k in SHOWN),
                ])  # fmt: skip
    head = ("scene", "contacts", "redundant", "dense", "", *(f"k = {k:.0e}" for k in SHOWN))
    return format_table(head, table)


def _tabulate_costs(rows: Sequence[Row]) -> str:
    """Least costs [ms] to an error of 1e-6."""
    table = []
    for row in rows:
        cells = [f"{1e3 * row['limit_cpu_s']:.2g}"]
        for method in (RELAXATION, SPRINGS, LIGGGHTS):
            reached = [run["cpu_s"] for run in _list_runs(row, method) if run["error"] <= 1e-6]
            cells.append(f"{1e3 * min(reached):.2g}" if reached else "-")
        table.append([row["part"], *cells])
    return format_table(("scene", "direct limit", RELAXATION, SPRINGS, LIGGGHTS), table)


def _tabulate_sliding(rows: Sequence[Row]) -> str:
    """Where contacts slide: errors by the steps of loading, and other states."""
    table = []
    for row in rows:
        peer = {run["ramp"]: run["error"] for run in _list_runs(row, LIGGGHTS)}
        for run in _list_runs(row, SPRINGS):
            table.append([
                row["part"], f"{row['sliding']} of {row['contacts']}",
                f"{run['ramp']:,}" if run["ramp"] else "at once", _format(run["error"]),
                _format(peer.get(run["ramp"])), _format(run["residual"]),
                _format(run.get("other_state")), _format(run.get("from_it")),
            ])  # fmt: skip
    head = ("scene", "sliding", "loaded in steps", SPRINGS, LIGGGHTS, "residual of the springs",
            "other state", "springs from it")  # fmt: skip
    return format_table(head, table)


def _tabulate_order(row: Row) -> str:
    """What another order and other numbers do."""
    return format_table(
        ("pile", "contacts", "sliding", "other order"),
        [
            [pile["pile"], str(pile["contacts"]), str(pile["sliding"]),
             _format(pile["order"]) if pile["found"] else "not found"]
            for pile in row["piles"]
        ],
    )  # fmt: skip


def draw(rows: Sequence[Row], picture: Path) -> None:
    """Error of the forces against stiffness, cost and loading time."""
    from matplotlib.figure import Figure

    found = {row["part"]: row for row in rows}
    figure = Figure(figsize=(11.0, 4.2), layout="constrained")
    stiff, cost, slow = figure.subplots(1, 3)
    for k, name in enumerate(("beam on three supports", "pyramid of 15", "pyramid of 55")):
        for method in (SPRINGS, LIGGGHTS, RELAXATION):
            runs = _list_runs(found[name], method)
            if method != RELAXATION:
                _draw_curve(stiff, runs, "stiffness", k, f"{method}, {name}")
            _draw_curve(cost, runs, "cpu_s", k, f"{method}, {name}")
        cost.plot(found[name]["limit_cpu_s"], max(found[name]["dense"], LEAST), "*",
                  color=COLOURS[k], markersize=11, label=f"direct limit, {name}")  # fmt: skip
    for k, name in enumerate(name for name, scene in SCENES.items() if scene.slides):
        for method in (SPRINGS, LIGGGHTS):
            _draw_curve(slow, _list_runs(found[name], method), "ramp", k, f"{method}, {name}")
    stiff.set(xlabel="stiffness, weights a metre", title="stiff limit",
              ylabel="greatest error of a contact force / weight")  # fmt: skip
    cost.set(xlabel="CPU time [s], one thread", title="cost")
    slow.set(xlabel="steps in which gravity grew (100: at once)", title="contacts that slide")
    for axes in (stiff, cost, slow):
        axes.set(xscale="log", yscale="log")
        axes.grid(alpha=0.3)
        axes.legend(fontsize="xx-small")
    figure.savefig(picture, dpi=120)


def _draw_curve(axes: Any, runs: Sequence[Row], across: str, k: int, label: str) -> None:
    if runs:
        x = [max(run[across], 100) if across == "ramp" else run[across] for run in runs]
        y = [max(run["error"], LEAST) for run in runs]
        style = MARKS[runs[0]["method"]] + LINES[k]
        axes.plot(x, y, style, color=COLOURS[k], markersize=4, linewidth=0.8, label=label)
