"""Error budget of a jump: one thing at a time, at the same place of a run, and the cycles behind.

A place is a packing of the coarse ensemble after k_i cycles, with one grain moved by a member's
1e-10 m, and 40 cycles more; the last of its windows is what a jump is fitted to.  `PARTS` are what
a jump does, each done alone; `JUMPS` are whole jumps that differ in one thing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from adapters import decks
from adapters.engine import EngineStart
from adapters.engine_liggghts import LiggghtsEngine
from adapters.errors import EngineFailed, NotConverged, NotCredible
from adapters.jump_fixed import history_gain
from adapters.procedure import CONTROL
from adapters.report_history import cost_total
from adapters.scene import Scene
from adapters.stages import Bed, Run, compute, jump, prepare
from adapters.state import State
from adapters.window import window_load
from validation.move_study_engine import cycles_of
from validation.settlement_ensemble import COARSE, STEP, Piece
from validation.settlement_ensemble_record import EnsembleRecord
from validation.settlement_ensemble_start import packing_lay
from validation.settlement_rivals import FIRST_WINDOW, K_I, STATE, Row, deck_extend, run_in

PLACE = K_I + 2 * FIRST_WINDOW
"""Cycles done where the budget is made."""
AFTER = 20
"""Cycles that are compared."""
JUMPED = 20
"""Cycles of the jump, behind which `FEW` are computed; the run without it goes as far."""
FEW = 10
EVERY, TWIN = "every cycle", "one grain 1e-10 m aside"
AT_REST = "velocity grains set 0.0 0.0 0.0 units box"
NO_SPIN = "set group grains omegax 0.0 omegay 0.0 omegaz 0.0"
PISTON_AT_REST = "velocity piston set 0.0 0.0 0.0 units box"


class WithoutSprings(LiggghtsEngine):
    """LIGGGHTS going on from positions and velocities alone: a data file, no restart file.

    Contacts have lost their tangential springs, and the piston, at its height, its velocity.
    """

    def __init__(self, before: State) -> None:
        self.before = before

    def write_cycles(
        self, scene: Scene, start: EngineStart, cycles: int, folder: Path
    ) -> dict[str, str]:
        """As the engine's, then ``grains.data`` in the place of the restart file."""
        digests = super().write_cycles(scene, start, cycles, folder)
        state, deck = self.before, folder / "in.cycles"
        assert scene.loading is not None
        text = decks.grains_data_text(
            state.position,
            state.radius,
            scene.material.grain.density,
            scene.container,
            start.piston_height,
            scene.loading.piston_mass,
        )
        motion = np.column_stack([state.identifier, state.velocity, state.spin])
        rows = [f"{int(row[0])} " + " ".join(map(repr, row[1:].tolist())) for row in motion]
        rows.append(f"{len(motion) + 1} 0 0 0 0 0 0")
        (folder / "grains.data").write_text(text + "\n".join(["", "Velocities", "", *rows, ""]))
        deck_extend(deck, "read_restart start.restart", "read_data grains.data")
        lines = deck.read_text(encoding="utf-8").replace("read_restart start.restart\n", "")
        deck.write_text(lines, encoding="utf-8")
        return digests


@dataclass(frozen=True)
class Part:
    """One thing that a jump does, done alone."""

    name: str
    settings: tuple[str, ...] = ()
    """Keys of the scene that differ."""
    lines: tuple[str, ...] = ()
    """Of the deck, before the first step."""
    fixes: tuple[str, ...] = ()
    """Of the deck, behind those of the piston."""
    perturbation: float = 0.0
    """Displacement of one grain [m]."""
    new_piston: bool = False
    """Whether the piston's mesh is a new one."""
    jump: int | None = None
    """Cycles h of a jump; None for none."""
    cycles: int = AFTER
    springs: bool = True

    def start(self, run: Run, bed: Bed) -> Bed:
        """Where the cycles behind begin."""
        if self.jump is not None:
            return jump(run, bed, self.jump, 1, history_gain(run, bed, self.jump))
        mesh = bed.start.piston_mesh + self.new_piston
        start = replace(bed.start, perturbation=self.perturbation, piston_mesh=mesh)
        return replace(bed, start=start)


UNRELAXED = 'procedure.relaxation="none"'
PARTS = (
    Part(EVERY, cycles=AFTER + FEW),
    Part(TWIN, perturbation=STEP),
    Part("half the time step", ("engine.rayleigh_share=0.1",)),
    Part("grains at rest", lines=(AT_REST, NO_SPIN)),
    Part("a new piston, at rest", lines=(PISTON_AT_REST,), new_piston=True),
    Part("springs lost, piston at rest", springs=False),
    Part("saved, resubmitted", (UNRELAXED,), jump=0),
    Part("saved, relaxed, resubmitted (h = 0)", jump=0),
    Part("jump", jump=JUMPED, cycles=FEW),
)  # fmt: skip

SAME = "jump, log law, smallest move"
"""What each of `JUMPS` differs from in one thing: the procedure's defaults."""
DRAG = 20.0
"""Force over velocity [N s/m] on grains and piston in a damped cycle: about critical for two grains
(0.4 g) in a contact of the loaded bed (1e5 N/m)."""
DAMPED_CYCLE = (
    "run ${steps_per_cycle}",
    "unfix drag",
    f"variable rest equal {FEW - 1}*${{steps_per_cycle}}",
    "variable run_steps delete",
    "variable run_steps equal ${rest}",
)
"""Lines before the first step: the first of `FEW` load cycles, with what the piston's lines add."""


def jumped(name: str, *settings: str) -> Part:
    """A jump of `JUMPED` cycles, `FEW` behind it."""
    return Part(name, settings, jump=JUMPED, cycles=FEW)


JUMPS = (
    jumped(SAME),
    jumped("relaxation: none", UNRELAXED),
    replace(
        jumped("relaxation: none, first cycle damped", UNRELAXED),
        fixes=(f"fix drag all viscous {DRAG!r}",),
        lines=DAMPED_CYCLE,
    ),
    jumped("relaxation: proximal", 'procedure.relaxation="proximal"'),
    jumped("relaxation: karrech2007", 'procedure.relaxation="karrech2007"'),
    jumped("law: linear", 'procedure.law="linear"'),
    jumped("law: karrech2007", 'procedure.law="karrech2007"'),
    jumped("law: by history", 'procedure.settlement="history"'),
    jumped("move: none", 'procedure.move="still"'),
)


def part_run(part: Part, seed: int, member: int, record: EnsembleRecord, work: Path) -> Row:
    """A part at a place: means of the cycles before it, every cycle's settlement behind it.

    ``window`` and ``settlement``: settlement since the rain [m] in the cycles of the window before
    and in those behind; ``first`` and ``state``: `STATE` of the first cycle behind and the mean;
    ``before`` that of the window; of a jump ``moved``, that where it puts the bed [m].  A part that
    the procedure gives up says why as ``refused`` and has nothing behind it.
    """
    kind = replace(COARSE, settings=(*COARSE.settings, *part.settings))
    place = run_in(work / f"place-{seed}-{member}", COARSE.scene(seed), CONTROL)
    packing_lay(place, Piece(COARSE, seed), record)
    bed = compute(place, prepare(place), K_I)
    bed = replace(bed, start=replace(bed.start, perturbation=member * STEP))
    bed = compute(place, compute(place, bed, FIRST_WINDOW), FIRST_WINDOW)
    before = cycles_of(place, bed.window, slice(None))

    lines = {"include piston.in": part.fixes, "include ${start_part}": part.lines}
    here = place.folder.path / part.name.translate(str.maketrans(" ,()=:", "------"))
    run = run_in(here, kind.scene(seed), CONTROL, lines)
    run.folder.share_start(place.folder, bed.cycle)
    if not part.springs:
        window = window_load(place.folder.path / bed.window / "states.npz")
        run.engine = WithoutSprings(window.state(-1))
    row = {
        "window": before["settlement"],
        "before": {name: float(np.mean(before[name])) for name in STATE},
        "engine": run.engine.version(),
    }
    try:
        done = compute(run, part.start(run, bed), part.cycles)
    except (EngineFailed, NotConverged, NotCredible) as error:
        if isinstance(error, EngineFailed) and error.from_outside:
            raise
        return row | jump_told(run) | {"refused": error.what.splitlines()[0]}
    after = cycles_of(run, done.window, slice(None))
    outcome = run.folder.outcome(done.window)
    assert outcome is not None
    return (
        row
        | jump_told(run)
        | {
            "cycles": [done.cycle - part.cycles, done.cycle],
            "settlement": after["settlement"],
            "first": {name: after[name][0] for name in STATE},
            "state": {name: float(np.mean(after[name])) for name in STATE},
            "cpu_s": cost_total(outcome.cost),
        }
    )


def jump_told(run: Run) -> Row:
    """Settlement since the rain where the run's jump puts the bed [m]; nothing without a jump."""
    moved = [
        one.rows[-1]["settlement"]
        for one in run.folder.outcomes()
        if one.rows and one.stage == "jump"
    ]
    return {"moved": moved[0]} if moved else {}
