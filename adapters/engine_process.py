"""One process of an engine, alone or under a launcher of MPI: run to its end, or ended early."""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path

from adapters.errors import EngineMissing

POLL_S, POLL_MOST_S, POLL_SHARE = 0.05, 1.0, 1e-3
"""Time between two looks at a running engine [s]; at a long run it grows to so great a part of its
length, up to the second: a look costs 0.3 ms."""

END_S = 10
"""Time an engine has to end when it is asked to [s], before it is killed."""


def _die_with_parent() -> None:
    """Have the kernel end this child when Python is killed, so that no orphan keeps computing."""
    ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # 1 = PR_SET_PDEATHSIG


def process_run(
    command: Sequence[str], folder: Path, watch: Callable[[], None]
) -> tuple[int, float, float]:
    """Run ``command`` in ``folder``, output to ``screen.txt``; exit status, CPU s, elapsed s.

    On any exception, Ctrl-C included, it is ended first as `process_end` does.
    Raises `EngineMissing` when the program can not be started.
    """
    environment = os.environ | {
        "OMPI_ALLOW_RUN_AS_ROOT": "1",
        "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    }
    started = time.monotonic()
    with (folder / "screen.txt").open("wb") as screen:
        try:
            child = subprocess.Popen(
                command,
                cwd=folder,
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=screen,
                stderr=subprocess.STDOUT,
                start_new_session=True,
                preexec_fn=_die_with_parent,
            )
        except OSError as error:
            raise EngineMissing(
                f"can not start {command[0]} ({error.strerror})",
                remedy="install it, or mend the scene's engine.launcher; see: trackbed doctor",
            ) from error
        try:
            pid = 0
            while pid == 0:
                length = time.monotonic() - started
                time.sleep(min(max(POLL_S, POLL_SHARE * length), POLL_MOST_S))
                watch()
                pid, status, usage = os.wait4(child.pid, os.WNOHANG)
        except BaseException:
            process_end(child)
            raise
    child.returncode = os.waitstatus_to_exitcode(status)
    return child.returncode, usage.ru_utime + usage.ru_stime, time.monotonic() - started


def process_end(child: subprocess.Popen[bytes]) -> None:
    """Ask a process group to end, and kill what of it is left after `END_S`.

    A launcher that is killed can not tell the tasks it started elsewhere: srun's belong to the
    daemon of SLURM, and would go on computing in the folder in which the run is resumed.
    """
    try:
        with suppress(ProcessLookupError):
            os.killpg(child.pid, signal.SIGTERM)
        until = time.monotonic() + END_S
        # Not reaped before the last signal: the number of its group stays its own.
        while time.monotonic() < until and not os.waitid(
            os.P_PID, child.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT
        ):
            time.sleep(0.01)
    finally:
        with suppress(ProcessLookupError):
            os.killpg(child.pid, signal.SIGKILL)
        child.wait()
