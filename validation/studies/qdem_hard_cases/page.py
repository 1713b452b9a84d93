"""The page and its figure: what locking leaves of a tip."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from validation.bench.qdem.checks import describe_checks, describe_origin, find_check
from validation.bench.qdem.hard import RATIOS
from validation.case import Check
from validation.figure import draw_figure
from validation.studies.qdem_hard_cases.bars import check_bars
from validation.studies.qdem_hard_cases.run import LOCKING
from validation.study import Row, format_table

PATTERNS = ("kuhn", "five")
POINTS = {
    "**Sliver**, altitude .004 of its longest edge: static field": "sliver 0.01: static field",
    "critical step over the judge's": "sliver 0.01: critical step over the judge",
    "critical step over that of the fastest element alone": "sliver 0.01: critical step over that",
    "motion over two periods, to the exact one": "sliver 0.01: motion",
    "**0.99 of the critical step**, energy over the first": "irregular cube, 0.99 of *: greatest",
    "1.00 of it: energy over the first": "irregular cube, 1 of the critical step",
}


def list_tips(checks: Sequence[Check], ratio: float, pattern: str) -> list[float]:
    """Tips over those of quadratic tetrahedra, mesh by mesh."""
    return [
        find_check(checks, f"nu {ratio:g}, {pattern}, {a} x {b} x {c}: tip over").value
        for a, b, c in LOCKING
    ]


def describe(rows: Sequence[Row]) -> dict[str, str]:
    """The text for each mark of the page."""
    checks = check_bars(rows)
    lines = [
        [f"{ratio:g}", pattern, *(f"{share:.3f}" for share in list_tips(checks, ratio, pattern))]
        for ratio in RATIOS
        for pattern in PATTERNS
    ]
    cells = [f"{a} x {b} x {c}" for a, b, c in LOCKING]
    return {
        "points": describe_checks(checks, POINTS),
        "locking": format_table(["nu", "cells", *cells], lines),
        "made": describe_origin(rows),
    }


def draw(rows: Sequence[Row], picture: Path) -> None:
    """The tip over that of quadratic tetrahedra, by cells along the beam."""
    checks = check_bars(rows)

    def draw_panel(figure: Any) -> None:
        axes = figure.subplots()
        for ratio, colour in zip(RATIOS, ("#0b5394", "#cc7a00", "#cc0000"), strict=True):
            for pattern, style in zip(PATTERNS, ("o-", "s--"), strict=True):
                share = list_tips(checks, ratio, pattern)
                along = [cells[0] for cells in LOCKING]
                axes.plot(along, share, style, color=colour, label=f"nu {ratio:g}, {pattern}")
        axes.set(xlabel="cells along the beam", ylabel="tip over that of quadratic tetrahedra")
        axes.legend(fontsize=7)

    draw_figure((5.5, 3.6), draw_panel, picture)
