"""A run as a table of its cycles with their cost, from its stages; and what failed jumps lost."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from datetime import datetime
from itertools import pairwise
from math import isfinite, nan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from adapters.bed import FloatArray, IntArray
from adapters.errors import UsageError
from adapters.files import Outcome, RunFolder, place_stage

AVERAGED = 10
"""Computed cycles at the end over which coordination number and deflection are averaged: both
scatter from one cycle to the next."""


@dataclass(frozen=True)
class History:
    """A run at the ends of its cycles, r rows in ascending cycles; nan where not measured."""

    cycle: IntArray
    kind: tuple[str, ...]  # ``computed``, ``healing`` or ``jumped``
    loaded_body: FloatArray  # permanent settlement of the loaded body since the preparation [m]
    stiffness: FloatArray  # secant stiffness under the whole loaded body [N/m]
    settlement: FloatArray  # that of the mean grain since the preparation [m]
    coordination_number: FloatArray  # contacts with other grains, mean over all grains
    elastic_deflection: FloatArray  # rise of the piston on unloading [m]
    cpu_s: FloatArray  # CPU time from the start of loading to the row [s]

    def row(self, cycle: int) -> int:
        """Index of a cycle's row; raises `UsageError` when it was not computed."""
        found = np.flatnonzero(self.cycle == cycle)
        if not len(found):
            raise UsageError(f"there is no row of cycle {cycle}")
        return int(found[0])

    def count_computed(self, cycle: int) -> int:
        """Cycles computed until ``cycle``: rows that are not jumps."""
        return int(((self.cycle <= cycle) & self.engine_rows).sum())

    @property
    def engine_rows(self) -> NDArray[np.bool_]:
        """Which rows the engine computed, shape (r,)."""
        return np.array([kind != "jumped" for kind in self.kind], bool)

    def gain(self, first: int, last: int, of: str = "settlement") -> float:
        """Settlement ``of`` a column between two cycles [m], 0 for the preparation; nan unless both
        are there."""
        if not {first, last} <= {0, *self.cycle.tolist()}:
            return nan
        start, end = (getattr(self, of)[self.row(n)] if n else 0.0 for n in (first, last))
        return float(end - start)

    def gain_error(
        self, settlement: float, before: int, cycle: int, of: str = "settlement"
    ) -> float:
        """Error of a ``settlement`` [m] at ``cycle`` over what was gained since ``before``; its own
        zero, the piston at rest by chance, is no measure.  nan where nothing was gained."""
        gained = self.gain(before, cycle, of)
        return (settlement - self.gain(0, cycle, of)) / abs(gained) if gained else nan

    def late_mean(self, name: str, cycle: int) -> float:
        """Mean of a column over the computed rows among the last `AVERAGED` cycles to ``cycle``."""
        late = (self.cycle > cycle - AVERAGED) & (self.cycle <= cycle) & self.engine_rows
        values = getattr(self, name)[late]
        values = values[np.isfinite(values)]
        return float(values.mean()) if len(values) else nan


def make_plain(value: Any) -> Any:
    """The same in types that JSON has; None for numbers that are not finite."""
    if isinstance(value, dict):
        return {key: make_plain(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [make_plain(inner) for inner in value]
    if isinstance(value, np.generic):
        return make_plain(value.item())
    return None if isinstance(value, float) and not isfinite(value) else value


def sum_cost(cost: Mapping[str, float]) -> float:
    """CPU time of a stage [s]; ``start_up`` is a part of ``engine``."""
    return sum(seconds for purpose, seconds in cost.items() if purpose != "start_up")


def find_speed_up(full_s: float, procedure_s: float) -> float:
    """S = T_full / T_procedure, of CPU times; see `adapters.report.error`."""
    return full_s / procedure_s if procedure_s > 0 else nan


def make_history(
    outcomes: Sequence[Outcome], lost: Sequence[tuple[int, float]] = (), loaded_start: float = nan
) -> History:
    """The table of a run from its stages; a window's cost is spread evenly over its cycles.

    ``lost``: after which cycle failed attempts lost how much CPU time [s].  ``loaded_start``:
    height of the loaded body before the first cycle [m], for rows of version 0.2, which know its
    heights alone; where that is not known, its settlement counts from the first row.  The
    preparation has no rows and is left out of the cost.
    """
    rows, cpu, spent = [], [], 0.0
    for outcome in outcomes:
        if outcome.stage == "preparation":
            continue
        cost = sum_cost(outcome.cost)
        for number, row in enumerate(outcome.rows, start=1):
            rows.append(row)
            failed = sum(seconds for cycle, seconds in lost if cycle < row["cycle"])
            cpu.append(spent + failed + cost * number / len(outcome.rows))
        spent += cost
    columns = {
        column.name: np.array([_read_number(row.get(column.name)) for row in rows])
        for column in fields(History)[2:-1]
    }
    if not np.isfinite(columns["loaded_body"]).all():
        heights = np.array([_read_number(row.get("piston_height")) for row in rows])
        columns["loaded_body"] = (loaded_start if isfinite(loaded_start) else heights[0]) - heights
    return History(
        cycle=np.array([row["cycle"] for row in rows], np.int64),
        kind=tuple(row["kind"] for row in rows),
        **columns,
        cpu_s=np.array(cpu),
    )


def _read_number(value: object) -> float:
    return float(value) if isinstance(value, int | float) else nan


@dataclass(frozen=True)
class FailedJump:
    """A jump that was given up."""

    stage: str
    first_cycle: int
    why: str
    lost_s: float  # what it cost and no finished stage bears [s]; see `find_lost_time`


def list_failed_jumps(folder: RunFolder) -> tuple[FailedJump, ...]:
    """The jumps of a run that were given up, in order."""
    events, found = folder.events(), []
    for stage in folder.stage_names():
        if why := folder.failure(stage):
            lost = folder.failure_details(stage).get("lost_s")  # noted where it was taken back
            if lost is None:
                lost = find_lost_time(stage, folder.outcome(stage), events)
            found.append(FailedJump(stage, place_stage(stage)[0], why, float(lost)))
    return tuple(found)


def find_lost_time(stage: str, outcome: Outcome | None, events: Sequence[dict[str, Any]]) -> float:
    """Time of a failed jump that no finished stage bears [s].

    Python's own goes over to the next stage.  A jump that was finished and then failed in the
    window behind it lost its own cost and the engine's, of which only the elapsed time is known:
    from the event before the failure to the failure.
    """
    if outcome is None:
        return 0.0
    lost = sum_cost(outcome.cost)
    for before, event in pairwise(events):
        if event["event"] == "jump failed" and event.get("stage") == stage:
            ended, began = (datetime.fromisoformat(e["time"]) for e in (event, before))
            lost += (ended - began).total_seconds()
    return lost
