"""The page and its figure: error of the tip by mesh and by cost."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from validation.bench.qdem.checks import describe_checks, describe_origin, find_check
from validation.figure import draw_figure
from validation.studies.qdem_validation.bars import check_bars
from validation.study import Row, format_table

BIG, MIDDLE = "488,400 elements", "46,080 elements"
POINTS = {
    "**Statics**: tip to scikit-fem, same mesh, 488,400 elements": f"{BIG}, relaxed: tip, QDEM",
    "von Mises stress, element by element, mean": f"{BIG}, relaxed: von Mises, mean",
    "the same, greatest": f"{BIG}, relaxed: von Mises, greatest",
    "tip beside the paper's 91.94 um": f"{BIG}: tip, the paper's",
    "tip by motion in time, 46,080 elements": f"{MIDDLE}, settled: tip, QDEM",
    "order of convergence, six tetrahedra a cell": "six tetrahedra a cell: order",
    "order of convergence, five": "five tetrahedra a cell: order",
    "**Vibration**: first frequency, 488,400 elements": f"{BIG}: first frequency to same mesh",
    "first frequency beside the paper's": f"{BIG}: first frequency, the paper's",
    "five modes from one motion, worst": f"{MIDDLE}: mode",
    "decay of an elastic motion, over its frequency": f"{MIDDLE}: decay of an elastic",
    "**Motion** to the sum over all modes: order in the step": "motion, QDEM: order",
    "error at 0.8 of the critical step": "motion, QDEM small strain at 0.8",
    "**Waves**: speed in a bar, 80 cells a wave": "bar wave, 80",
    "dilatational wave": "dilatational wave, 80",
    "order of the dispersion in a bar": "bar wave: order",
}
STYLE = {
    "QDEM, settled": ("o", "#0b5394"),
    "QDEM, relaxed": ("^", "#3d9be9"),
    "scikit-fem, linear": ("s", "#cc7a00"),
    "scikit-fem, quadratic": ("*", "#cc0000"),
}


def describe(rows: Sequence[Row]) -> dict[str, str]:
    """The text for each mark of the page."""
    checks = check_bars(rows)
    modes = next(row["modes"] for row in rows if "modes" in row)

    def show(start: str, form: str) -> str:
        return format(find_check(checks, start).value, form)

    return {
        "points": describe_checks(checks, POINTS),
        "modes": format_table(
            ["mode", "scikit-fem [Hz]", "QDEM [Hz]", "beam theory [Hz]"],
            [[name, *(f"{one:.2f}" for one in found)] for name, *found in modes],
        ),
        "excess": show(f"{BIG}: excess stiffness", ".2f"),
        "six": show("six tetrahedra a cell: excess", ".1f"),
        "five": show("five tetrahedra a cell: excess", ".1f"),
        "made": describe_origin(rows),
    }


def draw(rows: Sequence[Row], picture: Path) -> None:
    """Error of the static tip to the limit of quadratic elements, by mesh and by cost."""
    tips = [tip for row in rows for tip in row.get("tips", [])]
    quadratic = sorted(tip[2:] for tip in tips if tip[0] == "scikit-fem, quadratic")
    first, second, third = (tip for _, tip, _ in quadratic[-3:])
    limit = third - (third - second) ** 2 / (third - 2 * second + first)  # Aitken's

    def draw_panels(figure: Any) -> None:
        by_mesh, by_cost = figure.subplots(1, 2)
        for method, (marker, colour) in STYLE.items():
            for pattern, inside in (("six", colour), ("five", "white")):
                some = np.array(
                    sorted(tip[2:] for tip in tips if tip[:2] == [method, pattern])[
                        : -1 if method == "scikit-fem, quadratic" else None
                    ]
                ).reshape(-1, 3)  # the finest quadratic mesh is what the limit is made of
                error = np.abs(some[:, 1] / limit - 1)
                words = {"color": colour, "markerfacecolor": inside}
                label = f"{method}, {pattern} a cell" if len(some) else None
                by_mesh.plot(some[:, 0] ** (-1 / 3), error, marker, label=label, **words)
                by_cost.plot(some[:, 2], error, f"{marker}-", **words)
        by_mesh.set(xlabel="(number of elements)$^{-1/3}$", ylabel="error of the static tip")
        by_cost.set(xlabel="processor time of one thread, set-up included [s]")
        for axes in (by_mesh, by_cost):
            axes.set(xscale="log", yscale="log")
            axes.grid(True, which="both", alpha=0.25)
        by_mesh.legend(fontsize=7)

    draw_figure((11, 4.6), draw_panels, picture)
