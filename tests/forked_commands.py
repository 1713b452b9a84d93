"""A server of ``trackbed`` commands, each in a forked process, made slow or crashed on purpose.

Forking spares loading the libraries for every command.  Requests are JSON objects, one a line:

========= ======================================================================================
words     the command line
here      true: run it in the server itself, so that later processes find everything loaded
slow      seconds that every part of a run sleeps before and behind its work
crash     number of the file operation in place of which the process kills itself
root      folder below which file operations count, except those inside a folder ``partial``
path      PATH of the process
bed       name of a curve of `tests.jump_curves` by which the fake engine's bed settles
output    file for what the command prints
========= ======================================================================================

Answers are JSON objects too: ``pid``, then ``part`` whenever a part of a slow run begins, at the
end ``status`` (minus a signal) and, unless killed, ``operations``.
"""

from __future__ import annotations

import json
import os
import queue
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout, suppress
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]

WRITING = ("os.rename", "os.mkdir", "os.remove", "os.rmdir", "os.link", "os.truncate")
"""Audit events that change files; ``open`` does when its mode says so."""

operations = 0


def tell(**answer: object) -> None:
    """One line to the test, in one system call, so that lines of two processes do not mix."""
    os.write(1, (json.dumps(answer) + "\n").encode())


def slow_down(seconds: float) -> None:
    """Have each part of a run tell that it begins, and sleep around its work."""
    from adapters import relaxation
    from adapters.engines.fake import FakeEngine
    from adapters.procedure import stages

    def slowed(work: Callable[..., Any], part: str) -> Callable[..., Any]:
        def wrapper(*arguments: Any, **named: Any) -> Any:
            tell(part=part)
            time.sleep(seconds)
            result = work(*arguments, **named)
            time.sleep(seconds)
            return result

        return wrapper

    FakeEngine._prepare = staticmethod(slowed(FakeEngine._prepare, "preparation"))  # type: ignore[method-assign]
    FakeEngine._find_cycles = staticmethod(slowed(FakeEngine._find_cycles, "window"))  # type: ignore[method-assign]
    stages.estimate = slowed(stages.estimate, "jump")
    relaxation.relax = slowed(relaxation.relax, "relaxation")


def count_operations(root: str, crash: int) -> None:
    """Count file operations below ``root``; kill this process in place of number ``crash``."""

    def counts(path: object) -> bool:
        return str(path).startswith(root) and "/partial/" not in str(path)

    def hook(event: str, arguments: tuple[Any, ...]) -> None:
        global operations
        if event == "open":
            mode = arguments[1]
            if not isinstance(mode, str) or not set(mode) & set("wax+"):
                return
        elif event not in WRITING:
            return
        if not any(map(counts, arguments[:2])):
            return
        operations += 1
        if operations == crash:
            os.kill(os.getpid(), signal.SIGKILL)

    sys.addaudithook(hook)


def serve(request: dict[str, Any]) -> None:
    """Run one request in this process."""
    from trackbed import command

    if "path" in request:
        os.environ["PATH"] = request["path"]
    if "bed" in request:
        from adapters.engines import fake as engine_fake
        from tests.jump_curves import CURVES, Curve

        engine_fake.BED = Curve(CURVES[request["bed"]], bursts=0.2)
    if "slow" in request:
        slow_down(request["slow"])
    if "root" in request:
        count_operations(request["root"], request.get("crash", 0))
    with open(request["output"], "w") as output, redirect_stdout(output), redirect_stderr(output):
        status = command.main(request["words"])
    tell(operations=operations)
    if not request.get("here"):
        os._exit(status)


def main() -> None:
    """Serve until standard input ends."""
    for line in sys.stdin:
        request = json.loads(line)
        if request.get("here"):
            serve(request)
            tell(status=0)
            continue
        pid = os.fork()
        if pid == 0:
            tell(pid=os.getpid())
            serve(request)
        tell(status=os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]))


class Commands:
    """The server from the side of a test."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.output = folder / "output.txt"
        self.operations = 0
        self.status = 0
        self._running = 0
        self._lines: queue.Queue[dict[str, Any]] = queue.Queue()
        self._process = subprocess.Popen(
            [sys.executable, __file__],
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
        self._lines.put({"status": -1})  # the server is gone

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
        return self._ended(answer)

    def _ended(self, answer: dict[str, Any]) -> int:
        self._running, self.status = 0, int(answer["status"])
        return self.status

    def run(self, *words: object, **request: Any) -> int:
        """A whole command; its exit status."""
        self.start(*words, **request)
        return self.end()

    def until(self, part: str) -> bool:
        """Wait until a part of a slow run begins; False when the command ended before."""
        while True:
            answer = self.answer()
            if "status" in answer:
                self._ended(answer)
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


def processes_in(folder: Path) -> list[int]:
    """Processes that work in a folder or below it."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            place = Path(os.readlink(process / "cwd").removesuffix(" (deleted)"))
            if place.is_relative_to(folder) and alive(int(process.name)):
                found.append(int(process.name))
    return found


def gone(folder: Path) -> bool:
    """Whether, within a minute, no process works in a folder or below it any more."""
    return comes_true(lambda: not processes_in(folder))


def comes_true(true: Callable[[], object], within_s: float = 60) -> bool:
    """Whether something becomes so within some seconds."""
    deadline = time.monotonic() + within_s
    while not true():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.01)
    return True


if __name__ == "__main__":
    main()
