"""One period of a measured load: a CSV file with the columns time (s) and stress (Pa)."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from adapters.bed import FloatArray
from adapters.errors import SceneError, UsageError
from trackbed.series_file import TIMES, read_columns

PRESSURES = ("Pa", "kPa", "MPa")
SPACING_TOLERANCE = 1e-6
"""Greatest departure of a time interval from the median one, relative."""


@dataclass(frozen=True)
class LoadSeries:
    """One period of a load, sampled evenly; the last sample is the first of the next period."""

    time: FloatArray  # times [s], shape (n + 1,)
    stress: FloatArray  # stress on the loaded area [Pa], shape (n + 1,); first = last

    @property
    def period(self) -> float:
        """Duration of the series [s]."""
        return float(self.time[-1] - self.time[0])

    def stress_at(self, phase: float | FloatArray) -> FloatArray:
        """Stress [Pa] at a ``phase`` in periods (any real number), linear between samples."""
        sample = np.linspace(0.0, 1.0, len(self.stress))
        return np.asarray(np.interp(np.mod(phase, 1.0), sample, self.stress))


def read_load_series(path: Path) -> LoadSeries:
    """Read one period from a table with the columns ``time`` and ``stress``, in s and Pa or with
    other units of them behind their names; see `trackbed.series_file`.

    Raises `SceneError`, which names file and line, unless there are at least three rows, evenly
    spaced in time, finite, without tension, and the last stress is the first.
    """

    remedy = "give one period as columns time,stress (s, Pa)"

    def refuse(what: str, line: int | None = None) -> SceneError:
        where = str(path) if line is None else f"{path}:{line}"
        return SceneError(what, where=where, remedy=remedy)

    try:
        (time, stress), lines = read_columns(path, ("time", "stress"), (TIMES, PRESSURES))
    except UsageError as error:
        raise SceneError(error.what, where=error.where, remedy=remedy) from error
    if (stress < 0).any():
        row = int(np.argmax(stress < 0))
        raise refuse(f"stress {stress[row]:g} Pa is negative: a piston can not pull", lines[row])
    if len(time) < 3:
        raise refuse(f"one period needs at least three rows, found {len(time)}")
    interval = np.diff(time)
    usual = float(np.median(interval))
    uneven = ~(np.abs(interval - usual) <= SPACING_TOLERANCE * usual)
    if uneven.any():
        first = int(np.argmax(uneven))
        raise refuse(
            f"times must grow by even steps: this one by {interval[first]:g} s, "
            f"the usual step is {usual:g} s",
            lines[first + 1],
        )
    if stress[0] != stress[-1]:
        raise refuse(
            f"the last stress, {stress[-1]:g} Pa, must be the first, {stress[0]:g} Pa", lines[-1]
        )
    return LoadSeries(time, stress)
