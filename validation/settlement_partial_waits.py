"""What a shorter wait for the piston of packing 2 would foretell: a table of the partial page.

No bed is moved: the forecast by history is laid over the full runs' curves.
"""

from __future__ import annotations

import numpy as np

from validation.jump_forecasts import curve_of, stretch, way_history
from validation.page_text import table
from validation.settlement_ensemble import PARTIAL
from validation.settlement_ensemble_record import EnsembleRecord
from validation.settlement_partial_bearing import hung_first
from validation.settlement_rivals import HEALING

PACKING, WINDOW = 2, 5
"""The one whose piston hangs; cycles of a window there."""
BEHIND = HEALING + WINDOW
"""Cycles computed behind a jump."""
WAITS = (50, 55, 60, 65, 70)
"""Cycles from which the one jump is made, that behind k_i + k of carrying last."""


def table_waits(record: EnsembleRecord) -> str:
    """A line a wait: cycles computed in the mean of all packings, and what the jump errs by.

    Fitted are the cycles in which the bed carries the piston, but the first of them.
    """
    runs = [piece for piece in PARTIAL.runs() if piece.seed == PACKING and piece.packing]
    last, k_i = PARTIAL.last, PARTIAL.k_i
    curves = [curve_of(piece, record) for piece in runs]
    hung = [hung_first(piece, record) for piece in runs]
    lines = []
    for wait in WAITS:
        computed = (wait - k_i + BEHIND + (PARTIAL.packings - 1) * (WINDOW + BEHIND)) / (
            PARTIAL.packings
        )
        errors = []
        for curve, let_go in zip(curves, hung, strict=True):
            known = [stretch(curve, let_go + 1, wait)]
            end = last - BEHIND
            foretold = way_history(known, end - wait, [])
            errors.append(1e6 * (foretold - (curve[end] - curve[wait])))
        lines.append(
            [
                str(wait), str(wait - max(hung)), f"{computed:.1f}",
                f"{100 * ((last - k_i) / computed - 1):.0f}",
                *(f"{error:+.0f}" for error in errors),
                f"{np.mean(errors) / PARTIAL.packings:+.1f}",
            ]
        )  # fmt: skip
    head = ("jump from cycle", "carried for cycles, at least", "cycles computed, mean of five",
            "gained time by them, %", "error, run 1, µm", "error, run 2, µm",
            "mean of both over five packings, µm")  # fmt: skip
    return table(head, lines)
