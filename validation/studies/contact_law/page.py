"""The page docs/contact-law.md and its figure, from the record."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from validation.figure import draw_figure
from validation.studies.contact_law.bars import check_bars
from validation.studies.contact_law.settings import TEST_4, TEST_5
from validation.study import format_table

Row = dict[str, Any]
TITLES = {"liggghts": "LIGGGHTS", "lammps": "LAMMPS", "yade": "YADE"}
COLOURS = {"liggghts": "#0072B2", "lammps": "#E69F00", "yade": "#009E73"}
Line = tuple[str, str, str, str, Callable[[Sequence[float]], str]]


def format_most(values: Sequence[float]) -> str:
    """The value farthest from zero, without its sign, in per cent of two digits."""
    return f"{100 * max(map(abs, values)):.2g} %"


def format_span(values: Sequence[float]) -> str:
    """Least to greatest, without sign, in per cent."""
    sizes = [100 * abs(value) for value in values]
    low, high = f"{min(sizes):.1f}", f"{max(sizes):.1f}"
    return f"{low} %" if low == high else f"{low} to {high} %"


def format_least(values: Sequence[float]) -> str:
    """The least of them."""
    return f"{min(values):.2f}"


ACCURACY: tuple[Line, ...] = (
    ("1, 2", "overlap, force", "1 %", r"test [12], .*: greatest (overlap|force)$", format_most),
    ("1, 2", "contact time (its factor 2.87 is rounded)", "1 %", r": contact time$", format_most),
    ("3", "restitution, e = 0.2 to 1", "1 %", r"test 3, [^=]*: restitution$", format_most),
    ("4 to 8", "sliding limit: impulse", "2 %", r"sliding limit, impulse$", format_most),
    (
        "4 to 8", "sliding limit: e_t, spin, rebound angle", "2 %",
        r"sliding limit, (e_t|spin|rebound angle)$", format_most,
    ),
    ("4 to 8", "sticking and between: its own rule", "2 %", r"its own rule$", format_most),
    (
        "4 to 8", "all impulses, a scene's law integrated", "2 %",
        r"under the scene law, integrated$", format_most,
    ),
    ("7, 8", "momentum", "1e-12", r": momentum$", lambda v: f"{max(v):.0e}"),
    ("3", "order in the step, e = 0.2", "0.9", r"e = 0\.2: order", format_least),
    ("3", "order in the step, e = 1", "2.4", r"e = 1\.0: order", format_least),
    ("5", "order in the step, friction", "0.9", r"test 5, .*order .*friction$", format_least),
    ("6", "order in the step, a scene's law", "0.9", r"test 6, .*order .*friction$", format_least),
)  # fmt: skip
"""Test, quantity, bar, pattern of the checks' names, how their values are written."""
UNDER = "sliding limit, impulse, under the"
GAP: tuple[Line, ...] = (
    ("6 to 8", "as a scene has it", "", rf"test [678], .*{UNDER} scene law$", format_span),
    ("6", "nothing pulls", "", rf"{UNDER} unpulled law$", format_span),
    ("6", "no tangential damping", "", rf"{UNDER} undamped law$", format_span),
)


def tabulate(lines: Sequence[Line], rows: Sequence[Row], first: str, bars: bool) -> str:
    """A column for each engine; values without a bar are left out of a table of ``bars``."""
    found = {row["part"]: row["checks"] for row in rows}
    cells = []
    for test, quantity, limit, pattern, tell in lines:
        line = [test, quantity, *[limit] * bars]
        for engine in TITLES:
            values = [
                check["value"]
                for check in found.get(engine, ())
                if re.search(pattern, check["name"])
                and not (bars and check["bar"].startswith("none"))
            ]
            line.append(tell(values) if values else "-")
        cells.append(line)
    return format_table(["test", first, *["bar"] * bars, *TITLES.values()], cells)


def describe(rows: Sequence[Row]) -> dict[str, str]:
    """The text for each mark of the page."""
    barred = [check for check in check_bars(rows) if not check.bar.startswith("none")]
    origin = rows[0]["origin"]
    return {
        "ACCURACY": tabulate(ACCURACY, rows, "quantity", bars=True),
        "GAP": tabulate(GAP, rows, "sliding impulse against μ (1 + e), e = 0.5", bars=False),
        "BARS": f"{sum(check.holds for check in barred)} of {len(barred)} bars are met",
        "ORIGIN": f"{', '.join(row['engine'] for row in rows)}; commit "
        f"`{origin['commit'][:10]}`, {origin['machine']}.",
    }


def draw(rows: Sequence[Row], picture: Path) -> None:
    """Friction impulses of tests 5 and 4 on each engine, and what rigid bodies would have."""

    def draw_panels(figure: Any) -> None:
        axes = figure.subplots(1, 2)
        for axis, setting in zip(axes, (TEST_5, TEST_4), strict=True):
            limit = setting.friction * (1 + setting.restitution)
            slip = np.array([impact.tangential / impact.normal for impact in setting.impacts])
            for row in rows:
                impulse = np.array(row["impulses"][setting.label]) / limit
                axis.plot(slip / limit, impulse, ".-", lw=0.9, ms=5, color=COLOURS[row["part"]],
                          label=TITLES[row["part"]])  # fmt: skip
            rigid = np.minimum(slip / limit / 3.5, 1.0)
            axis.plot(slip / limit, rigid, "k--", lw=0.8, label="rigid bodies")
            axis.set(xlim=(0, 12), xlabel="slip before, over µ (1 + e) Vₙ")
            axis.set_ylabel("friction impulse over µ (1 + e) m* Vₙ")
            axis.set_title(f"{setting.label}, e = {setting.restitution}", fontsize=9)
        axes[0].legend(frameon=False, fontsize=8)

    draw_figure((10, 3.6), draw_panels, picture)
