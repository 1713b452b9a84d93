"""The tables and the picture of Chung and Ooi's tests in docs/contact-law.md, from their records.

python -m validation.chung_ooi_page      after: trackbed validate engines --json RECORD
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from validation.chung_ooi import TEST_4, TEST_5, Setting
from validation.chung_ooi_checks import RECORDED
from validation.chung_ooi_curves import partial_slip_of, published_curves
from validation.chung_ooi_published import ELEMENTS_REBOUND, EXPERIMENT_TANGENTIAL_RESTITUTION

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

RESULTS = Path(__file__).parent / "results"
PAGE = Path(__file__).parents[1] / "docs" / "contact-law.md"
PICTURE = PAGE.with_name("contact-law-impacts.png")
ENGINES = {"liggghts": "LIGGGHTS", "lammps": "LAMMPS", "yade": "YADE"}
COLOURS = {"liggghts": "#0b5fa5", "lammps": "#e07b00", "yade": "#2a9d6f"}

Values = Sequence[float]
Row = tuple[str, str, str, str, Callable[[Values], str]]


def percent(values: Values) -> str:
    """The value farthest from zero, without its sign, in per cent of two digits."""
    return f"{100 * max(map(abs, values)):.2g} %"


def span(values: Values) -> str:
    """Least to greatest, without sign, in per cent."""
    sizes = [100 * abs(value) for value in values]
    low, high = f"{min(sizes):.1f}", f"{max(sizes):.1f}"
    return f"{low} %" if low == high else f"{low} to {high} %"


def number(values: Values) -> str:
    """The least of them."""
    return f"{min(values):.2f}"


ACCURACY: tuple[Row, ...] = (
    ("1, 2", "overlap, force", "1 %", r"test [12], .*: greatest (overlap|force)$", percent),
    ("1, 2", "contact time (its factor 2.87 is rounded)", "1 %", r": contact time$", percent),
    ("3", "restitution, e = 0.2 to 1", "1 %", r"test 3, [^=]*: restitution$", percent),
    ("4 to 8", "sliding limit: impulse", "2 %", r"sliding limit, impulse$", percent),
    (
        "4 to 8", "sliding limit: e_t, spin, rebound angle", "2 %",
        r"sliding limit, (e_t|spin|rebound angle)$", percent,
    ),
    ("4 to 8", "sticking and between: its own rule", "2 %", r"sticking, its own rule$", percent),
    (
        "4 to 8", "all impulses, a scene's law integrated", "2 %",
        r"under the scene law, integrated$", percent,
    ),
    ("7, 8", "momentum", "1e-12", r": momentum$", lambda v: f"{max(v):.0e}"),
    ("3", "order in the step, e = 0.2", "0.9", r"e = 0\.2: order", number),
    ("3", "order in the step, e = 1", "2.4", r"e = 1\.0: order", number),
    ("5", "order in the step, friction", "0.9", r"test 5, .*order .*friction$", number),
    ("6", "order in the step, a scene's law", "0.9", r"test 6, .*order .*friction$", number),
)  # fmt: skip
"""Test, quantity, bar, pattern of the checks' names, how their values are told."""

GAP: tuple[Row, ...] = (
    (
        "6 to 8",
        "as a scene has it",
        "",
        r"test [678], .*sliding limit, impulse, under the scene law$",
        span,
    ),
    ("6", "nothing pulls", "", r"sliding limit, impulse, under the unpulled law$", span),
    ("6", "no tangential damping", "", r"impulse, under the undamped law$", span),
)

CURVES: tuple[Row, ...] = (
    ("4", "impulse, greatest distance from partial slip", "", r"test 4, .*partial slip", percent),
    ("5", "impulse, greatest distance from partial slip", "", r"test 5, .*partial slip", percent),
    (
        "4", "e_t, root mean square distance from the experiment", "", r"from the experiment",
        lambda v: f"{max(v):.3f}",
    ),
)  # fmt: skip


def table(rows: Sequence[Row], record: Mapping[str, Any], first: str, bar: bool) -> str:
    """A Markdown table with a column for each engine; reported values leave no row with a bar."""
    heads = ["test", first, *["bar"] * bar, *ENGINES.values()]
    lines = [heads, ["---"] * len(heads)]
    for test, quantity, limit, pattern, tell in rows:
        cells = [test, quantity, *[limit] * bar]
        for engine in ENGINES:
            values = [
                check["value"]
                for check in record["checks"]
                if check["name"].startswith(f"{engine}, ")
                and re.search(pattern, check["name"])
                and not (bar and check["bar"].startswith("none"))
            ]
            cells.append(tell(values) if values else "-")
        lines.append(cells)
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def tables_of(record: Mapping[str, Any]) -> dict[str, str]:
    """The page's tables by the names of their places."""
    return {
        "accuracy": table(ACCURACY, record, "quantity", bar=True),
        "gap": table(GAP, record, "sliding impulse against μ (1 + e), e = 0.5", bar=False),
        "curves": table(CURVES, record, "quantity", bar=False),
    }


def page_filled(text: str, tables: Mapping[str, str]) -> str:
    """The page with what stands between ``<!-- name -->`` and ``<!-- end -->`` made anew."""
    for name, content in tables.items():
        before, begin, rest = text.partition(f"<!-- {name} -->\n")
        _, end, after = rest.partition("\n<!-- end -->")
        assert begin, name
        assert end, name
        text = before + begin + content + end + after
    return text


def impacts_figure(measured: Mapping[str, Mapping[str, Values]]) -> Figure:
    """Tests 5 and 4: engines, partial slip, finite elements and experiment."""
    from matplotlib.figure import Figure

    from adapters.report_figures import WIDTH

    figure = Figure(figsize=(WIDTH, 3.9))
    left, right = figure.subplots(1, 2)
    mu = TEST_5.friction
    slip = np.linspace(0.02, 12.6, 200)
    left.plot(slip, slip - 3.5 * partial_slip_of(TEST_5, mu * slip) / mu, "k", label="partial slip")
    left.plot(*ELEMENTS_REBOUND.T, "kx", ms=5, label="finite elements (test 5)")
    before = np.array([i.tangential / i.normal for i in TEST_5.impacts]) / mu
    _engines_draw(left, TEST_5, measured, before, lambda j: before - 3.5 * j / mu)
    left.set(
        xlabel=r"slip before, over $\mu V_n$", ylabel=r"slip after, over $\mu V_n$", xlim=(0, 13)
    )
    left.set_title("test 5, steel on a rigid plane, e = 1")
    angle = np.linspace(1, 89, 200)
    tangent = np.tan(np.radians(angle))
    share = (1 + TEST_4.restitution) / 2
    right.plot(angle, 1 - share * partial_slip_of(TEST_4, tangent) / tangent, "k")
    right.plot(*EXPERIMENT_TANGENTIAL_RESTITUTION.T, "ko", ms=4, mfc="none", label="experiment")
    angles = np.arange(5.0, 90.0, 5.0)
    tangents = np.tan(np.radians(angles))
    _engines_draw(right, TEST_4, measured, angles, lambda j: 1 - j / tangents)
    right.set(xlabel="angle of incidence (degrees)", ylabel=r"$e_t$ of the centre", xlim=(0, 90))
    right.set_title("test 4, aluminium oxide, e = 0.98")
    named = {}
    for panel in (left, right):
        for handle, name in zip(*panel.get_legend_handles_labels(), strict=True):
            named[name] = handle
    figure.legend(
        list(named.values()), list(named), loc="outside upper center", ncols=6, columnspacing=1.0
    )
    return figure


def _engines_draw(
    panel: Axes,
    setting: Setting,
    measured: Mapping[str, Mapping[str, Values]],
    abscissa: Any,
    ordinate: Callable[[Any], Any],
) -> None:
    """A line for each engine through what it gave for a setting."""
    for engine, name in ENGINES.items():
        impulse = np.array(measured[engine][f"{setting.label}, friction impulse"])
        panel.plot(
            abscissa, ordinate(impulse), ".-", lw=0.9, ms=5, color=COLOURS[engine], label=name
        )


if __name__ == "__main__":
    from adapters.report_figures import figure_save

    content = json.loads((RESULTS / "engines.json").read_text())
    PAGE.write_text(page_filled(PAGE.read_text(), tables_of(content)))
    values = json.loads((RESULTS / RECORDED).read_text())
    figure_save(lambda: impacts_figure(values), PICTURE)
    for curve, (_, there, here) in published_curves().items():
        print(f"{curve}: partial slip is off by {np.abs(here - there).max():.3g} at most")
