"""The three stages of a run: rain of grains, a window of load cycles, a jump.

Each is done once: a finished stage is read back, an unfinished one is done again from its start.
"""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from adapters.bed import (
    SURFACE_SHARE,
    FloatArray,
    State,
    find_top_under,
    load_state,
    measure_bed,
    measure_bed_height,
    measure_relative_density,
    measure_sample,
    save_state,
)
from adapters.bed.stones import (
    find_kinetic_energies,
    find_rotation,
    find_touching,
    spread_spheres,
)
from adapters.engines import Engine, EngineRun, EngineStart
from adapters.files import (
    Outcome,
    RunFolder,
    Window,
    load_window,
    read_state,
    read_window,
    save_window,
)
from adapters.laws import get_law
from adapters.moves import Jump, get_move
from adapters.procedure import checks
from adapters.procedure.progress import Progress
from adapters.procedure.room import find_room
from adapters.scene import Procedure, Scene, bound_friction, draw_start


@dataclass(frozen=True)
class Variant:
    """Which of the runs of a scene this is."""

    name: str = "procedure"
    jumps: bool = True  # false computes every cycle: the control
    perturbation: float = 0.0
    """Displacement [m] of one grain after the first k_i cycles: how far two equal runs part."""


class Gains(NamedTuple):
    """Settlement over a jump [m]."""

    mean_grain: float
    loaded_body: float


class Clock:
    """CPU time of this process by purpose, from one finished stage to the next."""

    def __init__(self, start_s: float | None = None) -> None:
        """Count from ``start_s`` of this process's CPU time [s]; 0 counts Python's start-up too."""
        self._start = time.process_time() if start_s is None else start_s
        self._parts: dict[str, float] = {}

    @contextmanager
    def time_part(self, name: str) -> Iterator[None]:
        """Count the CPU time of a block under ``name`` [s]."""
        start = time.process_time()
        try:
            yield
        finally:
            self._parts[name] = self._parts.get(name, 0.0) + time.process_time() - start

    def end_lap(self, engine_s: float = 0.0, start_up_s: float = 0.0) -> dict[str, float]:
        """Costs since the last lap [s], the engine's and its start-up's among them."""
        now = time.process_time()
        other = now - self._start - sum(self._parts.values())
        cost = {"engine": engine_s, "start_up": start_up_s, **self._parts, "other": other}
        self._start, self._parts = now, {}
        return cost


@dataclass
class Run:
    """A run in progress: what to do, where, with what."""

    scene: Scene
    folder: RunFolder
    engine: Engine
    variant: Variant
    progress: Progress
    cycle_by_cycle: bool = False
    """Where no jump is allowed: True computes every cycle, False refuses."""
    clock: Clock = field(default_factory=Clock)
    first_cycle: int = 0  # cycles done before the stage of the load that ``scene`` has
    computed_here: int = 0
    loaded_start: float = np.nan  # height of the loaded body before the first cycle [m]
    start_orientation: FloatArray | None = None
    """Of stones, before the first cycle, shape (n, 4): rotations count from there."""
    computed_before: int | None = None
    """Cycles that earlier processes computed; None before they are counted."""

    @property
    def procedure(self) -> Procedure:
        """How a loaded scene is gone through; only such a run goes beyond its preparation."""
        assert self.scene.procedure is not None
        return self.scene.procedure

    def outcome(self, stage: str) -> Outcome:
        """The record of a stage that is finished."""
        found = self.folder.outcome(stage)
        assert found is not None
        return found


@dataclass(frozen=True)
class Bed:
    """Where a run is: the saved state the next window starts from."""

    cycle: int  # cycles done, jumped ones included
    start: EngineStart
    window: str = ""  # name of the stage with the last computed window
    healing: int = 0  # first cycles of that window to keep out of the fit


def prepare(run: Run) -> Bed:
    """Rain of grains under gravity until equilibrium (section 2.3)."""
    scene, name = run.scene, "preparation"
    if run.folder.outcome(name) is None:
        run.progress.print_line(f"rain of {scene.grain_count} grains")
        position, radius, height = draw_start(scene)
        folder = _begin(run, name)
        rain = bound_friction(scene)
        decks = run.engine.write_preparation(rain, position, radius, height, folder)
        done = run.engine.run(scene, "in.prepare", folder, lambda: None, decks)
        with run.clock.time_part("parse"):
            state = read_state(folder, run.engine.wall_names(scene, piston=False), scene.form)
            checks.check_state(scene, state)
            save_state(state, folder / "state.npz")
        bed = measure_bed_height(state.position, state.radius)
        notes = {
            "figures": asdict(measure_sample(state, scene.container)),
            "density_height": SURFACE_SHARE * bed,
            "mean_height": float(state.position[:, 2].mean()),
            "time_step": state.time_step,
            **_make_run_notes(done),
        }
        cost = run.clock.end_lap(done.cpu_s, done.start_up_s)
        _finish(run, folder, Outcome(name, 0, 0, [], cost, notes=notes))
    state = load_state(run.folder.path / name / "state.npz")
    spheres, edges = spread_spheres(scene.form, state), scene.piston_edges
    run.loaded_start = top = find_top_under(*spheres, edges, scene.piston_reach)
    run.start_orientation = state.orientation
    restart = run.folder.path / name / "end.restart"
    return Bed(0, EngineStart(restart, state.time_step, 0, top, first=True))


def compute(run: Run, bed: Bed, cycles: int, healing: int = 0) -> Bed:
    """A window of ``cycles`` load cycles, fresh process; the first ``healing`` are not fitted."""
    name = f"window_{bed.cycle:06d}"
    outcome = run.folder.outcome(name)
    if outcome is None or outcome.last_cycle != bed.cycle + cycles:
        folder = _begin(run, name)
        decks = run.engine.write_cycles(run.scene, bed.start, cycles, folder)
        done = run.engine.run(run.scene, "in.cycles", folder, _watch(run, bed, folder), decks)
        with run.clock.time_part("parse"):
            walls = run.engine.wall_names(run.scene, piston=True)
            window = read_window(folder, bed.cycle, walls, bed.start.piston_height, run.scene.form)
            figures = checks.check_window(run.scene, window, cycles)
            save_window(window, folder / "states.npz")
            for text in ("states.dump", "contacts.dump"):
                (folder / text).unlink()
            rows = make_settlement_rows(run, window, healing)
        notes = {
            "time_step": int(window.time_step[-1]),
            "piston_mesh": bed.start.piston_mesh,
            "piston_height": float(window.piston.height[-1]),
            **_make_run_notes(done),
        }
        cost = run.clock.end_lap(done.cpu_s, done.start_up_s)
        run.computed_here += cycles
        outcome = Outcome(
            "window", bed.cycle, bed.cycle + cycles, rows, cost, checks=figures, notes=notes
        )
        _finish(run, folder, outcome)
    kept = (outcome.notes[one] for one in ("time_step", "piston_mesh", "piston_height"))
    start = EngineStart(run.folder.path / name / "end.restart", *kept)
    return Bed(outcome.last_cycle, start, name, healing)


def jump(
    run: Run, bed: Bed, h: int, attempt: int, gains: Gains | None = None, share: float = 1.0
) -> Bed:
    """Estimate the bed ``h`` cycles on (eqs 16, 17), relax it (eq. 29), hand it back at rest.

    ``gains``: what it settles by where that is not to be the scene's law's; the bed is moved by a
    ``share`` of what is estimated then.
    """
    name = f"jump_{bed.cycle:06d}_{attempt}"
    folder = run.folder.path / name
    outcome = run.folder.outcome(name)
    if outcome is None or outcome.last_cycle != bed.cycle + h:
        folder = _begin(run, name)
        with run.clock.time_part("parse"):
            window = load_window(run.folder.path / bed.window / "states.npz")
        before, target, piston_height = estimate(run, window, bed.healing, h)
        if gains is None:
            height = window.position[bed.healing :, :, 2]
            checks.check_rise(run.scene, height, (target - before.position)[:, 2])
        else:
            target = settle_by(gains.mean_grain, before, target)
            target = before.position + share * (target - before.position)
            if get_move(run.procedure.move).moves_piston:
                piston_height = before.piston_height - share * gains.loaded_body
        with run.clock.time_part("relax"):
            moved, record, piston_height = find_room(
                run.scene, before, target, piston_height, may_wait=gains is not None
            )
        after = moved.move_to(
            moved.position, velocity=np.zeros_like(target), spin=np.zeros_like(target),
            piston_height=piston_height, cycle=bed.cycle + h,
        )  # fmt: skip
        save_state(before.move_to(target), folder / "estimated.npz")
        save_state(after, folder / "relaxed.npz")
        notes = {"h": h, "attempt": attempt, "relaxation": record}
        if gains is not None:
            asked = gains.mean_grain
            notes |= {"gain": share * asked, "asked": asked, "sinking": share * gains.loaded_body}
        rows = [_make_row(run, after, "jumped")] if h else []
        cost = run.clock.end_lap()
        folder = _finish(
            run, folder, Outcome("jump", bed.cycle, bed.cycle + h, rows, cost, notes=notes)
        )
    moved = load_state(folder / "relaxed.npz")
    start = EngineStart(
        bed.start.restart, bed.start.time_step, bed.start.piston_mesh + 1, moved.piston_height,
        moved=moved,
    )  # fmt: skip
    return Bed(bed.cycle + h, start, bed.window, bed.healing)


def estimate(run: Run, window: Window, healing: int, h: int) -> tuple[State, FloatArray, float]:
    """State before a jump, estimated positions after it (n, 3) and the piston's height, in metres.

    The grains move as ``procedure.move`` says, by a window without its ``healing`` first cycles.
    The piston follows the law of its own heights, so that a loose grain cannot lift it; it is
    never placed above where it is.
    """
    procedure = run.procedure
    with run.clock.time_part("fit"):
        law, move = get_law(procedure.law), get_move(procedure.move)
        cycle = window.cycle[healing:].astype(float)
        position, container = window.position[healing:], run.scene.container
        field_ = move.displacement(Jump(cycle, position, window.radius, law, h, container))
        heights = window.piston_heights()[healing:]
        parameters = law.fit(cycle[law.first_state :], heights[law.first_state :])
        drop = float(law.increment(parameters, cycle[-1], cycle[-1] + h))
        drop = min(drop, 0.0) if h and move.moves_piston else 0.0
    before = window.state(-1)
    return before, before.position + field_, before.piston_height + drop


def settle_by(gain: float, before: State, target: FloatArray) -> FloatArray:
    """Estimated positions (n, 3) whose mean grain has settled by ``gain``, in m.

    The rest is a uniform vertical strain, zero at the lowest grain.
    """
    rest = before.position[:, 2].mean() - target[:, 2].mean() - gain
    height = before.position[:, 2] - before.position[:, 2].min()
    mean = float(height.mean()) or 1.0
    target = target.copy()
    target[:, 2] += rest * height / mean if height.any() else rest
    return target


def make_settlement_rows(run: Run, window: Window, healing: int) -> list[dict[str, Any]]:
    """One row of ``settlement.csv`` for each cycle of a window."""
    steps = run.scene.steps_per_cycle
    errors = window.piston.force_error(steps)
    deflections, stiffness = (
        window.piston.elastic_deflection(steps), window.piston.stiffness(steps)
    )  # fmt: skip
    whole = 2 ** len(run.scene.sample.symmetry)  # of a quarter, say, that the scene computes
    rows = []
    for c in range(1, len(window) + 1):
        row = _make_row(run, window.state(c), "healing" if c <= healing else "computed")
        row["elastic_deflection"] = float(deflections[c - 1])
        row["stiffness"] = whole * float(stiffness[c - 1]) if stiffness[c - 1] > 0 else None
        row["force_error"] = float(errors[c - 1])
        rows.append(row)
    return rows


def _make_row(run: Run, state: State, kind: str) -> dict[str, Any]:
    preparation, walls = run.outcome("preparation"), run.scene.walls(state.piston_height)
    start, end = run.start_orientation, state.orientation
    bed = measure_bed(state.position, find_touching(run.scene.form, state, walls))
    translational, rotational = find_kinetic_energies(run.scene.form, state)
    return {
        "cycle": state.cycle,
        "loaded_body": run.loaded_start - state.piston_height,
        "settlement": preparation.notes["mean_height"] - float(state.position[:, 2].mean()),
        "kind": kind,
        "coordination_number": bed.coordination_number,
        "relative_density": measure_relative_density(
            state.position, state.radius, run.scene.container, preparation.notes["density_height"]
        ),
        "piston_height": state.piston_height,
        "maximum_overlap": bed.max_penetration,
        "kinetic_translational": translational,
        "kinetic_rotational": rotational,
        "mean_rotation": None
        if start is None or end is None
        else float(np.linalg.norm(find_rotation(start, end), axis=1).mean()),
    }


def _make_run_notes(done: EngineRun) -> dict[str, Any]:
    return {"command": done.command, "wall_s": done.wall_s, "decks": done.decks}


def _begin(run: Run, name: str) -> Path:
    if (run.folder.path / name).exists():
        why = "damaged" if run.folder.outcome(name) is None else "of another length"
        run.progress.print_line(f"{name} is {why}: it is computed again, the old is in discarded/")
    return run.folder.begin(name)


def _finish(run: Run, folder: Path, outcome: Outcome) -> Path:
    place = run.folder.finish(folder, outcome)
    run.folder.add_event(
        "finished", stage=folder.name, cycles=[outcome.first_cycle, outcome.last_cycle]
    )
    if outcome.rows:
        row = outcome.rows[-1]
        run.progress.print_line(
            f"{folder.name}: cycle {row['cycle']}, settlement of the loaded body "
            f"{1e6 * row['loaded_body']:.2f} um, of the mean grain {1e6 * row['settlement']:.2f} um"
        )
    return place


def _watch(run: Run, bed: Bed, folder: Path) -> Callable[[], None]:
    """A function that shows progress from what the engine has written so far."""
    procedure = run.procedure
    outcomes = run.folder.outcomes()
    if run.computed_before is None:
        windows = (o for o in outcomes if o.stage == "window")
        run.computed_before = sum(o.last_cycle - o.first_cycle for o in windows)
    computed = run.computed_before + run.computed_here
    last = next((o.rows[-1] for o in reversed(outcomes) if o.rows), None)
    sunk = None if last is None else run.loaded_start - last["piston_height"]

    def watch() -> None:
        here = run.engine.cycles_done(run.scene, bed.start, folder)
        run.progress.show_cycles(
            done=bed.cycle + here, total=procedure.total_cycles, computed=computed + here,
            settlement=sunk, computed_here=run.computed_here + here,
            to_compute=count_cycles_to_compute(run, bed.cycle + here),
        )  # fmt: skip

    return watch


def count_cycles_to_compute(run: Run, cycle: int) -> int:
    """Cycles still to be computed from ``cycle`` on, as an estimate for the time left."""
    procedure = run.procedure
    left = procedure.total_cycles - cycle
    if not run.variant.jumps:
        return left
    block = procedure.window_cycles + procedure.healing_cycles
    if procedure.h is None:
        jumps = [o.last_cycle - o.first_cycle for o in run.folder.outcomes() if o.stage == "jump"]
        return round(left * block / (block + (jumps[-1] if jumps else 0)))
    return round(left * block / (block + procedure.h[-1]))
