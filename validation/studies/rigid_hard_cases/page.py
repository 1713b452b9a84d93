"""The page and the figure of the hard cases."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from statistics import median

from validation.studies.rigid_hard_cases.bars import Row, list_rows
from validation.study import describe_commits, format_table

LOOKS = {
    "time-stepping": ("o", "#0072B2"), "acceleration": ("s", "#56B4E9"),
    "MuJoCo": ("^", "#D55E00"), "ODE": ("v", "#009E73"), "LMGC90": ("D", "#CC79A7"),
}  # fmt: skip
"""Mark and colour of each engine; colours of Okabe and Ito, which the colour-blind tell apart."""
LEAST, BAR = 1e-17, 1e-9
"""Errors below it are drawn on it; the bar of most scenes [m]."""


def describe(rows: Sequence[Row]) -> dict[str, str]:
    """The text for each mark of the page."""
    lines = list_rows(rows)
    ours = [line for line in lines if not line["peer"]]
    return {
        "MET": f"{sum(line['ok'] for line in ours)} of {len(ours)} rows of ours meet their bars.",
        "ENGINES": _engines(lines),
        "CASES": _cases(lines),
        "ABSENT": _absent(lines),
        "COMMITS": describe_commits(row["origin"]["commit"] for row in rows),
    }


def _name(line: Row) -> str:
    return str(line["method"]).partition(" ")[0]


def _value(line: Row) -> str:
    if line["steps"] == 0:
        return ""
    value = "blew up" if line["value"] is None else f"{line['value']:.2g}"
    return value if line["ok"] else f"**{value}**"


def _engines(lines: Sequence[Row]) -> str:
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


def _cases(lines: Sequence[Row]) -> str:
    """A line a case, a column an engine."""
    groups: dict[tuple[str, str], list[Row]] = {}
    for line in lines:
        groups.setdefault((line["case"], line["measure"]), []).append(line)
    table = []
    for (case, measure), own in groups.items():
        values = {_name(line): _value(line) for line in own}
        bar = f"{measure} {own[0]['bar']} {own[0]['unit']}".replace("|", "\\|").rstrip()
        answer = own[0]["answer"].replace("|", "\\|")
        table.append([case, answer, bar, *(values.get(name, "") for name in LOOKS)])
    return format_table(("case", "answer", "bar", *LOOKS), table)


def _absent(lines: Sequence[Row]) -> str:
    reasons = Counter((_name(line), line["why"]) for line in lines
                      if line["peer"] and line["steps"] == 0)  # fmt: skip
    return "\n".join(f"- {name}, {count}: {why}" for (name, why), count in reasons.items())


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
