"""Killed, interrupted or written to by two at any moment: a run ends with the same table."""

from __future__ import annotations

import json
import os
import queue
import random
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import trackbed
from adapters.run_folder import RunFolder

ROOT = Path(__file__).parents[2]
SEED = 2007
SLOW = 0.04
"""Seconds that each part of a slow run sleeps before and behind its work."""

SCENE = """\
[sample]
container = "cylinder"
radius = 0.02
symmetry = ["x", "y"]
count = 12
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
        self._lines: queue.Queue[dict[str, Any]] = queue.Queue()
        self._process = subprocess.Popen(
            [sys.executable, str(Path(__file__).with_name("forked_commands.py"))],
            cwd=ROOT,
            env=os.environ | {"PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"},
            text=True,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self._lines.put(json.loads(line))

    def answer(self) -> dict[str, Any]:
        """The next answer; an empty queue for a minute is a failure."""
        return self._lines.get(timeout=60)

    def start(self, *words: object, **request: Any) -> int:
        """Start a command; its process id."""
        request |= {"words": [str(word) for word in words], "output": str(self.output)}
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps(request) + "\n")
        self._process.stdin.flush()
        return 0 if request.get("here") else int(self.answer()["pid"])

    def end(self) -> int:
        """Wait for the end of a command; its exit status."""
        while "status" not in (answer := self.answer()):
            self.operations = answer.get("operations", 0)
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
                return False
            if answer.get("part") == part:
                return True

    def close(self) -> None:
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait(timeout=60)


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


def resume(commands: Commands, run: Path, **request: Any) -> tuple[object, ...]:
    """The words that go on with a run; one killed before it had a manifest is started again."""
    if (run / "manifest.json").exists():
        return ("resume", run)
    return ("run", commands.folder / "scene.toml", "--run-folder", run)


def test_killed_at_random_times(commands: Commands, whole: bytes, tmp_path: Path) -> None:
    """24 SIGKILLs at random times in rain, windows, jumps and relaxations change nothing."""
    run, times, kills = tmp_path / "run", random.Random(SEED), []
    for part in ("preparation", "window", "jump", "relaxation") * 6:
        pid = commands.start(*resume(commands, run), slow=SLOW)
        reached = commands.until(part)
        wait = times.uniform(0, 2.5 * SLOW)
        if reached:
            time.sleep(wait)
            os.kill(pid, signal.SIGKILL)
            assert commands.end() == -signal.SIGKILL, kills
            kills.append((part, wait))
        assert whole.startswith(table(run)), f"after the kills {kills}, seed {SEED}"
    assert {part for part, _ in kills} == {"preparation", "window", "jump", "relaxation"}
    assert len(kills) >= 20, kills
    assert commands.run(*resume(commands, run)) == 0, commands.output.read_text()
    assert table(run) == whole, f"after the kills {kills}, seed {SEED}"
