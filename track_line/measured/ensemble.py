"""Settlements of many beds at the same cycles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from track_line.arrays import Floats
from track_line.laws import SEAT_AREA
from trackbed.errors import UsageError

A_DECADE = 20
"""Cycles of an `Ensemble` in each decade, evenly spaced in ln N."""
BLOCK = 0.1
"""Share of the cycles up to N over which a settlement is averaged [-]: a bed springs at the end of
a cycle, and what it springs is no memory of it."""
FEWEST = 3
"""Beds, below which there is no scatter to speak of."""
SHORTEST = 10.0
"""Last cycle over the first, at least [-]."""


@dataclass(frozen=True)
class Ensemble:
    """n beds at k cycles, evenly spaced in ln N up to the last."""

    cycle: Floats
    """N, shape (k,) [-]."""
    settled: Floats
    """Shape (n, k) [m]."""
    packing: NDArray[np.int64]
    """Which rain of grains, or place in the track, each bed is, shape (n,)."""
    pressure: Floats
    """Greatest pressure under the loaded body, shape (n,) [Pa]; nan where it is not known."""
    bedding: Floats
    """Pressure over elastic deflection, late, shape (n,) [Pa/m]; nan where it is not known."""
    in_order: bool
    """Whether neighbours in the table are neighbours in a track."""
    notes: tuple[str, ...] = ()
    """What of the table was not taken, and why."""

    @property
    def packings(self) -> int:
        """How many beds are independent: one packing under several loads is one."""
        return len(np.unique(self.packing))

    @property
    def force(self) -> Floats:
        """Greatest force of half a sleeper under this pressure, shape (n,) [N]."""
        return self.pressure * SEAT_AREA

    @property
    def load(self) -> NDArray[np.int64]:
        """Number of each bed's load, shape (n,); one where none is known."""
        return np.unique(self.pressure, return_inverse=True)[1]


def align_beds(curves: Sequence[tuple[Floats, Floats]], where: str, **others: Any) -> Ensemble:
    """Beds of ``curves``, cycles (ascending) and settlements [m] each, at cycles that all have.

    ``others`` are further fields of `Ensemble`.  Raises `UsageError` for too few beds or cycles.
    """
    if len(curves) < FEWEST:
        raise UsageError(
            f"{len(curves)} beds show no scatter", where=where,
            remedy=f"give {FEWEST} at least, and thirty to know whether a bad bed stays one",
        )  # fmt: skip
    first = max(max(float(cycle[0]), 1.0) for cycle, _ in curves)
    last = min(float(cycle[-1]) for cycle, _ in curves)
    if last < SHORTEST * first:
        raise UsageError(
            f"all beds have cycles {first:g} to {last:g} only, which shows no law", where=where,
            remedy=f"measure to {SHORTEST:g} times the first cycle at least",
        )  # fmt: skip
    steps = int(A_DECADE * np.log10(last / first) + 1e-9)
    cycle = last * 10.0 ** (np.arange(-steps, 1) / A_DECADE)
    near = cycle[:, None] * np.linspace(1 - BLOCK, 1, 10)
    settled = [np.interp(np.log(np.maximum(near, one[0])), np.log(np.maximum(one, 1e-300)), s)
               for one, s in curves]  # fmt: skip
    return Ensemble(cycle, np.mean(settled, axis=2), **others)
