"""Load cycles computed and jumped on an adopted deck, and a full run beside it.

The procedure of lengths k and h (`adapters.procedure.fixed`), without what only a bed of trackbed's
own has: a container, a piston's record, contacts.  Of a deck's walls nothing is known, so a moved
bed is not relaxed: its healing cycles bring the overlaps back.
"""

import json
import re
import shutil
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from adapters.decks.check import digest_deck, is_checked
from adapters.decks.detect import find_obstacles
from adapters.decks.engine import Adopted, format_run, run_deck
from adapters.decks.jump import jump, keep_held
from adapters.decks.record import make_state
from adapters.decks.scene import load_deck_scene
from adapters.decks.states import States, find_overlap, load_states, read_states, save_states
from adapters.engines import allow_interrupts, get_engine
from adapters.errors import EngineFailed, NotCredible, SceneError
from adapters.files import EXCHANGE, Outcome, RunFolder, explain_full_disk
from adapters.files import restart as kept
from adapters.jumps import SLOPES
from adapters.procedure import CONTROL, Progress, estimate_gain, estimate_sinking, settle_by
from adapters.procedure import run as procedure
from adapters.scene import Procedure
from trackbed.memory import refuse_more_memory
from trackbed.run_files import record_provenance, write_whole

TRIES = 3
"""Jumps tried at a place, each half as long; then cycles are computed."""
CALM = 10.0
"""Kinetic energy behind a jump and its healing over the greatest at cycle ends before it [-]: a
jump that throws the bed apart leaves thousands of times as much, a calm one about as much."""
PRESSED = 0.1
"""By how much a jump may deepen the greatest overlap of two grains, over the smaller radius [-]."""


@dataclass(frozen=True)
class DeckRun:
    """A run in progress."""

    bed: Adopted
    procedure: Procedure
    folder: RunFolder
    progress: Progress

    def states(self, stage: str) -> States:
        """What a finished stage left."""
        return load_states(self.folder.path / stage / "states.npz")


@dataclass(frozen=True)
class Place:
    """Where a run is: what the next window starts from."""

    cycle: int  # cycles done, jumped ones included
    window: str  # stage that left the states
    healing: int = 0  # first cycles of that window to keep out of the fit
    jumped: str = ""  # stage of the jump behind it; empty for none


def run_deck_scene(
    path: Path, run_path: Path, *, control: bool = False, overrides: Sequence[str] = ()
) -> None:
    """Run the scene of an adopted deck in the folder ``run_path``; with ``control`` all cycles too.

    A folder that holds the same is gone on with.  Raises `SceneError` for a deck that can not be
    cut, `EngineMissing`, `EngineFailed`, and `NotCredible` where grains can not be followed.
    """
    scene, bed = load_deck_scene(path, overrides)
    if stops := [one for one in find_obstacles(bed.deck, bed.engine) if one.kind != "note"]:
        raise SceneError(
            "this deck can not be cut:\n  " + "\n  ".join(map(str, stops)),
            where=str(bed.deck.path), remedy="change it, then: trackbed adopt DECK --check",
        )  # fmt: skip
    folder, progress, p = RunFolder(run_path), Progress(), scene.procedure
    record = scene.model_dump(mode="json")
    record["deck"]["digest"] = digest_deck(bed)
    with allow_interrupts(), explain_full_disk(run_path), folder.lock():
        if (run_path / "manifest.json").exists():
            procedure.refuse_differences(folder.manifest()["scene"], record, run_path)
            control |= folder.manifest()["control"]
        else:
            procedure.refuse_strangers(folder)
        shutil.copyfile(path, run_path / "scene.toml")
        manifest = {
            "scene": record, "overrides": [*overrides], "control": control,
            "origin": str(path.absolute()),
            "provenance": record_provenance(sys.argv),
        }  # fmt: skip
        write_whole(run_path / "manifest.json", json.dumps(manifest, indent=1) + "\n")
        with procedure.note_stop(folder):
            folder.add_event("engine", name=bed.engine, version=get_engine(bed.engine).version())
            # no piston is known here, so none is waited for
            run = DeckRun(bed, p.model_copy(update={"seating": "any"}), folder, progress)
            if not is_checked(path, bed):
                words = f"trackbed adopt {bed.deck.path} --engine {bed.engine} --check"
                progress.print_line(f"warning: never checked that windows compute its bed: {words}")
            settle(run, jumps=True)
            if control:
                progress.print_line(CONTROL)
                beside = folder.enter(CONTROL)
                beside.share_start(folder, p.k_i + p.window_cycles)
                settle(replace(run, folder=beside), jumps=False)


def settle(run: DeckRun, jumps: bool) -> None:
    """Preparation, k_i cycles, then k cycles and a jump of h until the end."""
    p, k = run.procedure, run.procedure.window_cycles
    if run.folder.outcome("preparation") is None:
        started, folder = time.process_time(), run.folder.begin("preparation")
        cost = run_deck(run.bed, format_run(run.bed, "prepare", 0), folder / "prepare.in")
        finish(run, folder, Place(0, ""), [], read_states(folder, 0, 0, run.bed), cost, started)
    place = compute(run, Place(0, "preparation"), p.k_i)
    place = compute(run, place, min(k, p.total_cycles - place.cycle))
    for number in range(p.total_cycles if jumps else 0):
        longest = p.total_cycles - place.cycle - p.healing_cycles - k
        if longest < min(p.h or (1,)):
            break
        place = jump_and_heal(run, place, min(p.jump_cycles(number), longest))
    while place.cycle < p.total_cycles:
        place = compute(run, place, min(k, p.total_cycles - place.cycle))
    run.folder.write_settlement()


def compute(run: DeckRun, place: Place, cycles: int, healing: int = 0) -> Place:
    """A window of ``cycles`` load cycles, the first ``healing`` of them not to be fitted."""
    name, bed = f"window_{place.cycle:06d}", run.bed
    outcome = run.folder.outcome(name)
    if outcome is None or outcome.last_cycle != place.cycle + cycles:
        started, start = time.process_time(), run.states(place.window)
        refuse_more_memory(
            procedure.STATE_BYTES * len(start.last) * (cycles + 1),
            f"a window of {cycles} cycles", "procedure", "shorter windows (procedure.k_i and k)",
        )  # fmt: skip
        folder, before = run.folder.begin(name), start.energy.max()
        start = write_start(run, place, start, folder)
        cost = run_deck(bed, format_run(bed, "window", cycles), folder / "window.in")
        states = read_states(folder, 1, cycles, bed, start)
        after = states.energy[healing:].max()
        if place.jumped and after > CALM * before:
            what = f"behind the jump the bed moves with {after:.3g} J, and with {before:.3g} before"
            raise NotCredible(what, where=str(folder))
        done = [{"settlement": 0.0}, *(row for o in run.folder.outcomes() for row in o.rows[-1:])]
        given = states, done[-1]["settlement"], run.states("preparation").height[0]
        rows = [make_row(c, place.cycle, healing, *given) for c in range(1, cycles + 1)]
        finish(run, folder, place, rows, states, cost, started)
    return Place(place.cycle + cycles, name, healing)


def write_start(run: DeckRun, place: Place, states: States, folder: Path) -> States:
    """Write the restart file of the last of ``states``, moved where a jump was made; that state."""
    restart, bed = bytearray((run.folder.path / place.window / "end.restart").read_bytes()), run.bed
    states = states.at(-1)
    (metre, _), move, drop = bed.deck.units, np.zeros(3), 0.0
    if place.jumped:
        with np.load(run.folder.path / place.jumped / "moved.npz") as data:
            move, drop = data["move"], float(data["drop"])
        number, shift = states.identifier, move / metre
        if bed.deck.is_script:
            np.savez(folder / "moved.npz", identifier=number, move=move, drop=drop)
        elif bed.stones:
            kept.move_stones(restart, bed.stones, number, shift)
        else:
            x, v = states.last[:, 1:4], states.last[:, 4:]
            kept.move_grains(restart, number, x, v, shift, states.period)
        if bed.loaded and not bed.deck.is_script:
            for height in kept.find_mesh(restart, *bed.loaded):
                height -= drop / metre
    (folder / "cycle_0.restart").write_bytes(restart)
    return replace(states, position=states.position + move, height=states.height - drop)


def jump_and_heal(run: DeckRun, place: Place, h: int) -> Place:
    """A jump of ``h`` cycles and the window behind it; what fails is tried again half as long."""
    p = run.procedure
    for attempt in range(1, TRIES + 1):
        name = f"jump_{place.cycle:06d}_{attempt}"
        if not run.folder.failure(name):
            try:
                jumped = jump_bed(run, place, h, name)
                return compute(run, jumped, p.healing_cycles + p.window_cycles, p.healing_cycles)
            except (EngineFailed, NotCredible) as error:
                if isinstance(error, EngineFailed) and error.from_outside:
                    raise
                run.folder.give_up(name, str(error))
                run.progress.print_line(f"the jump of {h} cycles failed: {error}")
        h = max(h // 2, 1)
    run.progress.print_line("no jump from here: computing on")
    return compute(run, place, p.window_cycles)


def jump_bed(run: DeckRun, place: Place, h: int, name: str) -> Place:
    """Find where the bed will be ``h`` cycles on; the engine places it there in the next window."""
    outcome = run.folder.outcome(name)
    if outcome is None or outcome.last_cycle != place.cycle + h:
        started, p, states = time.process_time(), run.procedure, run.states(place.window)
        folder = run.folder.begin(name)
        before = make_state(states, -1, place.cycle)
        seen = states.position[place.healing :, np.isin(states.identifier, before.identifier)]
        first = place.cycle + 1 - len(seen)
        target = jump(seen, h, before.radius, law=p.law, move=p.move, first_cycle=first)
        # what forecasts ask of a run
        like: Any = SimpleNamespace(procedure=p, folder=run.folder, first_cycle=0)
        at: Any = place
        if p.settlement == "history":
            gain = estimate_gain(like, at, h, run.folder.outcomes(), SLOPES)
            target = keep_held(seen, settle_by(gain, before, target))
        pressed = [find_overlap(x, before.radius) for x in (seen[-1], target)]
        if not run.bed.stones and pressed[1] > pressed[0] + PRESSED:
            what = f"it presses grains into one another by {pressed[1]:.3g} of the smaller radius"
            raise NotCredible(what, where=str(folder))
        drop = estimate_sinking(like, at, h) if run.bed.loaded else 0.0
        np.savez(folder / "moved.npz", move=target - seen[-1], drop=drop)
        row = run.folder.outcomes()[-1].rows[-1] | {"cycle": place.cycle + h, "kind": "jumped"}
        row |= dict.fromkeys(EXCHANGE)  # in jumped cycles nobody saw what broke
        row["settlement"] -= float((target - seen[-1])[:, 2].mean())
        for key, sign in (("piston_height", -1), ("loaded_body", 1)):
            row[key] = None if row[key] is None else row[key] + sign * drop
        cost = {"engine": 0.0, "other": time.process_time() - started}
        run.folder.finish(folder, Outcome("jump", place.cycle, place.cycle + h, [row], cost))
    return Place(place.cycle + h, place.window, place.healing, name)


def make_row(
    c: int, start: int, healing: int, states: States, sunk: float, first: float
) -> dict[str, Any]:
    """The row of ``settlement.csv`` at the end of cycle ``c`` of a window from cycle ``start`` on.

    ``first``: height of the loaded body behind the preparation [m]; None where there is none.
    ``sunk``: settlement of the mean grain before the window [m]; grains there all through it count.
    """
    height, z = float(states.height[c]), states.position[:, :, 2]
    loaded = np.isfinite(height)
    return {
        "cycle": start + c, "kind": "healing" if c <= healing else "computed",
        "settlement": sunk + float((z[0] - z[c])[np.isfinite(z).all(axis=0)].mean()),
        "loaded_body": float(first) - height if loaded else None,
        "piston_height": height if loaded else None, "coordination_number": None,
        "elastic_deflection": None, "kinetic_translational": float(states.energy[c]),
        **dict(zip(EXCHANGE, states.exchange[c - 1].tolist(), strict=True)),
    }  # fmt: skip


def finish(
    run: DeckRun, folder: Path, place: Place, rows: list[dict[str, Any]], states: States,
    engine_s: float, started: float,
) -> None:  # fmt: skip
    """Keep the states and the last restart file of a stage, and say how far the run is."""
    save_states(states, folder / "states.npz")
    (folder / f"cycle_{len(rows)}.restart").rename(folder / "end.restart")
    for one in folder.glob("cycle_*"):
        if re.fullmatch(r"cycle_\d+\.(restart|dump|npz)", one.name):  # else it is the deck's own
            one.unlink()
    cost = {"engine": engine_s, "other": time.process_time() - started}
    stage, last = folder.name.partition("_")[0], place.cycle + len(rows)
    run.folder.finish(folder, Outcome(stage, place.cycle, last, rows, cost))
    said = "the bed before its first cycle"
    for row in rows[-1:]:
        mean, body = 1e6 * row["settlement"], row["loaded_body"]
        said = f"cycle {row['cycle']}, settlement of the mean grain {mean:.2f} um"
        said += "" if body is None else f", of the loaded body {1e6 * body:.2f} um"
    run.progress.print_line(f"{folder.name}: {said}")


def resume_deck(path: Path) -> None:
    """Go on with the run of a deck from the scene that it was started with."""
    manifest = RunFolder(path).manifest()
    scene = Path(manifest.get("origin", path / "scene.toml"))
    run_deck_scene(scene, path, overrides=manifest["overrides"])
