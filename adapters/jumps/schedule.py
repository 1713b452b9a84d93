"""Schedules of jumps: cycles h of each, from how many there are.

A bed settles by about the same in equal steps of ln N.  Of equal jumps the first is asked for most
of the settlement, when least of the bed is known; jumps whose ends are evenly spaced in ln N are
each asked for about as much.  docs/jumps.md.
"""

from __future__ import annotations

import numpy as np


def schedule_jumps(jumps: int, last: int, k_i: int, window: int, healing: int) -> list[int]:
    """Cycles h of each of so many jumps, that the last window ends at cycle ``last``.

    From k_i a ``window``; behind each jump ``healing`` cycles and a window.  Ends of windows are
    evenly spaced in ln N.  ValueError where the first jump is of no cycle.
    """
    ends = np.rint(np.geomspace(k_i + window, max(last, 1), jumps + 1)).astype(int)
    lengths = np.diff(ends) - healing - window
    if lengths.min() < 1:
        raise ValueError(f"{jumps} jumps to cycle {last} begin with one of no cycle")
    return [int(h) for h in lengths]
