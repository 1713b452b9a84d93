"""Jumps laid over curves whose every cycle is known: what ways to forecast them err by.

No bed, no relaxation and no engine; the curves are those of the reference ensemble.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from adapters.jump_history import Jumped, asked_gain
from adapters.jump_rates import Stretch
from adapters.jump_seating import SEATING
from adapters.laws import law_named
from adapters.state import FloatArray
from validation.settlement_ensemble import Kind, Piece
from validation.settlement_ensemble_record import EnsembleRecord
from validation.settlement_rivals import FIRST_WINDOW, HEALING
from validation.settlement_rivals_reference import columns_by_cycle

FIRST_CYCLE, KAPPA = 0.15, 0.1
"""What a moved bed was made to settle more by, over what it was moved by: in the first cycle behind
the jump, and times 1 / n in each later one."""

Way = Callable[[Sequence[Stretch], int, Sequence[Jumped]], float]
"""Settlement [m] over a jump of h cycles behind the last of the stretches that were computed, and
the jumps between them."""


def way_nothing(known: Sequence[Stretch], h: int, jumps: Sequence[Jumped]) -> float:
    """The null hypothesis."""
    return 0.0


def way_window(known: Sequence[Stretch], h: int, jumps: Sequence[Jumped]) -> float:
    """The logarithm fitted to the last window, as the procedure does with every grain."""
    law, computed = law_named("log"), known[-1]
    last = computed.part(max(len(computed.gain) - FIRST_WINDOW, 0), len(computed.gain))
    cycle = last.first_cycle + np.arange(len(last.gain) + 1.0)
    path = np.append(0.0, np.cumsum(last.gain))
    return float(law.increment(law.fit(cycle, path), cycle[-1], cycle[-1] + h))


def way_one_slope(known: Sequence[Stretch], h: int, jumps: Sequence[Jumped]) -> float:
    """One slope du / d ln N for all cycles computed."""
    span = sum(np.log(one.last_cycle / one.first_cycle) for one in known)
    return float(sum(one.gain.sum() for one in known) / span * np.log1p(h / known[-1].last_cycle))


def way_history(known: Sequence[Stretch], h: int, jumps: Sequence[Jumped]) -> float:
    """`adapters.jump_history`."""
    return asked_gain(known, h, jumps)


WAYS: dict[str, Way] = {
    "nothing": way_nothing,
    "log, last window": way_window,
    "one slope of all cycles": way_one_slope,
    "history": way_history,
}


def stretch(curve: FloatArray, first: int, last: int) -> Stretch:
    """Cycles behind ``first`` to ``last`` of a settlement ``curve`` [m] by cycle, 0 first."""
    gain = np.diff(curve[first : last + 1])
    return Stretch(first, gain, np.zeros(len(gain)), np.zeros(len(gain)))


def jumped_error(
    curve: FloatArray, k_i: int, lengths: Sequence[int], way: Way, moved: bool = False,
    window: int = FIRST_WINDOW,
) -> float:  # fmt: skip
    """Settlement by jumps of ``lengths`` h less that of the ``curve`` [m].

    Windows of ``window`` cycles and healing are its own; where the bed is ``moved`` they settle
    more by `FIRST_CYCLE` and `KAPPA`.
    """
    end = k_i + window
    known = [stretch(curve, round(SEATING * k_i), k_i), stretch(curve, k_i, end)]
    since = np.arange(1, HEALING + window + 1)
    more = moved * np.where(since == 1, FIRST_CYCLE, KAPPA / since)
    settled, made = float(curve[end]), list[Jumped]()
    for h in lengths:
        gain, before, behind = way(known, h, made), end, end + h
        end = behind + len(since)
        path = curve[behind : end + 1] + gain * np.append(0.0, np.cumsum(more))
        seen = stretch(path, 0, len(since))
        known.append(replace(seen.part(1, len(since)), first_cycle=behind + 1))
        ends = settled + np.array([0.0, gain, gain + seen.gain.sum()])
        made.append(Jumped(np.array([before, behind, end]), ends))
        settled = float(ends[2])
    return settled - float(curve[end])


def curve_of(piece: Piece, record: EnsembleRecord) -> FloatArray:
    """Settlement [m] of a member by cycle, from 0 on."""
    found = columns_by_cycle(piece, record)
    return np.array([0.0, *(found[cycle]["settlement"] for cycle in range(1, max(found) + 1))])


def curves_of(kind: Kind, last: int, record: EnsembleRecord) -> list[FloatArray]:
    """Settlement [m] by cycle, from 0 to ``last``, of all members that have come there."""
    runs = ((piece, record.kept(piece.name)) for piece in kind.runs() if piece.packing)
    return [
        curve_of(piece, record)[: last + 1] for piece, kept in runs if kept and kept.cycle >= last
    ]
