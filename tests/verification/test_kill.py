"""Killed, interrupted or written to by two at any moment: a run ends with the same table."""

from __future__ import annotations

import os
import random
import shutil
import signal
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from adapters.engines import process as engine_process
from adapters.engines.process import run_process
from adapters.files.run_folder import RunFolder
from tests.forked_commands import Commands, alive, awaited, comes_true, gone
from tests.small_bed import small_bed
from trackbed import command

SEED = 2007
SLOW = 0.04  # seconds that each part of a slow run sleeps before and behind its work

PARTS = ("preparation", "window", "jump", "relaxation")

SCENE = small_bed(k=2, h=2, total_cycles=14)


@pytest.fixture(scope="module")
def commands(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Commands]:
    """A server that has run the scene once, uninterrupted, in ``whole``."""
    folder = tmp_path_factory.mktemp("kill")
    (folder / "scene.toml").write_text(SCENE)
    server = Commands(folder)
    server.run("run", folder / "scene.toml", "--run-folder", folder / "whole", here=True)
    yield server
    server.close()


@pytest.fixture
def whole(commands: Commands) -> bytes:
    """The settlement table of the uninterrupted run."""
    table = (commands.folder / "whole" / "settlement.csv").read_bytes()
    assert table.count(b"jumped") == 2
    assert table.splitlines()[-1].startswith(b"14,")
    return table


def table(run: Path) -> bytes:
    path = run / "settlement.csv"
    return path.read_bytes() if path.exists() else b""


def resume(commands: Commands, run: Path) -> tuple[object, ...]:
    """The words that go on with a run; one killed before it had a manifest is started again."""
    if (run / "manifest.json").exists():
        return ("resume", run)
    return ("run", commands.folder / "scene.toml", "--run-folder", run)


@pytest.mark.long
def test_killed_at_random_times(commands: Commands, whole: bytes, tmp_path: Path) -> None:
    """24 SIGKILLs at random times in rain, windows, jumps and relaxations change nothing."""
    times, kills, number = random.Random(SEED), [], 0
    wanted = sorted(PARTS * 6, key=PARTS.index)
    while len(kills) < len(wanted):
        run, part = tmp_path / f"run_{number}", wanted[len(kills)]
        commands.start(*resume(commands, run), slow=SLOW)
        wait = times.uniform(0, 2.5 * SLOW)
        if commands.until(part):
            time.sleep(wait)
            commands.kill()
        if commands.status == -signal.SIGKILL:
            kills.append((part, wait))
            assert whole.startswith(table(run)), f"after the kills {kills}, seed {SEED}"
        else:  # this run was past its last such part: the next kill needs another
            assert table(run) == whole, f"after the kills {kills}, seed {SEED}"
            number += 1
    assert commands.run(*resume(commands, run)) == 0, commands.output.read_text()
    assert table(run) == whole, f"after the kills {kills}, seed {SEED}"


@pytest.mark.long
@pytest.mark.parametrize(("beside", "step"), [((), 1), (("--members", 2, "--control"), 5)])
def test_killed_at_every_file_operation(
    beside: tuple[object, ...], step: int, commands: Commands, tmp_path: Path
) -> None:
    """A kill in place of any one change outside partial/, beside members and full runs of one in
    five: resumed, all tables are the same."""

    def go_on(run: Path, **asked: object) -> int:
        words = resume(commands, run)
        return commands.run(*words, *(beside if words[0] == "run" else ()), **asked)

    def tables(run: Path) -> dict[str, bytes]:
        return {str(one.relative_to(run)): one.read_bytes() for one in run.rglob("settlement.csv")}

    assert go_on(tmp_path / "0", root=str(tmp_path)) == 0
    count, whole = commands.operations, tables(tmp_path / "0")
    assert count > 30
    assert len(whole) == (4 if beside else 1)
    for number in range(1, count + 1, step):
        run = tmp_path / str(number)
        assert go_on(run, root=str(tmp_path), crash=number) == -signal.SIGKILL
        killed = tables(run)
        assert all(whole[name].startswith(found) for name, found in killed.items())
        assert go_on(run) == 0, commands.output.read_text()
        assert tables(run) == whole, f"killed at operation {number} of {count}"
        assert not list(run.glob(".*.partial"))
        shutil.rmtree(run)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
@pytest.mark.parametrize("part", PARTS)
@pytest.mark.long
def test_interrupted(
    commands: Commands, whole: bytes, tmp_path: Path, part: str, number: signal.Signals
) -> None:
    """SIGTERM and Ctrl-C end with 130 and what to do next; nothing finished is lost."""
    run = tmp_path / "run"
    pid = commands.start(*resume(commands, run), slow=SLOW)
    assert commands.until(part)
    time.sleep(random.Random(SEED).uniform(0, SLOW))
    os.kill(pid, number)
    assert commands.end() == 130
    said = commands.output.read_text()
    assert f"stopped by {number.name}" in said
    assert "trackbed resume" in said
    assert "Traceback" not in said
    *_, last = RunFolder(run).events()
    assert last["event"] == "stopped"
    assert number.name in last["why"]
    finished = RunFolder(run).stage_names()
    assert commands.run("resume", run) == 0
    assert table(run) == whole
    assert RunFolder(run).stage_names()[: len(finished)] == finished


def test_interrupt_is_no_damaged_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A signal that comes while a file is read stops the run; the jump is not given up for it."""
    (tmp_path / "scene.toml").write_text(SCENE)

    load = np.load

    def interrupt(file: Any, **named: Any) -> Any:
        if Path(file.name).name == "states.npz":
            os.kill(os.getpid(), signal.SIGTERM)
        return load(file, **named)

    monkeypatch.setattr(np, "load", interrupt)
    assert command.main(["run", str(tmp_path / "scene.toml")]) == 130
    events = [event["event"] for event in RunFolder(tmp_path / "run").events()]
    assert "jump failed" not in events
    assert events[-1] == "stopped"
    assert signal.getsignal(signal.SIGTERM) == signal.SIG_DFL  # given back


def test_two_writers(commands: Commands, whole: bytes, tmp_path, capsys) -> None:
    """The second writer is refused with the first one's pid; the first is not disturbed."""
    run = tmp_path / "run"
    pid = commands.start(*resume(commands, run), slow=SLOW)
    assert commands.until("window")
    assert command.main(["resume", str(run)]) == 2
    assert f"pid {pid} on " in capsys.readouterr().err
    scene = str(commands.folder / "scene.toml")
    assert command.main(["run", scene, "--run-folder", str(run)]) == 2
    assert commands.end() == 0
    assert table(run) == whole


@pytest.mark.long
def test_report_killed_at_random_times(commands: Commands, whole: bytes, tmp_path: Path) -> None:
    """Kills while the report is written: the page of before or the new one, never a part."""
    run, times, statuses = tmp_path / "run", random.Random(SEED), []
    shutil.copytree(commands.folder / "whole", run)
    commands.run("report", run, here=True)
    began = time.monotonic()
    assert commands.run("report", run) == 0, commands.output.read_text()
    span = time.monotonic() - began
    page = run / "report.html"
    size = page.stat().st_size
    for _ in range(5):
        commands.start("report", run)
        time.sleep(times.uniform(0.2, 0.9) * span)
        statuses.append(commands.kill())
        assert page.read_bytes()[-200:].rstrip().endswith(b"</html>")
        assert page.stat().st_size == pytest.approx(size, rel=0.01)
        assert table(run) == whole
    assert -signal.SIGKILL in statuses
    assert commands.run("report", run) == 0


# --- the engine's own process ---------------------------------------------------------------

STUB = """\
#!/bin/sh
if [ "$1" = -h ]; then echo "LIGGGHTS-PUBLIC 3.8.0"; exit 0; fi
echo $$ > engine.pid
exec sleep 600
"""


@pytest.mark.long
@pytest.mark.parametrize(
    ("number", "status"),
    [(signal.SIGTERM, 130), (signal.SIGINT, 130), (signal.SIGKILL, -signal.SIGKILL)],
)
def test_no_engine_is_left_behind(
    commands: Commands, tmp_path: Path, number: signal.Signals, status: int
) -> None:
    """However trackbed ends, the engine it started ends with it."""
    (tmp_path / "bin").mkdir()
    program = tmp_path / "bin" / "liggghts"
    program.write_text(STUB)
    program.chmod(0o755)
    run = tmp_path / "run"
    words = (*resume(commands, run), "--engine", "liggghts")
    pid = commands.start(*words, path=f"{program.parent}:{os.environ['PATH']}")
    engine = int(awaited(run / "partial" / "preparation" / "engine.pid"))
    assert alive(engine)
    os.kill(pid, number)
    assert commands.end() == status, commands.output.read_text()
    assert comes_true(lambda: not alive(engine))


@pytest.mark.long
@pytest.mark.parametrize(
    ("launcher", "end_s"),
    [
        (": > started; sleep 600 & sleep 600", 60),
        ("setsid sleep 600 & task=$!; trap 'kill $task; exit' TERM; : > started; wait", 60),
        ("trap '' TERM; : > started; sleep 600", 0.2),
    ],
    ids=["plain", "tasks are another's", "deaf"],
)
def test_engine_ends_with_its_run_when_python_lives_on(
    launcher: str, end_s: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In a notebook Python stays after Ctrl-C; the engine and what it started do not.

    Tasks that belong to another process, as srun's do, end with their launcher; it is asked.
    """
    monkeypatch.setattr(engine_process, "PROCESS", replace(engine_process.PROCESS, end_s=end_s))

    def interrupted() -> None:
        if (tmp_path / "started").exists():
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_process(["sh", "-c", launcher], tmp_path, interrupted)
    assert gone(tmp_path)
