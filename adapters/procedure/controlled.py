"""A run whose jumps choose themselves: carries out what `adapters.jumps.control` decides.

Nothing is kept between two stages but the run folder: a run that is resumed goes through the same
decisions on the finished stages, and finds there what it would do.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from math import nan
from typing import Any

from adapters import jumps
from adapters.errors import EngineFailed, JumpRefused, NotConverged, NotCredible
from adapters.files import explain_full_disk
from adapters.jumps import Control, Decision, Landing, Settings, Stretch
from adapters.laws.fit import Regime
from adapters.procedure import forecast, stages
from adapters.procedure.history import make_plain, sum_cost
from adapters.procedure.record import CHECK, DECISION
from adapters.procedure.seating import seat_piston, warn_if_hung
from adapters.procedure.stages import Bed, Gains, Run

ASKED = ("action", "jump", "window")
"""What tells two decisions from one state: a run that was extended decides its end again."""


def settle_controlled(run: Run, bed: Bed) -> Bed:
    """From the bed after k_i cycles to the end: windows and jumps as the controller decides.

    Where jumps wait for a piston that hangs, nothing of the cycles before is known to it behind.
    Raises `JumpRefused` where the bed, or a piston on a part of it, ratchets or collapses, unless
    the run was asked to go on.
    """
    procedure = run.procedure
    assert procedure.tolerance is not None
    settings = Settings(
        procedure.tolerance, procedure.healing_cycles, procedure.total_cycles, run.cycle_by_cycle
    )
    journal = Journal(run)
    rows = run.outcome(bed.window).rows
    control = Control(bed.cycle, float(rows[-1]["settlement"]))
    while True:
        if (seated := seat_piston(run, bed, procedure.carried_cycles)).cycle > bed.cycle:
            bed = seated
            control = Control(bed.cycle, float(run.outcome(bed.window).rows[-1]["settlement"]))
        decision = jumps.decide(control, settings, find_piston_regime(run, control))
        if decision.action == "end":
            return bed
        journal.write(DECISION, decision.cycle, decision.attempt, asdict(decision))
        if decision.action == "refuse":
            raise make_refusal(run, decision)
        if decision.action == "compute":
            bed = stages.compute(run, bed, decision.window)
            rows = run.outcome(bed.window).rows
            stretch = forecast.make_stretch(rows, control.settlement)
            control = jumps.observe(control, stretch, float(rows[-1]["settlement"]))
        else:
            warn_if_hung(run, bed)
            bed, control = jump_and_check(run, bed, control, decision, settings, journal)


def find_piston_regime(run: Run, control: Control) -> Regime | None:
    """Regime of a piston on a part of the section, from the windows that still count.

    Such a piston may break into the bed while grains beside it rise as much as those under it
    sink: what the mean grain settles by does not show it.  None where the piston covers all of the
    section, where no window is known yet, and where it does not sink.
    """
    if run.scene.loaded_area >= run.scene.container.area or not control.stretches:
        return None
    sunk: tuple[Stretch, ...] = ()
    body = forecast.follow_loaded_body(run.folder.outcomes())
    for stretch in forecast.list_stretches(body, control.stretches[0].first_cycle, control.cycle):
        sunk = jumps.join_stretch(sunk, stretch)
    return find_sinking_regime(sunk, control.landings)


def find_sinking_regime(sunk: Sequence[Stretch], landings: Sequence[Landing]) -> Regime | None:
    """Regime of what a piston has ``sunk`` by, less what it sinks more behind ``landings``: jumps
    lower it by what they move the mean grain by.  That excess does not fall with N, and would pass
    for ratcheting where jumps grow.  None where it does not sink."""
    kappa = jumps.estimate_slopes(sunk, landings).kappa()[0] if landings else 0.0
    own = [jumps.remove_moves(one, landings, kappa) for one in sunk]
    found = jumps.fit_forecast(jumps.find_rates(own))
    return found.regime if found.rate @ found.weight > 0 else None


def jump_and_check(
    run: Run, bed: Bed, control: Control, decision: Decision, settings: Settings, journal: Journal
) -> tuple[Bed, Control]:
    """The jump, the window behind it, and the verdict; a jump taken back leaves the bed before it.

    The bed before a jump is a finished stage and stays; the window behind a jump that is not
    kept goes to ``discarded/``, what it cost to the jump's record.
    """
    name = f"jump_{bed.cycle:06d}_{decision.attempt}"
    if run.folder.failure(name):
        error = run.folder.failure_details(name).get("error", nan)
        return bed, jumps.reject(control, decision, float(error), settings)
    healing = settings.healing
    try:
        with explain_full_disk(run.folder.path):
            gains = Gains(decision.moved, forecast.estimate_sinking(run, bed, decision.jump))
            moved = stages.jump(run, bed, decision.jump, decision.attempt, gains)
            after = stages.compute(run, moved, healing + decision.window, healing)
    except (EngineFailed, NotCredible, NotConverged) as error:
        if isinstance(error, EngineFailed) and error.from_outside:
            raise
        run.folder.give_up(name, str(error))
        run.progress.print_line(
            f"the jump of {decision.jump} cycles from {bed.cycle} failed: {error}"
        )
        return bed, jumps.reject(control, decision, nan, settings)
    rows = run.outcome(after.window).rows
    settlement = float(rows[-1]["settlement"])
    stretch = forecast.make_stretch(rows, float(run.outcome(name).rows[-1]["settlement"]))
    check = jumps.judge(control, decision, settings, stretch, settlement)
    record = {"jump": decision.jump, "window": healing + decision.window, **asdict(check)}
    journal.write(CHECK, decision.cycle, decision.attempt, record)
    if check.accepted:
        return after, jumps.accept(control, decision, check, settings, stretch, settlement)
    why = (
        f"taken back: the bed gained {1e6 * check.gained:.3g} um, and the rates on both sides give "
        f"{1e6 * check.expected:.3g} um: an error of {100 * check.error:+.3g} % of the total"
    )
    lost_s = sum(sum_cost(run.outcome(stage).cost) for stage in (name, after.window))
    lost = {"lost_s": lost_s, "lost_cycles": healing + decision.window}
    run.folder.give_up(name, why, error=check.error, **lost)
    run.folder.discard(run.folder.path / after.window)
    run.folder.write_settlement()
    run.progress.print_line(f"the jump of {decision.jump} cycles from {bed.cycle} was {why}")
    return bed, jumps.reject(control, decision, check.error, settings)


def make_refusal(run: Run, decision: Decision) -> JumpRefused:
    """The error of a run that may not jump."""
    return JumpRefused(
        f"up to cycle {decision.cycle} {decision.why}: it goes as N^(beta - 1) with beta = "
        f"{decision.exponent:.2f}, and no law says when that ends",
        where=str(run.folder.path),
        remedy="every cycle so far is kept; to compute the others one by one: "
        "trackbed resume RUN --cycle-by-cycle",
        regime=decision.regime,
        parameters={"exponent": decision.exponent},
    )


class Journal:
    """Events of a controlled run, each once, however often the run was resumed."""

    def __init__(self, run: Run) -> None:
        self._run = run
        self._known = {
            (event["event"], event["cycle"], event["attempt"], *map(event.get, ASKED))
            for event in run.folder.events()
            if event["event"] in (DECISION, CHECK)
        }
        self._silent: set[str] = set()

    def write(self, what: str, cycle: int, attempt: int, content: Mapping[str, Any]) -> None:
        """One event, unless it is there; a run that cannot jump says so on the screen, once."""
        key = (what, cycle, attempt, *map(content.get, ASKED))
        if key in self._known:
            return
        self._known.add(key)
        details = make_plain(content) | {"cycle": cycle, "attempt": attempt}
        self._run.folder.add_event(what, **details)
        why = str(content.get("why", ""))
        if what == DECISION and content["action"] == "compute" and content["binding"]:
            kind = why.partition(":")[0]
            if kind not in self._silent:
                self._run.progress.print_line(f"cycle {cycle}: {why}; computing on")
            self._silent.add(kind)
