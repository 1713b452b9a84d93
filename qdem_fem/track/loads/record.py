"""Pressure between sleeper and rail at both rail seats, as a record sampled at an even rate."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from qdem_fem.files import ConditionError, LibraryMissing, Series, UsageError
from qdem_fem.mesh import FloatArray
from trackbed.run_files import write_whole
from trackbed.series_file import TIMES, read_columns

RATE = 10_000.0
"""Samples a second of the paper's record (section 4) [Hz]."""
UNEVEN = 1e-3
"""Departure of an interval from the mean one, over it, from which on a record is uneven: times
written with seven digits depart by less."""
PRESSURES = ("Pa", "kPa", "MPa")
SEATS = ("rp1", "rp2")
"""Columns of the right and the left rail seat, by the names of the paper's Fig. 5."""


@dataclass(frozen=True, eq=False)
class LoadRecord:
    """A pressure record; raises `ConditionError` where it is no even, finite one."""

    time: FloatArray
    """[s], (k,), growing evenly."""
    pressure: FloatArray
    """Pressure on seat 1 and 2 [Pa], (k, 2); negative where the rail lifts the sleeper."""

    def __post_init__(self) -> None:
        series = Series(self.time, self.pressure)
        object.__setattr__(self, "time", series.times)
        object.__setattr__(self, "pressure", series.values)
        where = "load record"
        if series.values.shape != (len(series.times), 2) or len(series.times) < 2:
            raise ConditionError(
                f"pressures of shape {series.values.shape} at {len(series.times)} times",
                where=where,
                remedy="give two pressures, one a rail seat, at two or more times",
            )
        step = np.diff(series.times)
        uneven = np.flatnonzero(np.abs(step / step.mean() - 1) > UNEVEN)
        if len(uneven):
            at = int(uneven[0])
            raise ConditionError(
                f"the time goes on by {step[at]:g} s behind {series.times[at]:g} s, but by "
                f"{step.mean():g} s on average",
                where=where,
                remedy="give a record that is sampled evenly, without gaps",
            )

    @property
    def rate(self) -> float:
        """Samples a second [Hz]."""
        return float((len(self.time) - 1) / (self.time[-1] - self.time[0]))

    def seat(self, number: int) -> Series:
        """Pressure on seat 1 or 2 [Pa], linear between the samples as the paper takes it, and
        constant before the first and behind the last."""
        if number not in (1, 2):
            raise ConditionError(f"there is no rail seat {number}", where="load record",
                                 remedy="use 1 or 2")  # fmt: skip
        return Series(self.time, self.pressure[:, number - 1])

    def force(self, number: int, area: float, down: ArrayLike) -> Series:
        """Force on seat 1 or 2 [N], (3,), for `Simulation.load` on the nodes of that seat.

        Section 4: pressure times the ``area`` of the sensor [m^2], which `load` shares evenly by
        the nodes; ``down`` (3,) is the unit vector it acts along.
        """
        if not area > 0:
            raise ConditionError(f"an area of {area} m^2", where="rail seat",
                                 remedy="give the area of the pressure sensor")  # fmt: skip
        series = self.seat(number)
        return Series(self.time, area * series.values[:, None] * np.asarray(down, float))


def load_record_read(path: str | os.PathLike[str], rate: float | None = RATE) -> LoadRecord:
    """Read a table with columns ``time`` [s], ``rp1`` and ``rp2`` [Pa], or other units behind these
    names; see `trackbed.series_file`.

    Raises `ConditionError`, naming file and line: no file, no such column, no numbers, times that
    do not grow or not evenly, another sampling ``rate`` [Hz]; None takes any.
    """
    target = Path(path)
    where = f"load record {os.fspath(path)!r}"
    try:
        (time, *seats), _ = read_columns(target, ("time", *SEATS), (TIMES, *[PRESSURES] * 2))
    except (UsageError, LibraryMissing) as error:
        raise ConditionError(
            error.what,
            where=error.where or where,
            remedy="give a table with the columns time, rp1, rp2 in s and Pa, or their units "
            "behind them",
        ) from None
    try:
        record = LoadRecord(time, np.stack(seats, axis=1))
    except ConditionError as error:
        raise ConditionError(error.what, where=where, remedy=error.remedy) from None
    if rate is not None and abs(record.rate / rate - 1) > UNEVEN:
        raise ConditionError(
            f"it is sampled at {record.rate:g} Hz, not {rate:g} Hz",
            where=where,
            remedy=f"check that its time is in s, or read it with rate={record.rate:g} or None",
        )
    return record


def load_record_write(path: str | os.PathLike[str], record: LoadRecord) -> None:
    """Write a record as such a file, atomically; times to 0.1 us, pressures to nine digits."""
    rows = zip(record.time, record.pressure, strict=True)
    lines = (f"{time:.7f},{one:.9g},{two:.9g}\n" for time, (one, two) in rows)
    write_whole(Path(path), f"time,{','.join(SEATS)}\n" + "".join(lines))
