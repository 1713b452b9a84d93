"""The page: costs at equal error, the same mesh, the race; the figure: error against cost."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from validation.bench.qdem.checks import describe_checks, describe_origin
from validation.figure import draw_figure
from validation.studies.qdem_cost.bars import check_bars
from validation.studies.qdem_cost.reading import FAMILIES, LEVELS, find_best, list_costs, list_runs
from validation.study import Row, format_table

STYLE = {
    "QDEM float64": ("o", "#0b5394"),
    "QDEM float32": ("^", "#3d9be9"),
    "P1 central difference": ("s", "#6aa84f"),
    "P1 Newmark": ("D", "#cc7a00"),
    "P2 Newmark": ("*", "#cc0000"),
}
POINTS = {
    f"{question}: {words}": f"{question}: {start}"
    for question in LEVELS
    for words, start in (
        ("uncertainty of the reference", "uncertainty"),
        ("error of central differences over QDEM's, less 1", "error of P1 central"),
        ("error in single precision over that in double, less 1", "error of QDEM float32"),
        ("cost over central differences', finest common mesh", "cost of QDEM over central"),
    )
} | {"bending: order of convergence": "bending: order"}
RACE = {
    "speed, float64, two threads": "speed, float64",
    "over the best of MKL's matrices, two threads": "over MKL's best",
    "over scipy's matrix, which has one thread": "over scipy",
    "float32 over float64": "float32 over float64",
    "elastic over viscous": "cost of viscosity",
    "two threads over one": "2 threads over 1",
    "least traffic over STREAM's triad": "traffic over",
}


def describe(rows: Sequence[Row]) -> dict[str, str]:
    """The text for each mark of the page."""
    checks = check_bars(rows)
    race = next(row["race"] for row in rows if "race" in row)
    speeds = sorted(((name, turn["speed"]) for name, turn in race.items()), key=lambda one: -one[1])
    return {
        "bending": list_costs(rows, "bending"),
        "pulse": list_costs(rows, "pulse"),
        "points": describe_checks(checks, POINTS),
        "bars": describe_checks(checks, RACE),
        "race": format_table(["who", "Mel/s"], [[name, f"{speed:.0f}"] for name, speed in speeds]),
        "made": describe_origin(rows),
    }


def draw(rows: Sequence[Row], picture: Path) -> None:
    """Error against cost, a panel a question: every run faint, each method's frontier joined."""

    def draw_panels(figure: Any) -> None:
        for axes, question in zip(figure.subplots(1, 2), LEVELS, strict=True):
            for name in FAMILIES:
                marker, colour = STYLE[name]
                every = list_runs(rows, question, name)
                cost, error = ([run[key] for run in every] for key in ("cost_s", "error"))
                axes.plot(cost, error, marker, color=colour, alpha=0.3, markersize=4)
                best = find_best(every)
                cost, error = ([run[key] for run in best] for key in ("cost_s", "error"))
                axes.plot(cost, error, f"{marker}-", color=colour, label=name)
            axes.set(xscale="log", yscale="log", title=question,
                     xlabel="processor time of one thread [s]", ylabel="error")  # fmt: skip
            axes.grid(True, which="both", alpha=0.25)
        figure.axes[0].legend(fontsize=8)

    draw_figure((11, 4.6), draw_panels, picture)
