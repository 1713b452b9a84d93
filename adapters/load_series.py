"""One period of a measured load: a CSV file with the columns time (s) and stress (Pa)."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from math import isfinite
from pathlib import Path

import numpy as np

from adapters.errors import SceneError
from adapters.state import FloatArray

SPACING_TOLERANCE = 1e-6
"""Greatest departure of a time interval from the median one, relative."""


@dataclass(frozen=True)
class LoadSeries:
    """One period of a load, sampled evenly; the last sample is the first of the next period."""

    time: FloatArray
    """Times [s], shape (n + 1,)."""
    stress: FloatArray
    """Stress on the loaded area [Pa], shape (n + 1,); first = last."""

    @property
    def period(self) -> float:
        """Duration of the series [s]."""
        return float(self.time[-1] - self.time[0])

    def stress_at(self, phase: float | FloatArray) -> FloatArray:
        """Stress [Pa] at a ``phase`` in periods (any real number), linear between samples."""
        sample = np.linspace(0.0, 1.0, len(self.stress))
        return np.asarray(np.interp(np.mod(phase, 1.0), sample, self.stress))


def load_series_read(path: Path) -> LoadSeries:
    """Read one period from a CSV file with the header ``time,stress`` (s, Pa).

    Raises `SceneError`, which names file and line, unless there are at least three rows, evenly
    spaced in time, finite, without tension, and the last stress is the first.
    """

    def refuse(what: str, line: int | None = None) -> SceneError:
        where = str(path) if line is None else f"{path}:{line}"
        return SceneError(
            what, where=where, remedy="give one period as columns time,stress (s, Pa)"
        )

    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            reader = csv.reader(stream)
            rows = [(reader.line_num, row) for row in reader if any(cell.strip() for cell in row)]
    except OSError as error:
        raise refuse(f"can not read the load series ({error.strerror})") from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise refuse(f"this is not a text file of comma-separated values ({error})") from error
    header = [cell.strip() for cell in rows[0][1]] if rows else []
    if header != ["time", "stress"]:
        raise refuse("the first line must be time,stress", rows[0][0] if rows else None)
    values = []
    for line, row in rows[1:]:
        try:
            time, stress = (float(cell) for cell in row)
        except ValueError:
            raise refuse(f"expected two numbers, found {','.join(row)!r}", line) from None
        if not (isfinite(time) and isfinite(stress)):
            raise refuse("time and stress must be finite", line)
        if stress < 0:
            raise refuse(f"stress {stress:g} Pa is negative: a piston can not pull", line)
        values.append((line, time, stress))
    if len(values) < 3:
        raise refuse(f"one period needs at least three rows, found {len(values)}")
    lines, time_, stress_ = (np.array(column) for column in zip(*values, strict=True))
    interval = np.diff(time_)
    usual = float(np.median(interval))
    uneven = ~(np.abs(interval - usual) <= SPACING_TOLERANCE * usual)
    if uneven.any():
        first = int(np.argmax(uneven))
        raise refuse(
            f"times must grow by even steps: this one by {interval[first]:g} s, "
            f"the usual step is {usual:g} s",
            int(lines[first + 1]),
        )
    if stress_[0] != stress_[-1]:
        raise refuse(
            f"the last stress, {stress_[-1]:g} Pa, must be the first, {stress_[0]:g} Pa",
            int(lines[-1]),
        )
    return LoadSeries(time_, stress_)
