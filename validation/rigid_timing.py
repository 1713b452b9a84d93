"""How long a run takes: processor seconds, the median of means where it is short, and a limit."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from rigid_lcp.errors import RigidError
from validation.rigid_peers import REPEATS, PeerRun, batch_size

SHORT_S = 0.5
"""A run of less time [s] is repeated."""


class OutOfTime(Exception):
    """A run took more processor time than it may."""


def repeated(
    solve: Callable[[float, float], PeerRun], tolerance: float, budget_s: float
) -> PeerRun:
    """A run of a solver within its budget [s], repeated where short; a failure is a run as well."""
    setting = {"tolerance": tolerance}
    try:
        start = time.perf_counter()
        first = limited(lambda: solve(tolerance, budget_s), 2 * budget_s)
        wall = time.perf_counter() - start
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
    """Do a job; raises `OutOfTime` when it has used so many processor seconds."""

    def stop(*_: Any) -> None:
        raise OutOfTime

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        return job()
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)
