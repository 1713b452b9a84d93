"""How long a run takes: processor seconds, the median of means where it is short, and a limit.

Where kernels are compiled in a run, as in a checkout's first, the limit does not count that, and
the run is made and timed again.
"""

from __future__ import annotations

import signal
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numba.core.event import Event, Listener, install_listener, install_recorder

from rigid_lcp.errors import RigidError
from validation.rigid_peers import REPEATS, PeerRun, batch_size

SHORT_S = 0.5
"""A run of less time [s] is repeated."""


COMPILATION = "numba:compile"


class OutOfTime(Exception):
    """A run took more processor time than it may."""


class LimitPaused(Listener):
    """Stops the clock of `limited` while kernels are compiled."""

    def __init__(self) -> None:
        self.depth, self.left = 0, 0.0

    def on_start(self, event: Event) -> None:
        """A kernel is compiled, perhaps for another."""
        if self.depth == 0:
            self.left = signal.setitimer(signal.ITIMER_PROF, 0.0)[0]
        self.depth += 1

    def on_end(self, event: Event) -> None:
        """The clock goes on once nothing is compiled."""
        self.depth -= 1
        if self.depth == 0:
            signal.setitimer(signal.ITIMER_PROF, self.left)


def repeated(
    solve: Callable[[float, float], PeerRun], tolerance: float, budget_s: float
) -> PeerRun:
    """A run of a solver within its budget [s], repeated where short; a failure is a run as well."""
    setting = {"tolerance": tolerance}
    try:
        for _ in range(2):
            with install_recorder(COMPILATION) as compiled:
                start = time.perf_counter()
                first = limited(lambda: solve(tolerance, budget_s), 2 * budget_s)
                wall = time.perf_counter() - start
            if not compiled.buffer:
                break
        costs = [first.cost_s or 0.0]
        if wall < SHORT_S:
            batch = batch_size(first.cost_s or 0.0)
            costs = [
                float(np.mean([solve(tolerance, budget_s).cost_s or 0.0 for _ in range(batch)]))
                for _ in range(REPEATS)
            ]
    except OutOfTime:
        return PeerRun(setting, None, why="out of time")
    except RigidError as error:
        return PeerRun(setting, None, why=f"{type(error).__name__}: {error.what}")
    except Exception as error:  # a failure is a result: it is recorded, and the race goes on
        if of_the_limit(error):
            return PeerRun(setting, None, why="out of time")
        return PeerRun(setting, None, why=f"{type(error).__name__}: {error}"[:200])
    return PeerRun(
        setting, first.force, float(np.median(costs)), tuple(costs), first.work, first.work_unit,
        first.claims, first.why,
    )  # fmt: skip


def of_the_limit(error: BaseException | None) -> bool:
    """Whether `OutOfTime` is at the root of an error: compiled code and libraries that the limit
    strikes in wrap it in one of theirs."""
    while error is not None:
        if isinstance(error, OutOfTime):
            return True
        error = error.__cause__ or error.__context__
    return False


def limited(job: Callable[[], PeerRun], seconds: float) -> PeerRun:
    """Do a job; raises `OutOfTime` when it has used so many processor seconds, those in which
    kernels are compiled not counted."""

    def stop(*_: Any) -> None:
        raise OutOfTime

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        with install_listener(COMPILATION, LimitPaused()):
            return job()
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)
