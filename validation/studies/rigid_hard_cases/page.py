"""The page and the figure of the hard cases."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from statistics import median

from validation.studies.rigid_hard_cases.bars import Row, list_rows
from validation.study import describe_commits, format_table

LOOKS = {
    "time-stepping": ("o", "#0072B2"), "acceleration": ("s", "#56B4E9"),
    "MuJoCo": ("^", "#D55E00"),
}  # fmt: skip
"""Mark and colour of each engine; colours of Okabe and Ito, which the colour-blind tell apart."""
TITLES = {
    "incline": "block within 1e-9 of the friction of 20°, in the plane and in space",
    "creep": "block at rest on 20°, μ = 1",
    "cards": "card houses within 1e-3 of their limit, 1 to 3 storeys",
    "wedge": "wedge within 1e-6 of its friction",
    "piles": "towers and mass ratios to 1e10, needles, boxes without gaps",
    "arch": "arches of 11 and 31 stones within 1e-3 of their least thickness",
    "rod": "Painlevé's rod within 1e-6 of its limit",
    "motion": "bounces, kicks, falls: energy and overlap",
}
"""What the scenes of a family are."""
LEAST, BAR = 1e-17, 1e-9
"""Errors below it are drawn on it; the bar of most scenes [m]."""


def describe(rows: Sequence[Row]) -> dict[str, str]:
    """The text for each mark of the page."""
    lines = list_rows(rows)
    ours = [line for line in lines if not line["peer"]]
    return {
        "MET": f"{sum(line['ok'] for line in ours)} of {len(ours)} rows of `rigid_lcp` meet their "
        "bars.",
        "ENGINES": _tabulate_engines(lines),
        "CASES": _tabulate_families(rows),
        "COMMITS": describe_commits(row["origin"]["commit"] for row in rows),
    }


def _name(line: Row) -> str:
    return str(line["method"]).partition(" ")[0]


def _tabulate_engines(lines: Sequence[Row]) -> str:
    """Each engine that ran: how many bars it met, and what a step cost it."""
    table = []
    for name in LOOKS:
        own = [line for line in lines if _name(line) == name and line["steps"]]
        step = [1e3 * line["cpu_s"] / line["steps"] for line in own
                if line["steps"] > 1 and line["cpu_s"]]  # fmt: skip
        table.append([name, str(len(own)), str(sum(line["ok"] for line in own)),
                      f"{median(step):.2g}, {max(step):.2g}"])  # fmt: skip
    head = ("engine", "rows", "bars met", "CPU ms a step, median and greatest")
    return format_table(head, table)


def _tabulate_families(rows: Sequence[Row]) -> str:
    """A line a family, a column an engine: bars met of the rows that ran."""
    table = []
    for family in rows:
        ours = [line for line in family["rows"] if not line["peer"]]
        margin = max(line["value"] / float(line["bar"].removeprefix("<="))
                     for line in ours if line["bar"].startswith("<="))  # fmt: skip
        cells = [TITLES[family["part"]], str(len({line["case"] for line in ours}))]
        for name in LOOKS:
            own = [line["ok"] for line in family["rows"] if _name(line) == name and line["steps"]]
            cells.append(f"{sum(own)} of {len(own)}" if own else "")
        table.append([*cells, f"{margin:.2g}"])
    return format_table(("family", "cases", *LOOKS, "margin"), table)


def draw(rows: Sequence[Row], picture: Path) -> None:
    """Error against cost a step: scenes that rest or move by a known way."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 4.4), layout="constrained")
    axes = figure.add_subplot(
        xscale="log", yscale="log", xlabel="CPU time a step [ms], one thread",
        ylabel="distance from the exact answer [m]",
    )  # fmt: skip
    for name, (mark, colour) in LOOKS.items():
        shown = [
            (1e3 * line["cpu_s"] / line["steps"], max(line["value"], LEAST))
            for line in list_rows(rows)
            if _name(line) == name and line["unit"] == "m" and line["bar"].startswith("<=")
            and line["steps"] and line["value"] is not None and line["cpu_s"]
        ]  # fmt: skip
        if shown:
            cost, error = zip(*shown, strict=True)
            ours = name in ("time-stepping", "acceleration")
            axes.scatter(cost, error, s=26, marker=mark, edgecolors=colour, label=name,
                         facecolors=colour if ours else "none")  # fmt: skip
    axes.axhline(BAR, color="0.4", linewidth=0.8, label=f"bar of most scenes, {BAR:g} m")
    axes.grid(alpha=0.3)
    axes.legend(fontsize="small")
    figure.savefig(picture, dpi=120)
