"""Pressure between sleeper and rail at both rail seats, as a record sampled at an even rate."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from qdem_fem.mesh import FloatArray
from trackbed.run_files import write_whole

RATE = 10_000.0
"""Samples a second of the paper's record (section 4) [Hz]."""
SEATS = ("rp1", "rp2")
"""Columns of the right and the left rail seat, by the names of the paper's Fig. 5."""


@dataclass(frozen=True, eq=False)
class LoadRecord:
    """Pressures sampled at an even rate."""

    time: FloatArray
    """[s], (k,), growing evenly."""
    pressure: FloatArray
    """Pressure on seat 1 and 2 [Pa], (k, 2); negative where the rail lifts the sleeper."""

    @property
    def rate(self) -> float:
        """Samples a second [Hz]."""
        return float((len(self.time) - 1) / (self.time[-1] - self.time[0]))


def write_load_record(path: str | os.PathLike[str], record: LoadRecord) -> None:
    """Write a table, atomically; times to 0.1 us, pressures to nine digits."""
    rows = zip(record.time, record.pressure, strict=True)
    lines = (f"{time:.7f},{one:.9g},{two:.9g}\n" for time, (one, two) in rows)
    write_whole(Path(path), f"time,{','.join(SEATS)}\n" + "".join(lines))
