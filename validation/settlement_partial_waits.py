"""What a shorter wait for the piston of packing 2 would foretell: a table of the partial page.

No bed is moved: the forecast by history is laid over the full runs' curves.
"""

from __future__ import annotations

import numpy as np

from adapters.state import FloatArray
from validation.jump_forecasts import curve_of, stretch, way_history
from validation.page_text import table
from validation.settlement_ensemble import PARTIAL
from validation.settlement_ensemble_record import EnsembleRecord
from validation.settlement_partial_bearing import hung_first

PACKING, WINDOW, HEALED = 2, 4, 6
"""The one whose piston hangs; cycles of a window, and healing ones behind a jump."""
BEHIND = HEALED + WINDOW
"""Cycles computed behind a jump."""
WAITS = (48, 52, 56, 60, 64, 68, 72)
"""Cycles from which the one jump is made, that behind k_i + k of carrying last."""


def table_waits(record: EnsembleRecord) -> str:
    """A line a wait: cycles computed in the mean of all packings, and what the jump errs by, cycles
    counted from the first, and from the last in which the piston hung.

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
        end = last - BEHIND
        errors = {
            whole: [
                1e6 * forecast_error(curve, 0 if whole else let_go, let_go, wait, end)
                for curve, let_go in zip(curves, hung, strict=True)
            ]
            for whole in (True, False)
        }
        lines.append(
            [
                str(wait), str(wait - max(hung)), f"{computed:.1f}",
                f"{100 * ((last - k_i) / computed - 1):.0f}",
                *(f"{error:+.0f}" for found in errors.values() for error in found),
                f"{np.mean(errors[False]) / PARTIAL.packings:+.1f}",
            ]
        )  # fmt: skip
    head = ("jump from cycle", "carried for cycles, at least", "cycles computed, mean of five",
            "gained time by them, %", "from the first: run 1, µm", "run 2, µm",
            "from where it is carried: run 1, µm", "run 2, µm",
            "mean of both over five packings, µm")  # fmt: skip
    return table(head, lines)


def forecast_error(curve: FloatArray, zero: int, let_go: int, first: int, last: int) -> float:
    """Settlement from cycle ``first`` to ``last`` by history less that of the ``curve`` [m], fitted
    to the cycles behind ``let_go`` but one; N counts from cycle ``zero``."""
    counted = curve[zero:] - curve[zero]
    known = [stretch(counted, let_go + 1 - zero, first - zero)]
    return way_history(known, last - first, []) - float(curve[last] - curve[first])
