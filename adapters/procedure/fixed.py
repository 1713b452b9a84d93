"""A run whose windows and jumps have given lengths k and h, as in Fig. 10 of Karrech et al. (2007).

What the mean grain settles by is its law's or, where the scene says so, that of all cycles
computed (`adapters.jumps.slopes`).  A jump that fails is tried again: shorter, or over the same
cycles with a share of the move, whose rest the next jump is asked for.
"""

from collections.abc import Sequence

import numpy as np

from adapters.errors import EngineFailed, NotConverged, NotCredible
from adapters.files import Outcome, explain_full_disk, place_stage
from adapters.procedure import stages
from adapters.procedure.forecast import estimate_gains
from adapters.procedure.seating import find_count_start, seat_piston, warn_if_hung
from adapters.procedure.stages import Bed, Run

RETRIES = 3
"""How often a failed jump is tried again, by its law each time half as long."""
SHARES = (1.0, 0.5, 0.25, 0.0)
"""Of the move, by history, in each of the tries: the bed has no room for more."""
ROOM_GROWTH = 2.0
"""Of what a bed had room for, the most that the next jump by history tries to move it by."""


def settle_fixed(run: Run, bed: Bed) -> Bed:
    """From the bed after k_i cycles to the end: k cycles and a jump of h, again and again.

    Where less is left than the shortest h, cycles are computed; where jumps waited for the piston,
    the last is one of what is left, if it skips no fewer cycles than its healing costs.
    """
    p = run.procedure
    k = p.window_cycles
    if bed.cycle < p.total_cycles:
        bed = stages.compute(run, bed, min(k, p.total_cycles - bed.cycle))
    for number in range(p.total_cycles):
        if not run.variant.jumps:
            break
        bed = seat_piston(run, bed, p.carried_cycles + k)
        shortest = max(p.healing_cycles, 1) if find_count_start(run, bed) else min(p.h or (0,))
        longest = p.total_cycles - bed.cycle - p.healing_cycles - k
        h = min(p.jump_cycles(number), longest)
        if longest < shortest:
            break
        warn_if_hung(run, bed)
        bed = jump_and_heal(run, bed, h)
    while bed.cycle < p.total_cycles:
        bed = stages.compute(run, bed, min(k, p.total_cycles - bed.cycle))
    return bed


def jump_and_heal(run: Run, bed: Bed, h: int) -> Bed:
    """A jump of ``h`` cycles and the window after it; a failed jump is tried again.

    By its law half as long.  By history with one of `SHARES` of the move, or of the room that jumps
    before it found: the next jump knows the rest and adds it.  Where the jump and
    its retries failed: `compute_on` if the run may compute what it cannot jump, else raises
    `NotCredible`.
    """
    p = run.procedure
    why = ""
    for attempt in range(1, RETRIES + 2):
        name = f"jump_{bed.cycle:06d}_{attempt}"
        why = run.folder.failure(name)
        if not why:
            try:
                with explain_full_disk(run.folder.path):
                    by_history = p.settlement == "history" and h > 0
                    gains = estimate_gains(run, bed, h) if by_history else None
                    share, gain = 1.0, gains.mean_grain if gains else 0.0
                    if gains:
                        room = find_known_room(run.folder.outcomes(), bed.cycle, run.first_cycle)
                        share = SHARES[attempt - 1] * (min(1.0, room / gain) if gain else 1.0)
                    new = run.folder.outcome(name) is None
                    moved = stages.jump(run, bed, h, attempt, gains, share)
                    if new and gain and share < 1:
                        run.progress.print_line(
                            f"the jump settles the bed by {1e6 * share * gain:.3g} um where it "
                            f"owes {1e6 * gain:.3g}: no room for more was found, by it or the one "
                            "before"
                        )
                    cycles = p.healing_cycles + p.window_cycles
                    return stages.compute(run, moved, cycles, p.healing_cycles)
            except (EngineFailed, NotCredible, NotConverged) as error:
                if isinstance(error, EngineFailed) and error.from_outside:
                    raise
                why = str(error)
                run.folder.give_up(name, why)
                run.progress.print_line(f"the jump of {h} cycles from {bed.cycle} failed: {why}")
        if p.settlement == "law":
            h = h // 2 if h > 1 else h
    failed = f"the jump from cycle {bed.cycle} failed {RETRIES + 1} times, the last time: {why}"
    if run.cycle_by_cycle:
        run.progress.print_line(f"{failed}; computing on")
        return compute_on(run, bed)
    raise NotCredible(
        failed,
        where=str(run.folder.path),
        remedy="more cycles k before the jump, a shorter h, or windows in its place: "
        "trackbed resume RUN --cycle-by-cycle; the cycles before it are kept",
    )


def compute_on(run: Run, bed: Bed) -> Bed:
    """Windows in place of a jump: one at the first place that no jump leaves, twice as many at each
    further one, so that tries stay few where none succeeds."""
    p = run.procedure
    tries = [name for name in run.folder.stage_names() if name.endswith(f"_{RETRIES + 1}")]
    failed = [name for name in tries if run.folder.failure(name)]
    places = sum(place_stage(name)[0] <= bed.cycle for name in failed)
    end = min(p.total_cycles, bed.cycle + p.window_cycles * 2 ** (places - 1))
    while bed.cycle < end:
        bed = stages.compute(run, bed, min(p.window_cycles, end - bed.cycle))
    return bed


def find_known_room(outcomes: Sequence[Outcome], end: int, begin: int = 0) -> float:
    """What the next jump by history may try to move the mean grain by [m]; inf: all that is asked.

    Debts grow behind a jump without room, and shares of them with them: a bed that settles by 30 um
    a jump would be asked for a quarter of 500.  So a jump tries no more than `ROOM_GROWTH` times
    what the one before found room for, half of its smallest try where it found none.
    """
    room = np.inf
    for one in outcomes:
        known = begin <= one.first_cycle and one.last_cycle <= end
        if one.stage != "jump" or not known or not one.notes.get("asked"):
            continue
        tried, got = min(room, one.notes["asked"]), one.notes["gain"]
        if one.notes["attempt"] == 1:
            room = max(room, ROOM_GROWTH * got)
        else:
            room = ROOM_GROWTH * got if got else tried * min(filter(None, SHARES)) / 2
    return float(room)
