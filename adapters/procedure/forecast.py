"""What a run knows from the cycles that it computed: how far grains and loaded body go in a jump.

The loaded body stands on few grains and sinks several times as far as the mean grain, so it is
forecast from its own cycles, with its own debts: lowered by the mean grain's strain, it stays
behind.
"""

from collections.abc import Sequence
from dataclasses import replace
from math import inf, log
from typing import Any

import numpy as np

from adapters.files import Outcome
from adapters.jumps import LOADED_BODY, SLOPES, Jumped, SlopeNumbers, Stretch, find_asked_gain
from adapters.procedure.seating import SEATING, find_count_start
from adapters.procedure.stages import Bed, Gains, Run

BURST = 2.0
"""Greatest settlement of the loaded body in a jump, a unit of ln N, over the least of that since
the first jump and that in the last one with the window behind it [-]: a burst of few supporters in
a window is no rate, and beds sink by N^0.4 at most, which from 50 to 500 cycles asks 1.5 of it."""


def estimate_gains(run: Run, bed: Bed, h: int) -> Gains:
    """What a jump of ``h`` cycles is to settle by."""
    gain = estimate_gain(run, bed, h, run.folder.outcomes(), SLOPES)
    return Gains(gain, estimate_sinking(run, bed, h))


def estimate_sinking(run: Run, bed: Bed, h: int) -> float:
    """Settlement of the loaded body in a jump of ``h`` cycles [m]."""
    body = follow_loaded_body(run.folder.outcomes())
    sinking = estimate_gain(run, bed, h, body, LOADED_BODY)
    jumps = [one for one in list_jumps(body, bed.cycle) if one.cycles[0] >= run.first_cycle]
    return min(sinking, bound_burst(jumps, bed.cycle, h))


def estimate_gain(
    run: Run, bed: Bed, h: int, outcomes: Sequence[Outcome], numbers: SlopeNumbers
) -> float:
    """Settlement over a jump [m] by all cycles in which the bed carried the piston, but the first
    of them.

    Cycles count from the last in which it hung: from there on the bed takes the load for the first
    time, and settles by ln of these, as one does that carried its piston from the rain on.
    """
    p = run.procedure
    hung = find_count_start(run, bed)
    left_out = max(1, round(SEATING.first_share * p.k_i))
    begin = hung + (min(left_out, p.carried_cycles) if hung else left_out)  # k cycles are left
    known = [
        replace(one, first_cycle=one.first_cycle - hung)
        for one in list_stretches(outcomes, begin, bed.cycle, left_out=1)
    ]
    jumps = [
        replace(one, cycles=one.cycles - hung)
        for one in list_jumps(outcomes, bed.cycle)
        if one.cycles[0] >= begin
    ]
    return find_asked_gain(known, h, jumps, numbers)


def bound_burst(jumps: Sequence[Jumped], cycle: int, h: int) -> float:
    """Most that the loaded body may sink in a jump of ``h`` cycles at ``cycle`` [m]: `BURST`."""
    if not jumps:
        return inf
    now = jumps[-1]
    slopes = [
        float(now.settlement[2] - one.settlement[0]) / log(now.cycles[2] / one.cycles[0])
        for one in (jumps[0], now)
    ]
    least = min((slope for slope in slopes if slope > 0), default=inf)
    return BURST * least * log((cycle + h) / cycle)


def follow_loaded_body(outcomes: Sequence[Outcome]) -> list[Outcome]:
    """Stages whose settlement is the loaded body's, from an arbitrary zero."""
    return [
        replace(one, rows=[row | {"settlement": -row["piston_height"]} for row in one.rows])
        for one in outcomes
    ]


def make_stretch(rows: list[dict[str, Any]], before: float) -> Stretch:
    """Cycles of a table's ``rows``; ``before``: settlement at the end of the cycle before [m]."""
    settlement = np.array([before, *(row["settlement"] for row in rows)], float)
    return Stretch(
        int(rows[0]["cycle"]) - 1,
        np.diff(settlement),
        np.array([row["coordination_number"] for row in rows], float),
        np.array([row["elastic_deflection"] for row in rows], float),
    )


def list_stretches(
    outcomes: Sequence[Outcome], begin: int, end: int, left_out: int | None = None
) -> tuple[Stretch, ...]:
    """Cycles computed from cycle ``begin`` to ``end``, a stretch a window.

    Of its healing cycles the first ``left_out`` are left out; None: all.
    """
    stretches: list[Stretch] = []
    settlement = 0.0
    for outcome in outcomes:
        if outcome.last_cycle > end:
            break
        rows = [{"settlement": settlement, "cycle": outcome.first_cycle}, *outcome.rows]
        settlement = float(rows[-1]["settlement"])
        healed = sum(row["kind"] != "computed" for row in outcome.rows)
        healed = healed if left_out is None else min(healed, left_out)
        first = max(healed, begin - outcome.first_cycle)
        if outcome.stage == "window" and first < len(outcome.rows):
            stretches.append(make_stretch(rows[first + 1 :], float(rows[first]["settlement"])))
    return tuple(stretches)


def list_jumps(outcomes: Sequence[Outcome], end: int) -> list[Jumped]:
    """Jumps kept up to cycle ``end``, each with the window behind it."""
    outcomes = [one for one in outcomes if one.last_cycle <= end]
    found = []
    for before, jump, behind in zip(outcomes, outcomes[1:], outcomes[2:], strict=False):
        if jump.stage == "jump" and jump.rows:
            rows = [one.rows[-1] for one in (before, jump, behind)]
            cycles = np.array([row["cycle"] for row in rows], int)
            settled = np.array([row["settlement"] for row in rows], float)
            found.append(Jumped(cycles, settled))
    return found
