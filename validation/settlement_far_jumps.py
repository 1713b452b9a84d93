"""Jumps to 10,000 cycles of the coarse bed beside the ensemble: tables of docs/settlement-far.md.

`validation.settlement_rivals_runs --study far` makes the record.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from adapters.jump_schedule import jump_lengths
from validation.jump_forecasts import WAYS, curves_of, jumped_error
from validation.page_text import table
from validation.settlement_bars import bias_beside_interval, settlement_of, spread
from validation.settlement_ensemble_record import EnsembleRecord
from validation.settlement_rivals import FIRST_WINDOW, HEALING, K_I, Row
from validation.settlement_rivals_reading import (
    FIGURES,
    cheaper_even,
    cost,
    finished,
    judged,
    reference,
)
from validation.settlement_rivals_reference import LAWS, law_name
from validation.settlement_rivals_studies import STUDIES

STUDY = STUDIES["far"]
CHEAPER = 20.0
"""What the jumps are asked to save: full cost over theirs."""
NUMBERS = (5, 8, 13, 20)
"""Of growing jumps whose forecasts are tried on the curves of full runs."""
HEAD = ("way to the last cycle", "runs", "cycles computed", "cheaper by",
        "at equal cost a step", "settlement since kᵢ, µm",
        "error over half the reference's interval",
        "with what is owed, µm", "error over half the interval", "spread over the reference's",
        "coordination number", "elastic deflection")  # fmt: skip


def table_jumps(rows: Sequence[Row], last: int = STUDY.last) -> str:
    """A line a way, laws fitted to the first cycles last; a dash is what can not be judged.

    ``rows``: lines of the study's record, the reference's among them where it has come to ``last``.
    """
    truth = reference(rows, last)
    lines = []
    if truth:
        found, full = settlement_of(rows, last), f"{last - K_I:,}"
        settled = f"{1e6 * found.mean:,.0f} ± {1e6 * found.half_given:,.0f}"
        lines.append(
            ["every cycle (the reference)", str(len(truth)), full, "1", "1", settled, *6 * ["-"]]
        )
    ways = [*(method.name for method in STUDY.methods), *(law_name(*one) for one in LAWS)]
    for name in ways:
        mine = finished(rows, name, last)
        if mine:
            lines.append(line_of(rows, name, last, mine))
    return table(HEAD, lines)


def cheaper(rows: Sequence[Row], name: str, last: int = STUDY.last) -> float:
    """CPU time behind k_i of every cycle over a way's, all counted."""
    return cost(reference(rows, last)) / cost(finished(rows, name, last))


def owed(row: Row) -> float:
    """What the last jump of a run was to move it by and did not [m]: debts of earlier ones too."""
    asked, moved = row["moved"][-1] if row.get("moved") else (0.0, 0.0)
    return float(asked - moved)


def line_of(rows: Sequence[Row], name: str, last: int, mine: Sequence[Row]) -> list[str]:
    """A way's line; ``mine``: its runs that came to ``last``."""
    truth = reference(rows, last)
    settled = 1e6 * float(np.mean([FIGURES["settlement"].value(row) for row in mine]))
    computed = float(np.mean([row["computed"] for row in mine]))
    line = [name, str(len(mine)), f"{computed:,.0f}"]
    if not truth:
        return [*line, "-", "-", f"{settled:,.0f}", *6 * ["-"]]
    foretold = ["-", "-"]
    if any(row.get("moved") for row in mine):
        known = settlement_of(rows, last)
        with_owed = settled + 1e6 * float(np.mean([owed(row) for row in mine]))
        error = abs(1e-6 * with_owed - known.mean) / known.half_given
        foretold = [f"{with_owed:,.0f}", f"{error:.2f}"]
    errors = [judged(rows, name, last, key) for key in ("coordination", "deflection")]
    return [
        *line, f"{cheaper(rows, name, last):.1f}", f"{cheaper_even(mine, truth):.1f}",
        f"{settled:,.0f}",
        f"{bias_beside_interval(rows, name, last):.2f}", *foretold,
        f"{spread(rows, name, last):.1f}",
        *(f"{100 * one.mean:+.0f} ± {100 * one.half:.0f} %" if one else "-" for one in errors),
    ]  # fmt: skip


def table_forecasts(record: EnsembleRecord, last: int = STUDY.last) -> str:
    """What forecasts of growing jumps err by on the reference's own curves; no bed is moved."""
    curves = curves_of(STUDY.kind, last, record)
    settled = float(np.mean([curve[last] - curve[K_I] for curve in curves]))
    lines = []
    for jumps in NUMBERS:
        lengths = jump_lengths(jumps, last, K_I, FIRST_WINDOW, HEALING)
        computed = FIRST_WINDOW + jumps * (HEALING + FIRST_WINDOW)
        lines.append([str(jumps), f"{computed:,}"])
        for way in WAYS.values():
            errors = [jumped_error(curve, K_I, lengths, way) / settled for curve in curves]
            mean, scatter = np.mean(errors), np.std(errors, ddof=1)
            lines[-1].append(f"{100 * mean:+.0f} ± {100 * scatter:.0f}")
    return table(["jumps", "cycles computed", *(f"{name}, %" for name in WAYS)], lines)


def table_noise(record: EnsembleRecord, last: int = STUDY.last) -> str:
    """What a window sees of the slope: the bed's gain in it, beside its scatter over all runs."""
    curves = np.array(curves_of(STUDY.kind, last, record))
    slope = float((curves[:, last] - curves[:, K_I]).mean() / np.log(last / K_I))
    lines = []
    for first in (120, 200, 500, 1000, 2000, 5000, last - FIRST_WINDOW):
        gain = curves[:, first + FIRST_WINDOW] - curves[:, first]
        told, noise = slope * np.log1p(FIRST_WINDOW / first), float(gain.std(ddof=1))
        cells = (f"{1e6 * told:.1f}", f"{1e6 * noise:.1f}", f"{told / noise:.2f}")
        lines.append([f"{first:,}", *cells])
    head = ["a window from cycle", "the mean slope gains in it, µm", "its gain scatters by, µm"]
    return table([*head, "the one over the other"], lines)
