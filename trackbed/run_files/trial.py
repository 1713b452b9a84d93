"""What a run will about cost, from a few steps of it."""

from __future__ import annotations

import time
from collections.abc import Callable

TRIAL = 0.5
"""Time that a dry run may spend on trial steps to tell the cost [s]."""


def time_step(advance: Callable[[float], object], step: float, most: int) -> float:
    """Time of one of at ``most`` so many steps on the clock [s]; the first ones compile.

    ``advance`` goes on by so many seconds, ``step`` is the length of one step [s].
    """
    advance(step)
    steps = 1
    while True:
        started = time.perf_counter()
        advance(steps * step)
        spent = time.perf_counter() - started
        if spent > TRIAL / 4 or 2 * steps > most:
            return spent / steps
        steps *= 2
