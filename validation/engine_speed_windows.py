"""What trackbed adds to an engine: a window of load cycles through it, beside the engine alone.

The window goes on from the settled bed of `validation.engine_speed_bed`, with the piston on its
highest grain: as the load begins at zero, no seating is needed.
"""

from __future__ import annotations

import json
import re
import shutil
from dataclasses import dataclass
from pathlib import Path

from adapters.checks import check_window
from adapters.engine import Engine, EngineStart, engine_named, python_cpu_s
from adapters.engine_yade import PARAMETERS
from adapters.scene import Scene
from adapters.state import FloatArray
from adapters.window import window_read, window_save
from validation.engine_speed_bare import cycles_bare

LOADING = """
[loading]
waveform = "sine"
amplitude = 14150.0
mean = 7075.0
frequency = 50.0
piston_mass = 0.1
"""
"""The paper's load."""

LOOP = re.compile(r"^Loop time of (\S+) on", re.MULTILINE)
OUTPUT = re.compile(r"^Outp(?:t time \(%\) =|ut\s+\|)\s*(\S+)", re.MULTILINE)
"""Elapsed seconds of a run's steps and of their output, LIGGGHTS' and LAMMPS' words."""


@dataclass(frozen=True)
class WindowCost:
    """CPU time [s] of one window, user and system."""

    alone: float
    """Of the engine alone, by hand: no record, no frames."""
    engine: float
    """Of the engine under trackbed."""
    python: float
    """Of trackbed itself: input written, output read, checked and kept."""
    output: float | None
    """Of the engine under trackbed, what it tells itself that writing took; YADE does not."""

    @property
    def through(self) -> float:
        """Of everything that a user of trackbed waits for."""
        return self.engine + self.python


def start_at_rest(
    scene: Scene, position: FloatArray, radius: FloatArray, folder: Path
) -> EngineStart:
    """A saved state of the scene's engine: the bed after a single look at its energies.

    Centres [m], shape (n, 3), radii [m], shape (n,).  Raises as `Engine.run`.
    """
    engine = engine_named(scene.engine.name)
    folder.mkdir(parents=True)
    top = float((position[:, 2] + radius).max())
    digests = engine.write_preparation(scene, position, radius, top, folder)
    steps = scene.steps_per_cycle
    look_once(folder, check_steps=steps, minimum_steps=steps, history_steps=steps)
    engine.run(scene, "in.prepare", folder, lambda: None, digests)
    return EngineStart(folder / "end.restart", steps, 0, top)


def look_once(folder: Path, **settle: float) -> None:
    """Have the preparation in ``folder`` end at its first look, whatever still moves there."""
    settle["equilibrium_ratio"] = 1e300
    if (folder / PARAMETERS).exists():
        content = json.loads((folder / PARAMETERS).read_text())
        content["settle"] |= settle
        (folder / PARAMETERS).write_text(json.dumps(content))
        return
    text = (folder / "parameters.in").read_text()
    for name, value in settle.items():
        text = re.sub(
            rf"^variable {name} index .*$", f"variable {name} index {value:g}", text, flags=re.M
        )
    (folder / "parameters.in").write_text(text)


def window_cost(scene: Scene, start: EngineStart, cycles: int, folder: Path) -> WindowCost:
    """Run the same window of ``cycles`` both ways, in two folders inside ``folder``."""
    engine: Engine = engine_named(scene.engine.name)
    hand, through = folder / "hand", folder / "through"
    through.mkdir(parents=True)
    before = python_cpu_s()
    decks = engine.write_cycles(scene, start, cycles, through)
    python = python_cpu_s() - before
    shutil.copytree(through, hand)
    alone = cycles_bare(engine, scene, hand)
    before = python_cpu_s()
    done = engine.run(scene, "in.cycles", through, lambda: None, decks)
    window = window_read(through, 0, engine.wall_names(scene, piston=True), start.piston_height)
    check_window(scene, window, cycles)
    window_save(window, through / "states.npz")
    python += python_cpu_s() - before
    share = output_share("".join(path.read_text() for path in through.glob("log.*")))
    return WindowCost(alone, done.cpu_s, python, None if share is None else share * done.cpu_s)


def output_share(log: str) -> float | None:
    """Part of the time of all steps that an engine wrote output, by the timers in its log."""
    steps = [float(text) for text in LOOP.findall(log)]
    return sum(float(text) for text in OUTPUT.findall(log)) / sum(steps) if steps else None
