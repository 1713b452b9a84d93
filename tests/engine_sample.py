"""One tiny run on each engine, and what its processes wrote, for all tests that judge engines.

Before every command of an engine stands a launcher: it does what ``fault.sh``, three folders up,
beside the run folder, says, or just runs the engine.  Tests put their faults there.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from adapters.bed.state import FloatArray, State
from adapters.engines.contract import (
    Engine,
    EngineRun,
    EngineStart,
    get_engine,
    list_engines,
    list_real_engines,
)
from adapters.engines.fake import FakeEngine
from adapters.files.run_folder import RunFolder
from adapters.files.window import Window, load_window, read_window
from adapters.procedure.progress import Progress
from adapters.procedure.run import run_scene
from adapters.scene.file import load_scene
from adapters.scene.tables import Scene
from trackbed.scenes import read_template

REAL = [pytest.param(name, marks=pytest.mark.engine(name)) for name in list_real_engines()]
"""Engines with mechanics, and with a process to kill."""
ENGINES = [*REAL, *(name for name in list_engines() if name not in list_real_engines())]

QUIET = Progress(quiet=True)
TINY = (
    "sample.radius=0.018",
    "sample.count=40",
    "material.grain.young=2e8",
    "loading.piston_mass=0.001",
    "procedure.k_i=2",
    "procedure.k=3",
    "procedure.h=2",
    "procedure.healing_cycles=1",
    "procedure.total_cycles=11",
)
"""Forty soft grains, about 2,500 steps a cycle, one jump from cycle 5 to 7."""
FIRST, SECOND, JUMP, AFTER = "window_000000", "window_000002", "jump_000005_1", "window_000007"

FAULT = "fault.sh"
LAUNCHER = ("sh", "-c", f'f=../../../{FAULT}; if test -e $f; then . $f; else exec "$@"; fi', "sh")
RECORD = """
"$@"; code=$?; raw=../../../raw/$(basename "$PWD"); mkdir -p $raw
cp -r . $raw; mv $raw/screen.txt $raw.said; exit $code
"""
"""Keeps what an engine's process left, before it is read and cleared away."""

Damage = Callable[[Path], None]
"""Does something to the files of a stage, when the engine's process is through."""


def window_of(run: Path, stage: str) -> Window:
    """A window of a run."""
    return load_window(run / stage / "states.npz")


def start_of(run: Path, stage: str) -> EngineStart:
    """The start of a window that goes on from a finished one."""
    outcome = RunFolder(run).outcome(stage)
    assert outcome is not None
    notes = outcome.notes
    return EngineStart(
        run / stage / "end.restart",
        notes["time_step"],
        notes["piston_mesh"],
        notes["piston_height"],
    )


def at_rest(state: State, position: FloatArray | None = None) -> State:
    """The bed without velocities, put to other places [m] where they are given."""
    still = np.zeros_like(state.position)
    place = state.position if position is None else position
    return state.move_to(place, velocity=still, spin=still)


class Sample:
    """A finished run of the tiny scene on one engine, in ``folder``/run; made when not there."""

    def __init__(self, name: str, folder: Path) -> None:
        self.name, self.file, self.run = name, folder / "scene.toml", folder / "run"
        self.raw = folder / "raw"
        self.overrides = (
            *TINY, f'engine.name="{name}"', f"engine.launcher={json.dumps(LAUNCHER)}"
        )  # fmt: skip
        self.engine: Engine = get_engine(name)
        if not (folder / "done").exists():
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
            self.file.write_text(read_template("karrech-coarse"))
            (folder / FAULT).write_text(RECORD)
            run_scene(self.file, self.run, overrides=self.overrides, progress=QUIET)
            (folder / FAULT).unlink()
            (folder / "done").touch()
        self.scene: Scene = load_scene(self.file, self.overrides)

    def need_process(self) -> None:
        """Go on only with an engine that has mechanics and a process."""
        if self.name == "fake":
            pytest.skip("the fake engine has no mechanics and no process")

    @property
    def table(self) -> bytes:
        return (self.run / "settlement.csv").read_bytes()

    def words(self, run: Path) -> tuple[str, ...]:
        """Of the command that starts a run, or goes on with it."""
        if (run / "manifest.json").exists():
            return ("resume", str(run))
        overrides = [word for override in self.overrides for word in ("--set", override)]
        return ("run", str(self.file), "--run-folder", str(run), *overrides)

    def copy(self, folder: Path, *without: str) -> Path:
        """The run, less some stages."""
        shutil.copytree(self.run, folder, ignore=shutil.ignore_patterns(*without))
        return folder

    def window(self, stage: str) -> Window:
        return window_of(self.run, stage)

    def start(self, stage: str) -> EngineStart:
        """That of a window that goes on from a finished one."""
        return start_of(self.run, stage)

    def computed(
        self, start: EngineStart, cycles: int, folder: Path, *,
        scene: Scene | None = None, single_steps: int = 0, every: int = 1,
    ) -> Window:  # fmt: skip
        """A window computed outside any run folder, of another scene where one is given.

        On LIGGGHTS and LAMMPS also ``single_steps`` instead of cycles, a frame ``every`` so many.
        """
        scene = scene or self.scene
        folder.mkdir()
        digests = self.engine.write_cycles(scene, start, cycles, folder)
        if single_steps:
            change = {"steps_per_cycle": every, "track_steps": every, "run_steps": single_steps}
            lines = (folder / "parameters.in").read_text().splitlines()
            kept = [line for line in lines if line.split()[1] not in change]
            kept += [f"variable {name} index {value}" for name, value in change.items()]
            (folder / "parameters.in").write_text("\n".join(kept) + "\n")
        done = self.engine.run(scene, "in.cycles", folder, lambda: None, digests)
        assert done.decks == digests
        assert done.cpu_s >= 0
        assert 0 <= done.start_up_s <= max(done.wall_s, done.start_up_s)
        names = self.engine.wall_names(scene, piston=True)
        return read_window(folder, 0, names, start.piston_height)

    # --- faults -----------------------------------------------------------------------------

    def fault(self, run: Path, script: str) -> None:
        """Have the engine's processes in ``run`` do what a shell script says; its $@ is theirs."""
        (run.parent / FAULT).write_text(script + "\n")

    def replayed(
        self, run: Path, damage: Damage = lambda folder: None, *stages: str, but: str = "none"
    ) -> None:
        """Leave, in place of the engine's work, what it left in the sample; damaged in stages.

        The same start gives the same files, so nothing is computed twice ``but`` one stage.
        """
        copies = run.parent / "raw"
        shutil.rmtree(copies, ignore_errors=True)
        for stage in stages if self.raw.exists() else ():  # the fake one has no process
            shutil.copytree(self.raw / stage, copies / stage)
            damage(copies / stage)
        script = f"""
            n=$(basename "$PWD"); if test $n = {but}; then exec "$@"; fi
            from={copies}/$n; test -d $from || from={self.raw}/$n
            cp -r $from/. .; cat {self.raw}/$n.said
        """
        self.fault(run, script)


def fake_damaged(monkeypatch: pytest.MonkeyPatch, damage: Damage, *stages: str) -> None:
    """Damage what the engine without a process writes in some stages."""
    real = FakeEngine.run

    def run(self: FakeEngine, scene: Scene, deck: str, folder: Path, *rest: object) -> EngineRun:
        done = real(self, scene, deck, folder, *rest)  # type: ignore[arg-type]
        if folder.name in stages:
            damage(folder)
        return done

    monkeypatch.setattr(FakeEngine, "run", run)
