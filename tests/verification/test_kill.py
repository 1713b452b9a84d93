"""Killed, interrupted or written to by two at any moment: a run ends with the same table."""

from __future__ import annotations

import json
import os
import queue
import random
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

import trackbed
from adapters.run_folder import RunFolder

ROOT = Path(__file__).parents[2]
SEED = 2007
SLOW = 0.04
"""Seconds that each part of a slow run sleeps before and behind its work."""

PARTS = ("preparation", "window", "jump", "relaxation")

SCENE = """\
[sample]
container = "cylinder"
radius = 0.02
symmetry = ["x", "y"]
count = 60
grain_radius = { distribution = "uniform", mean = 2e-3, standard_deviation = 2e-4 }

[material]
grain = { young = 1e9, poisson = 0.25, density = 2710.0, viscous_alpha = 0.4, friction = 0.5 }
wall = { young = 1e10, poisson = 0.3, friction = 0.5 }

[loading]
amplitude = 14150.0
mean = 7075.0
frequency = 50.0
piston_mass = 0.005

[procedure]
k_i = 2
k = 2
h = 2
healing_cycles = 1
total_cycles = 14

[engine]
name = "fake"
rayleigh_share = 0.2
"""


class Commands:
    """`forked_commands` from the side of a test."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.output = folder / "output.txt"
        self.operations = 0
        self._running = 0
        self._lines: queue.Queue[dict[str, Any]] = queue.Queue()
        self._process = subprocess.Popen(
            [sys.executable, str(Path(__file__).with_name("forked_commands.py"))],
            cwd=ROOT,
            env=os.environ | {"PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"},
            text=True,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self._lines.put(json.loads(line))

    def answer(self) -> dict[str, Any]:
        """The next answer; none in ten minutes is a failure."""
        return self._lines.get(timeout=600)

    def start(self, *words: object, **request: Any) -> int:
        """Start a command; its process id.  One that a failed test left is killed first."""
        self.stop()
        request |= {"words": [str(word) for word in words], "output": str(self.output)}
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps(request) + "\n")
        self._process.stdin.flush()
        self._running = 0 if request.get("here") else int(self.answer()["pid"])
        return self._running

    def end(self) -> int:
        """Wait for the end of a command; its exit status."""
        while "status" not in (answer := self.answer()):
            self.operations = answer.get("operations", 0)
        self._running = 0
        return int(answer["status"])

    def run(self, *words: object, **request: Any) -> int:
        """A whole command; its exit status."""
        self.start(*words, **request)
        return self.end()

    def until(self, part: str) -> bool:
        """Wait until a part of a slow run begins; False when the command ended before."""
        while True:
            answer = self.answer()
            if "status" in answer:
                self._running = 0
                return False
            if answer.get("part") == part:
                return True

    def kill(self) -> int:
        """SIGKILL to the command; its exit status, another one when it had ended just before."""
        with suppress(ProcessLookupError):
            os.kill(self._running, signal.SIGKILL)
        return self.end()

    def stop(self) -> None:
        """Kill what still runs."""
        if self._running:
            self.kill()

    def close(self) -> None:
        """End the server."""
        self.stop()
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.close()
        self._process.wait(timeout=600)
        self._reader.join()
        self._process.stdout.close()


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


def test_killed_at_random_times(commands: Commands, whole: bytes, tmp_path: Path) -> None:
    """24 SIGKILLs at random times in rain, windows, jumps and relaxations change nothing."""
    run, times, kills = tmp_path / "run", random.Random(SEED), []
    for part in sorted(PARTS * 6, key=PARTS.index):
        commands.start(*resume(commands, run), slow=SLOW)
        if commands.until(part):
            wait = times.uniform(0, 2.5 * SLOW)
            time.sleep(wait)
            assert commands.kill() == -signal.SIGKILL, kills
            kills.append((part, wait))
        assert whole.startswith(table(run)), f"after the kills {kills}, seed {SEED}"
    assert commands.run(*resume(commands, run)) == 0, commands.output.read_text()
    assert table(run) == whole, f"after the kills {kills}, seed {SEED}"
    assert {part for part, _ in kills} == set(PARTS)
    assert len(kills) >= 20, kills


def test_killed_at_every_file_operation(commands: Commands, whole: bytes, tmp_path: Path) -> None:
    """A kill in place of any one change outside partial/: resumed, the table is the same."""
    assert commands.run(*resume(commands, tmp_path / "0"), root=str(tmp_path)) == 0
    count = commands.operations
    assert count > 30
    for number in range(1, count + 1):
        run = tmp_path / str(number)
        words = resume(commands, run)
        assert commands.run(*words, root=str(tmp_path), crash=number) == -signal.SIGKILL
        assert whole.startswith(table(run)), f"killed at operation {number} of {count}"
        assert commands.run(*resume(commands, run)) == 0, commands.output.read_text()
        assert table(run) == whole, f"killed at operation {number} of {count}"
        assert not list(run.glob(".*.partial"))
        shutil.rmtree(run)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
@pytest.mark.parametrize("part", PARTS)
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


def test_interrupt_is_not_taken_for_a_damaged_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A signal that comes while a file is read stops the run; the jump is not given up for it."""
    (tmp_path / "scene.toml").write_text(SCENE)

    def interrupt(*_: object, **__: object) -> None:
        os.kill(os.getpid(), signal.SIGTERM)

    monkeypatch.setattr("adapters.window.np.load", interrupt)
    assert trackbed.main(["run", str(tmp_path / "scene.toml")]) == 130
    events = [event["event"] for event in RunFolder(tmp_path / "run").events()]
    assert "jump failed" not in events
    assert events[-1] == "stopped"
    assert signal.getsignal(signal.SIGTERM) == signal.SIG_DFL  # given back


def test_two_writers(
    commands: Commands, whole: bytes, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The second writer is refused with the first one's pid; the first is not disturbed."""
    run = tmp_path / "run"
    pid = commands.start(*resume(commands, run), slow=SLOW)
    assert commands.until("window")
    assert trackbed.main(["resume", str(run)]) == 2
    assert f"pid {pid} on " in capsys.readouterr().err
    scene = str(commands.folder / "scene.toml")
    assert trackbed.main(["run", scene, "--run-folder", str(run)]) == 2
    assert commands.end() == 0
    assert table(run) == whole


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
    deadline = time.monotonic() + 60
    while alive(engine) and time.monotonic() < deadline:
        time.sleep(0.01)
    assert not alive(engine)


def awaited(path: Path) -> str:
    """Content of a file that another process is about to write."""
    deadline = time.monotonic() + 300
    while time.monotonic() < deadline:
        if path.exists() and (text := path.read_text()):
            return text
        time.sleep(0.01)
    raise AssertionError(f"{path} was not written")


def alive(pid: int) -> bool:
    """Whether a process is there and computes; one that only waits to be reaped is not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False
