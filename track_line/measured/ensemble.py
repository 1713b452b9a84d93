"""Settlements of many beds at the same cycles."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from track_line.arrays import Bools, Floats
from track_line.laws import SEAT_AREA
from trackbed.errors import UsageError

A_DECADE = 20
"""Cycles of an `Ensemble` in each decade, or a little fewer, evenly spaced in ln N."""
BLOCK = 0.1
"""Share of the cycles up to N over which a settlement is averaged [-]: a bed springs at the end of
a cycle, and what it springs is no memory of it."""
READ = 0.9
"""Share of the beds that are read where all count as read [-]: some readings of some fail."""
FEWEST = 3
"""Beds, below which there is no scatter to speak of."""
SHORTEST = 10.0
"""Last cycle over the first, at least [-]."""


@dataclass(frozen=True)
class Ensemble:
    """n beds at k cycles, evenly spaced in ln N from first to last."""

    cycle: Floats  # N, shape (k,) [-]
    settled: Floats  # mean over a `BLOCK` of cycles up to N, shape (n, k) [m]
    middle: Floats  # mean cycle of that block, where a law would settle so far, shape (k,)
    read: Bools
    """Cycles that `READ` of the beds were read at, within half a step, shape (k,); between readings
    a straight line in ln N is taken, which knows nothing of a bed."""
    names: list[str]  # of the beds, n
    packing: NDArray[np.int64]
    """Which rain of grains, or place in the track, each bed is, shape (n,)."""
    pressure: Floats
    """Greatest pressure under the loaded body, shape (n,) [Pa]; nan where it is not known."""
    bedding: Floats
    """Pressure over elastic deflection, late, shape (n,) [Pa/m]; nan where it is not known."""
    in_order: bool  # whether neighbours in the table are neighbours in a track
    notes: tuple[str, ...] = ()  # what of the table was not taken, and why

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


def align_beds(
    curves: Sequence[tuple[Floats, Floats]], where: str, *, notes: Sequence[str] = (), **others: Any
) -> Ensemble:  # fmt: skip
    """Beds of ``curves``, cycles (ascending) and settlements [m] each, at cycles that all have.

    ``others`` are further fields of `Ensemble`.  Raises `UsageError` for too few beds or cycles.
    """
    if any(cycle[0] <= 0 for cycle, _ in curves):
        notes = [*notes, "readings at cycle 0 are left out: windows are of the logarithm of cycles"]
    if len(curves) < FEWEST:
        raise UsageError(
            f"{len(curves)} bed{'s show' if len(curves) != 1 else ' shows'} no scatter",
            where=where, remedy=f"give {FEWEST} at least, and thirty to know whether a bad bed "
            "stays one; a law alone is what trackbed fit finds",
        )  # fmt: skip
    first = max(max(float(cycle[cycle > 0].min(initial=cycle[-1])), 1.0) for cycle, _ in curves)
    last = min(float(cycle[-1]) for cycle, _ in curves)
    if last < (longest := max(float(cycle[-1]) for cycle, _ in curves)):
        notes = [*notes, f"cycles {last:g} to {longest:g} are left out: some beds have none there"]
    if last < SHORTEST * first:
        raise UsageError(
            f"all beds have cycles {first:g} to {last:g} only, which shows no law", where=where,
            remedy=f"measure to {SHORTEST:g} times the first cycle at least",
        )  # fmt: skip
    cycle = np.geomspace(first, last, int(A_DECADE * np.log10(last / first) + 1e-9) + 1)
    half = np.log(cycle[1] / cycle[0]) / 2
    near = np.maximum(cycle[:, None] * np.linspace(1 - BLOCK, 1, 10), first)
    logs = [np.log(np.maximum(one, np.finfo(float).tiny)) for one, _ in curves]
    near_one = [find_distance(np.log(cycle), x) <= half for x in logs]
    read = np.mean(near_one, axis=0) >= READ
    middle, near = near.mean(axis=1), np.log(near)
    settled = [np.interp(near, x, s).mean(axis=1) for x, (_, s) in zip(logs, curves, strict=True)]
    return Ensemble(cycle, np.array(settled), middle, read, notes=tuple(notes), **others)


def find_distance(places: Floats, readings: Floats) -> Floats:
    """From each of ``places`` (k,) to the nearest of ``readings``, ascending."""
    behind = np.clip(np.searchsorted(readings, places), 1, len(readings) - 1)
    return np.minimum(abs(places - readings[behind - 1]), abs(places - readings[behind]))
