"""One run of a deck by an engine that says ``COMPLETE step N`` when it is through."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from adapters.engine import EngineRun, engine_failure, restart_check
from adapters.engine_plan import SETTLE_TIMES
from adapters.engine_process import process_run
from adapters.errors import EngineFailed, NotConverged

COMPLETE = re.compile(r"^COMPLETE step \d+", re.MULTILINE)
"""The last line of every deck: no exit code proves that a run got so far."""

START_S = 30
"""Time from the start of an engine in which a second one beside it is looked for [s]."""

START_BYTES = 1 << 16
"""Part of what is printed in which the engines' first words are looked for."""


def several_refuse(folder: Path, begun: re.Pattern[str], launch: str) -> None:
    """Raise `EngineFailed` when more than one run prints in ``folder``; before they compute.

    A launcher of another MPI starts runs of one process each, that all write the same files and
    end well.
    """
    try:
        with (folder / "screen.txt").open("rb") as stream:
            text = stream.read(START_BYTES).decode(errors="replace")
    except OSError:
        return
    runs = len(begun.findall(text))
    if runs > 1:
        error = EngineFailed(
            f"{runs} runs of the engine started that know nothing of one another",
            where=str(folder),
            remedy=launch,
        )
        error.from_outside = True
        raise error


def deck_run(
    command: Sequence[str],
    folder: Path,
    watch: Callable[[], None],
    digests: dict[str, str],
    *,
    begun: re.Pattern[str],
    loop_time: re.Pattern[str],
    launch: str,
    refuse: Callable[[int, str], None] = lambda status, text: None,
) -> EngineRun:
    """Run ``command`` in ``folder`` and judge what it printed.

    ``begun``: what the engine prints once when it starts; without it the failure came from
    outside (a launcher, a loader), twice it is two runs in one folder.  ``loop_time``: its words
    for the seconds that the time steps took, one group.  ``launch``: how it is launched rightly.
    ``refuse(status, text)`` raises for what only this engine does.  Raises `EngineFailed`,
    `EngineMissing`, `NotConverged` (the bed did not settle).
    """
    started = time.monotonic()

    def watch_start() -> None:
        if time.monotonic() - started < START_S:
            several_refuse(folder, begun, launch)
        watch()

    status, cpu_s, wall_s = process_run(command, folder, watch_start)
    several_refuse(folder, begun, launch)
    text = (folder / "screen.txt").read_text(errors="replace")
    if "NOT SETTLED" in text:
        raise NotConverged(
            f"the bed still moves after {SETTLE_TIMES} falling times",
            where=str(folder),
            remedy="more damping (viscous_alpha), or a shorter time step",
        )
    refuse(status, text)
    if status != 0 or COMPLETE.search(text) is None:
        failure = engine_failure(status, folder)
        failure.from_outside |= begun.search(text) is None
        raise failure
    restart_check(folder)
    loop_s = sum(float(seconds) for seconds in loop_time.findall(text))
    return EngineRun(tuple(command), cpu_s, wall_s, max(wall_s - loop_s, 0.0), digests)
