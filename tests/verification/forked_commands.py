"""A server of ``trackbed`` commands, each in a forked process, made slow or crashed on purpose.

Forking spares loading the libraries for every command.  Requests are JSON objects, one a line:

========= ======================================================================================
words     the command line
here      true: run it in the server itself, so that later processes find everything loaded
slow      seconds that every part of a run sleeps before and behind its work
crash     number of the file operation in place of which the process kills itself
root      folder below which file operations count, except those inside a folder ``partial``
path      PATH of the process
output    file for what the command prints
========= ======================================================================================

Answers are JSON objects too: ``pid``, then ``part`` whenever a part of a slow run begins, at the
end ``status`` (minus a signal) and, unless killed, ``operations``.
"""

from __future__ import annotations

import json
import os
import signal
import sys
import time
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from typing import Any

WRITING = ("os.rename", "os.mkdir", "os.remove", "os.rmdir", "os.link", "os.truncate")
"""Audit events that change files; ``open`` does when its mode says so."""

operations = 0


def tell(**answer: object) -> None:
    """One line to the test, in one system call, so that lines of two processes do not mix."""
    os.write(1, (json.dumps(answer) + "\n").encode())


def slow_down(seconds: float) -> None:
    """Have each part of a run tell that it begins, and sleep around its work."""
    from adapters import stages
    from adapters.engine_fake import FakeEngine

    def slowed(work: Callable[..., Any], part: str) -> Callable[..., Any]:
        def wrapper(*arguments: Any, **named: Any) -> Any:
            tell(part=part)
            time.sleep(seconds)
            result = work(*arguments, **named)
            time.sleep(seconds)
            return result

        return wrapper

    FakeEngine._prepare = staticmethod(slowed(FakeEngine._prepare, "preparation"))  # type: ignore[method-assign]
    FakeEngine._cycles = staticmethod(slowed(FakeEngine._cycles, "window"))  # type: ignore[method-assign]
    stages.estimate = slowed(stages.estimate, "jump")
    stages.relax = slowed(stages.relax, "relaxation")  # type: ignore[assignment]


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
    import trackbed

    if "path" in request:
        os.environ["PATH"] = request["path"]
    if "slow" in request:
        slow_down(request["slow"])
    if "root" in request:
        count_operations(request["root"], request.get("crash", 0))
    with open(request["output"], "w") as output, redirect_stdout(output), redirect_stderr(output):
        status = trackbed.main(request["words"])
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


if __name__ == "__main__":
    main()
