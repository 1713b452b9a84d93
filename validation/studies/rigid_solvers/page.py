"""The page and the figure of the race."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from validation.bench.rigid.examination import BEYOND, FAMILIES, SAME
from validation.studies.rigid_solvers import reading
from validation.studies.rigid_solvers.bars import ENDLESS, check_bars
from validation.studies.rigid_solvers.reading import Row, find_cost
from validation.studies.rigid_solvers.run import (
    BUDGET_S,
    CLARABEL,
    HYBRID,
    LARGE,
    OSQP,
    OURS,
    SEEDS,
    SMALL_S,
    YIELD_S,
)
from validation.study import describe_commits, format_table

STYLE = {
    OURS: ("o", "#0b5394"), HYBRID: ("D", "#cc0000"), CLARABEL: ("s", "#cc7a00"),
    "Siconos": ("^", "#6aa84f"), OSQP: ("p", "#e06666"),
}  # fmt: skip
LEVELS = 10.0 ** np.arange(-2, -16, -1)
"""Residuals at which costs are compared in the figure."""
SLOW_S = 1.0


def describe(rows: Sequence[Row]) -> dict[str, str]:
    """The text for each mark of the page."""
    return {
        "SUMMARY": _summarise(rows),
        "BARS": _describe_bars(rows),
        "FAMILIES": _tabulate_families(reading.select(rows)),
        "SICONOS": _describe_siconos(reading.list_packings(rows, 500, 5000)),
        "YIELD": _tabulate_yield(reading.select(rows, reading.YIELDING)),
        "EXAMINED": _tabulate_examined(rows),
        "UNSOLVED": _list_unsolved(rows),
        "BUDGETS": ", ".join(f"{seconds:g} s ({name})" for name, seconds in BUDGET_S.items())
        + f"; near yield {YIELD_S:g} s, Siconos below {LARGE} contacts {SMALL_S:g} s",
        "COMMITS": describe_commits(row["origin"]["commit"] for row in rows),
    }


def _format(cost: float) -> str:
    if not np.isfinite(cost):
        return "-"
    return f"{cost:.1g} s" if cost < 0.01 else f"{cost:.2g} s"


def _summarise(rows: Sequence[Row]) -> str:
    races = [row for row in reading.select(rows) if row["family"] != reading.YIELDING]
    costs = [cost for row in races if np.isfinite(cost := find_cost(row, OURS))]
    ratios = reading.list_ratios(races)
    slower = [name for name, value in ratios.items() if value > 1]
    contacts = [row["contacts"] for row in races]
    found = reading.join_columns(rows, seed=SEEDS[0])
    words = f" ({', '.join(slower)})" if slower else ""
    return (
        f"`solve_friction` with its default settings solves {len(costs)} of {len(races)} problems "
        f"of {min(contacts):,} to {max(contacts):,} contacts to round-off, in "
        f"{_format(float(np.median(costs)))} (median; {_format(max(costs))} at most). Of the "
        f"{len(ratios)} that {HYBRID} solves too it is slower on {len(slower)}{words}; the median "
        f"ratio of costs is {np.median(list(ratios.values())):.2g}. **Near yield it loses** (see "
        f"below). Of {len(found['ok'])} unseen problems of seed {SEEDS[0]} it solves "
        f"{sum(found['ok'])}."
    )


def _describe_bars(rows: Sequence[Row]) -> str:
    barred = [check for check in check_bars(rows) if check.barred]
    missed = [check for check in barred if not check.holds]
    words = f"Of {len(barred)} bars {len(barred) - len(missed)} are met."
    value = {check.name: f"{check.value:.3g}" for check in missed}
    value |= {check.name: "ours does not reach it" for check in missed if check.value >= ENDLESS}
    lines = [f"- {one.name}: {value[one.name]}, bar {one.asked}; {one.why}" for one in missed]
    return "\n".join([words + " Missed:" * bool(missed), *([""] if missed else []), *lines])


def _tabulate_families(rows: Sequence[Row]) -> str:
    lines = []
    for family in dict.fromkeys(row["family"] for row in rows):
        mine = [row for row in rows if row["family"] == family]
        ours = [cost for row in mine if np.isfinite(cost := find_cost(row, OURS))]
        cells = [family, str(len(mine)), f"{min(row['contacts'] for row in mine):,} to "
                 f"{max(row['contacts'] for row in mine):,}", str(len(ours)),
                 _format(float(np.median(ours))), _format(max(ours))]  # fmt: skip
        for rival in (HYBRID, "Siconos"):
            given = [row for row in mine if rival in row["runs"]]
            reached = sum(np.isfinite(find_cost(row, rival)) for row in given)
            cells.append(f"{reached} of {len(given)}" if given else "")
        ratios = list(reading.list_ratios(mine).values())
        beside = f"{np.median(ratios):.2g}, {sum(np.array(ratios) > 1)}" if ratios else ""
        lines.append([*cells, beside])
    head = ("family", "problems", "contacts", "ours reached", "median", "greatest", HYBRID,
            "Siconos", "ratio")  # fmt: skip
    return format_table(head, lines)


def _describe_siconos(rows: Sequence[Row]) -> str:
    """The best of Siconos's solvers on the packings, at equal residual."""
    given = [row for row in rows if "Siconos" in row["runs"]]
    words = []
    for level in (1e-4, 1e-6, 1e-12):
        pairs = [[find_cost(row, solver, level) for solver in (OURS, "Siconos")] for row in given]
        ratios = [theirs / ours for ours, theirs in pairs if np.isfinite(ours + theirs)]
        words.append(
            f"{min(ratios):.0f} to {max(ratios):.0f} times ours at {level:.0e} (reached on "
            f"{len(ratios)} of {len(given)})"
        )
    contacts = [row["contacts"] for row in given]
    return (
        f"On the {len(given)} packings of {min(contacts):,} to {max(contacts):,} contacts the "
        f"cost of Siconos's best solver is {', '.join(words)}."
    )


def _tabulate_yield(rows: Sequence[Row]) -> str:
    lines = []
    for row in rows:
        cells = []
        for solver in (OURS, HYBRID):
            error = reading.find_least_error(row, solver)
            reached = find_cost(row, solver)
            last = row["runs"][solver][-1]
            if np.isfinite(reached):
                cells.append(f"{_format(reached)} to {error:.0e}")
            elif last[1] is None:
                cells.append("out of time")
            else:
                cells.append(f"not reached: {error:.0e} after {_format(last[1])}")
        lines.append([row["part"].rpartition("mu")[2], f"{row['contacts']:,}", *cells])
    return format_table(("friction", "contacts", "`solve_friction`", HYBRID), lines)


def _tabulate_examined(rows: Sequence[Row]) -> str:
    lines = []
    for belongs in (SAME, BEYOND):
        for family in (each for each in FAMILIES if each.belongs == belongs):
            found = reading.join_columns(rows, seed=SEEDS[0], family=family.name)
            if not all(found.get("ok", [])):
                lines.append(_format_examined(family.name, found))
        all_of = reading.join_columns(rows, seed=SEEDS[0], belongs=belongs)
        lines.append(_format_examined(f"**{belongs}, all**", all_of))
    for seed in SEEDS[1:]:
        title = f"beds kicked, tilted, large packings of seed {seed}"
        lines.append(_format_examined(title, reading.join_columns(rows, seed=seed)))
    head = ("family", "problems", "solved", "over 1 s", "median", "greatest",
            f"slower than {HYBRID}")  # fmt: skip
    return format_table(head, lines)


def _format_examined(title: str, found: dict[str, list[Any]]) -> list[str]:
    both = zip(found["cpu_s"], found["ok"], found["rival_s"], found["rival_ok"], strict=True)
    pairs = [(max(mine, reading.TIE_S), max(theirs, reading.TIE_S))
             for mine, ok, theirs, theirs_ok in both if ok and theirs_ok]  # fmt: skip
    costs = [cost for cost, ok in zip(found["cpu_s"], found["ok"], strict=True) if ok]
    slower = sum(ours > theirs for ours, theirs in pairs)
    return [
        title, str(len(found["ok"])), str(len(costs)), str(sum(c > SLOW_S for c in costs) or ""),
        _format(float(np.median(costs))), _format(max(costs)),
        f"{slower} of {len(pairs)}" if pairs else "",
    ]  # fmt: skip


def _list_unsolved(rows: Sequence[Row]) -> str:
    """What was not solved, where a solution is known to exist; the rest is counted."""
    sure = {family.name for family in FAMILIES if family.soluble}
    lines, others, proved = [], 0, 0
    for row in reading.list_examinations(rows):
        found = reading.join_columns([row])
        lost = [k for k, ok in enumerate(found["ok"]) if not ok]
        if row["family"] not in sure:
            others += len(lost)
            proved += sum("no solution" in found["status"][k] or "energy" in found["status"][k]
                          for k in lost)  # fmt: skip
        elif lost:
            left = (f"{row['posed']['index'][k]} ({_describe_left(found, k)})" for k in lost)
            lines.append(f"- {row['family']} of seed {row['seed']}: {', '.join(left)}")
    words = (
        f"{others} problems that may have no solution are not solved; for {proved} of these it is "
        "proved that there is none, or that W gives energy. Not solved although a solution exists "
        "(contacts, residual, cost):"
    )
    return "\n".join([words, "", *lines])


def _describe_left(found: dict[str, list[Any]], k: int) -> str:
    if found["residual"][k] is None:
        return f"{found['contacts'][k]:,}, {found['status'][k]}"
    return f"{found['contacts'][k]:,}, {found['residual'][k]:.0e}, {_format(found['cpu_s'][k])}"


# --- the figure -------------------------------------------------------------------------------


def draw(rows: Sequence[Row], picture: Path) -> None:
    """Work and precision on packings, performance profile, and costs near yield."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(14, 4.6), layout="constrained")
    left, middle, right = figure.subplots(1, 3)
    _draw_precision(left, reading.list_packings(rows, 0, 10**9))
    _draw_profile(middle, [r for r in reading.select(rows) if r["family"] != reading.YIELDING])
    _draw_yield(right, reading.select(rows, reading.YIELDING))
    for axes in (left, middle, right):
        axes.grid(True, alpha=0.25)
        axes.legend(fontsize=8)
    figure.savefig(picture, dpi=100)


def _draw_precision(axes: Any, rows: Sequence[Row]) -> None:
    """Median over the packings of the cost of each residual, as long as half of them reach it."""
    for solver, (marker, colour) in STYLE.items():
        mine = [row for row in rows if solver in row["runs"]]
        runs = [run for row in mine for run in row["runs"][solver] if run[2] is not None]
        if not runs:
            continue
        cost, error = np.maximum(np.array([run[1:3] for run in runs], dtype=float), 1e-17).T
        axes.plot(np.maximum(cost, 1e-4), error, marker, color=colour, alpha=0.25, markersize=3)
        median = np.array([np.median([find_cost(row, solver, level) for row in mine])
                           for level in LEVELS])  # fmt: skip
        kept = np.isfinite(median)
        axes.plot(median[kept], LEVELS[kept], marker=marker, color=colour, label=solver)
    axes.set(xscale="log", yscale="log", xlabel="processor time of one thread [s]",
             ylabel="scale-free natural residual", title="settled packings")  # fmt: skip


def _draw_profile(axes: Any, rows: Sequence[Row]) -> None:
    factors = np.logspace(0, 4, 200)
    for solver, (_, colour) in STYLE.items():
        among = [row for row in rows if solver in row["runs"]]
        shares = reading.find_profile(among, solver, tuple(STYLE), factors)
        axes.step(factors, shares, where="post", color=colour, label=solver)
    axes.set(xscale="log", ylim=(0, 1.02), xlabel="cost over the least cost (1 ms at least)",
             ylabel="share of the problems a solver was given", title="to the bar")  # fmt: skip


def _draw_yield(axes: Any, rows: Iterable[Row]) -> None:
    """Hollow: the bar was not reached."""
    for solver in (OURS, HYBRID):
        marker, colour = STYLE[solver]
        for row in rows:
            reached = find_cost(row, solver)
            last = row["runs"][solver][-1][1]
            cost = reached if np.isfinite(reached) else last or YIELD_S
            axes.plot(float(row["part"].rpartition("mu")[2]), cost, marker, color=colour,
                      fillstyle="full" if np.isfinite(reached) else "none")  # fmt: skip
        axes.plot([], [], marker, color=colour, label=solver)
    axes.set(yscale="log", xlabel="friction after settling under 0.5",
             ylabel="processor time [s]", title="near yield (hollow: not solved)")  # fmt: skip
