"""Jumps to 10,000 cycles of the coarse bed beside the ensemble: a table of docs/settlement-far.md.

`validation.settlement_rivals_runs --study far` makes the record.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from validation.page_text import table
from validation.settlement_bars import bias_beside_interval, settlement_of, spread
from validation.settlement_rivals import K_I, Row
from validation.settlement_rivals_reading import FIGURES, cost, finished, judged, reference
from validation.settlement_rivals_reference import LAWS, law_name
from validation.settlement_rivals_studies import STUDIES

STUDY = STUDIES["far"]
CHEAPER = 20.0
"""What the jumps are asked to save: full cost over theirs."""
HEAD = ("way to the last cycle", "packings", "cycles computed", "cheaper by",
        "settlement since kᵢ, µm", "error over half the reference's interval",
        "spread over the reference's", "coordination number", "elastic deflection")  # fmt: skip


def table_jumps(rows: Sequence[Row], last: int = STUDY.last) -> str:
    """A line a way, laws fitted to the first cycles last; a dash is what can not be judged.

    ``rows``: lines of the study's record, the reference's among them where it has come to ``last``.
    """
    truth = reference(rows, last)
    lines = []
    if truth:
        found, full = settlement_of(rows, last), f"{last - K_I:,}"
        settled = f"{1e6 * found.mean:,.0f} ± {1e6 * found.half_given:,.0f}"
        packings = str(len({row["seed"] for row in truth}))
        lines.append(["every cycle (the reference)", packings, full, "1", settled, *4 * ["-"]])
    ways = [*(method.name for method in STUDY.methods), *(law_name(*one) for one in LAWS)]
    for name in ways:
        mine = finished(rows, name, last)
        if mine:
            lines.append(line_of(rows, name, last, mine))
    return table(HEAD, lines)


def line_of(rows: Sequence[Row], name: str, last: int, mine: Sequence[Row]) -> list[str]:
    """A way's line; ``mine``: its runs that came to ``last``."""
    truth = reference(rows, last)
    settled = 1e6 * float(np.mean([FIGURES["settlement"].value(row) for row in mine]))
    computed = float(np.mean([row["computed"] for row in mine]))
    line = [name, str(len({row["seed"] for row in mine})), f"{computed:,.0f}"]
    if not truth:
        return [*line, "-", f"{settled:,.0f}", *4 * ["-"]]
    errors = [judged(rows, name, last, key) for key in ("coordination", "deflection")]
    return [
        *line, f"{cost(truth) / cost(mine):.1f}", f"{settled:,.0f}",
        f"{bias_beside_interval(rows, name, last):.2f}", f"{spread(rows, name, last):.1f}",
        *(f"{100 * one.mean:+.0f} ± {100 * one.half:.0f} %" if one else "-" for one in errors),
    ]  # fmt: skip
