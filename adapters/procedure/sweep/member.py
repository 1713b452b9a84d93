"""One member of a sweep on the worker that runs it: its verb in a process of its own.

A process, because a member that crashes must take no other with it, and because its CPU time is to
be its own.  When a worker dies its members die with it; a run that is killed keeps every finished
window, and the scheduler hands it to another worker, which goes on with it.
"""

import os
import signal
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from adapters.engines import run_process

THREADS = (
    "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS",
)  # fmt: skip
"""A member runs on one core unless the worker's environment says more: others run beside it."""
COMMAND = (sys.executable, "-m", "trackbed")
"""The command, as it is installed on the worker."""


class SweepStopped(Exception):
    """The sweep was stopped while this member ran."""


@dataclass(frozen=True)
class Ended:
    """How a member's command ended."""

    exit_code: int  # that of its verb, 0 at its end; minus the signal when one ended it
    sentence: str  # what it said of its error; empty when it had none


STOPPED = Ended(130, "stopped with the sweep; every finished window is saved")


def run_member(words: Sequence[str], log: Path, stop_file: Path) -> Ended:
    """Run a member, the command with ``words``, to its end, or until ``stop_file`` exists.

    What it prints goes to ``screen.txt`` in the folder ``log``.
    """

    def watch() -> None:
        if stop_file.exists():
            raise SweepStopped

    threads = [f"{name}=1" for name in THREADS if name not in os.environ]
    log.mkdir(parents=True, exist_ok=True)
    try:
        watch()
        exit_code, _, _ = run_process(["env", *threads, *COMMAND, *words], log, watch)
    except SweepStopped:
        return STOPPED
    return Ended(exit_code, read_sentence(exit_code, log / "screen.txt"))


def read_sentence(exit_code: int, screen: Path) -> str:
    """The error sentence at the end of what a command printed, or which signal ended it."""
    if exit_code == 0:
        return ""
    lines = screen.read_text(encoding="utf-8", errors="replace").splitlines()
    begins = [number for number, line in enumerate(lines) if line.startswith("trackbed: ")]
    if begins:
        return "\n".join(lines[begins[-1] :]).removeprefix("trackbed: ")
    if exit_code < 0:
        return f"the run was ended by {signal.Signals(-exit_code).name}"
    return f"the run ended with exit code {exit_code}: {' | '.join(lines[-3:])}"
