"""One run of a deck by an engine that says ``COMPLETE step N`` when it is through."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path

from adapters.engine import EngineRun, engine_failure, process_run, restart_check
from adapters.engine_plan import SETTLE_TIMES
from adapters.errors import NotConverged

COMPLETE = re.compile(r"^COMPLETE step \d+", re.MULTILINE)
"""The last line of every deck: no exit code proves that a run got so far."""


def deck_run(
    command: Sequence[str],
    folder: Path,
    watch: Callable[[], None],
    digests: dict[str, str],
    *,
    begun: re.Pattern[str],
    loop_time: re.Pattern[str],
    refuse: Callable[[int, str], None] = lambda status, text: None,
) -> EngineRun:
    """Run ``command`` in ``folder`` and judge what it printed.

    ``begun``: what the engine prints once it runs; without it the failure came from outside (a
    launcher, a loader).  ``loop_time``: its words for the seconds that the time steps took, one
    group.  ``refuse(status, text)`` raises for what only this engine does.  Raises
    `EngineFailed`, `EngineMissing`, `NotConverged` (the bed did not settle).
    """
    status, cpu_s, wall_s = process_run(command, folder, watch)
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
