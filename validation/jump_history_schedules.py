"""Equal jumps beside growing ones on the curves of full runs: a table of docs/jump-history.md."""

from __future__ import annotations

from itertools import product

import numpy as np

from adapters.jump_schedule import jump_lengths
from validation.jump_forecasts import curves_of, jumped_error, way_history
from validation.page_text import table
from validation.settlement_ensemble import COARSE, CONFINED
from validation.settlement_ensemble_record import EnsembleRecord
from validation.settlement_rivals import HEALING
from validation.settlement_rivals_reading import rms

SCHEDULED = ((COARSE, 500), (COARSE, 2800), (CONFINED, 500))
SCHEDULES = ((2, 20), (3, 20), (5, 20), (5, 10))
"""Numbers of jumps and cycles of a window of equal and growing jumps."""


def table_schedules(record: EnsembleRecord) -> str:
    """Equal jumps beside growing ones, by history, by windows and number."""
    lines = []
    for kind, last in SCHEDULED:
        curves = curves_of(kind, last, record)
        settled = np.array([curve[last] - curve[kind.k_i] for curve in curves])
        scale = float(settled.mean())
        for jumps, window in SCHEDULES:
            computed = window + jumps * (HEALING + window)
            share = f"{100 * computed / (last - kind.k_i):.0f}"
            lines.append([f"{kind.name} to {last:,}", str(jumps), str(window), share])
            for growing, moved in product((False, True), repeat=2):
                lengths = jump_lengths(jumps, last, kind.k_i, window, HEALING, growing)
                error = np.array(
                    [jumped_error(one, kind.k_i, lengths, way_history, moved, window)
                     for one in curves]
                )  # fmt: skip
                spread = float((settled + error).std(ddof=1) / settled.std(ddof=1))
                lines[-1].append(
                    f"{100 * error.mean() / scale:+.0f} (**{100 * rms(error) / scale:.0f}**), "
                    f"{spread:.1f}"
                )
    head = ["run", "jumps", "window", "cycles computed, %", "equal", "equal, moved bed"]
    return table([*head, "growing", "growing, moved bed"], lines)
