"""What the adapter costs: an engine window through it, beside the same deck run by hand."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from pathlib import Path
from statistics import median

from adapters.checks import check_window
from adapters.engine import EngineStart, engine_named, python_cpu_s
from adapters.errors import EngineMissing
from adapters.procedure import run_scene
from adapters.progress import Progress
from adapters.run_folder import RunFolder
from adapters.scene_file import scene_load
from adapters.state import state_load
from adapters.window import window_read, window_save
from scenes import scene_path
from validation.case import Check

ENGINES = ("liggghts", "lammps")
REPEATS = 5
CYCLES = {True: 2, False: 10}


def run(quick: bool) -> list[Check]:
    """The checks of every engine that is here; raises `EngineMissing` when none is."""
    found, missing = [], None
    for name in ENGINES:
        try:
            engine_named(name).version()
            found.append(name)
        except EngineMissing as error:
            missing = error
    if not found and missing is not None:
        raise missing
    return [check for name in found for check in engine_checks(name, quick)]


def engine_checks(engine_name: str, quick: bool) -> list[Check]:
    """Alternate by hand and through the adapter on one start state; medians of CPU time."""
    name = scene_path("karrech-coarse" if quick else "karrech")
    with tempfile.TemporaryDirectory() as temporary:
        home = Path(temporary)
        overrides = ["procedure.k_i=1", "procedure.total_cycles=2"]
        overrides.append(f'engine.name="{engine_name}"')
        scene = scene_load(name, overrides)
        run_scene(name, home / "run", overrides=overrides, progress=Progress(quiet=True))
        folder = RunFolder(home / "run")
        outcome = folder.outcome("window_000001")
        assert outcome is not None
        piston = outcome.notes["piston_height"]
        start = EngineStart(
            home / "run" / "window_000001" / "end.restart", outcome.notes["time_step"], 0, piston
        )
        engine, by_hand, through, python = engine_named(engine_name), [], [], []
        cycles = CYCLES[quick]
        for number in range(REPEATS):
            work = home / f"work_{number}"
            work.mkdir()
            decks = engine.write_cycles(scene, start, cycles, work)
            hand = home / f"hand_{number}"
            shutil.copytree(work, hand)
            by_hand.append(_cpu_by_hand(engine.command(scene, "in.cycles"), hand))
            before = python_cpu_s()
            done = engine.run(scene, "in.cycles", work, lambda: None, decks)
            window = window_read(work, 2, engine.wall_names(scene, piston=True), piston)
            check_window(scene, window, cycles)
            window_save(window, work / "states.npz")
            through.append(done.cpu_s)
            python.append(python_cpu_s() - before)
        grains = len(state_load(home / "run" / "preparation" / "state.npz").radius)
    speed = median(by_hand) / median(through)
    share = median(python) / median(through)
    steps = grains * scene.steps_per_cycle * cycles
    return [
        Check(
            f"{engine_name}: speed through the adapter over by hand",
            speed,
            ">= 0.95",
            speed >= 0.95,
        ),
        Check(
            f"{engine_name}: Python's CPU time over the engine's", share, "<= 0.05", share <= 0.05
        ),
        Check(
            f"{engine_name}: grain-steps a CPU second", steps / median(through), "> 0", True, "1/s"
        ),
    ]


def _cpu_by_hand(command: list[str], folder: Path) -> float:
    """CPU time of a command and its children, user and system [s]."""
    before = os.times()
    with (folder / "screen.txt").open("wb") as screen:
        subprocess.run(command, cwd=folder, stdout=screen, stderr=screen, check=True)
    after = os.times()
    return (
        after.children_user + after.children_system - before.children_user - before.children_system
    )
