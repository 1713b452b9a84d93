"""Whether a bed goes on behind a jump as it went before it: no transient, no shock.

Settlement a cycle, coordination number and piston stiffness in the first cycles behind a jump,
healing cycles among them, beside the last cycles before it.  A bed without any jump drifts and
wanders too: over hundreds of cycles its coordination number changes by far more than ten cycles
scatter.  So what is judged is the change from before to behind, beside the changes of full runs
between the same cycles.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.special import stdtrit

from adapters.stages import Run
from adapters.state import FloatArray
from validation.move_study_engine import cycles_of

Row = dict[str, Any]
CYCLES = 10
"""On each side of a jump, at most."""
COLUMNS = ("settlement", "coordination_number", "piston_stiffness")
"""Settlement gained in each cycle [m], grains that touch a grain, N/m."""
PROBABILITY = 0.95
SCATTERS = 2.0
"""Standard deviations of single cycles before a jump, within which the rate behind it stays."""


def sides_of(run: Run) -> list[Row]:
    """Of every jump that stands: cycles ``first`` to ``last``, `COLUMNS` ``before`` and ``after``;
    ``hops``, and settlement ``asked`` for and its ``gain`` [m], where its grains changed places.

    As many of `CYCLES` as the windows on both sides of it have.
    Settlement is that of each cycle, in the first one of a window since the end of what came before
    it; a jump of no cycle ends with the cycle before it.
    """
    outcomes = run.folder.outcomes()
    found = []
    for place, jump in enumerate(outcomes[:-1]):
        if jump.stage != "jump":
            continue
        sides: Row = {"first": jump.first_cycle, "last": jump.last_cycle}
        if "hops" in jump.notes["relaxation"]:
            sides["hops"] = jump.notes["relaxation"]["hops"]
            sides |= {name: jump.notes[name] for name in ("asked", "gain")}
        for name, at in (("before", place - 1), ("after", place + 1)):
            table = cycles_of(run, f"window_{outcomes[at].first_cycle:06d}", slice(None))
            ends = [one.rows[-1]["settlement"] for one in outcomes[:at] if one.rows]
            path = np.array(table["settlement"])
            table["settlement"] = np.diff(path, prepend=ends[-1] if ends else 0.0).tolist()
            part = slice(-CYCLES, None) if name == "before" else slice(CYCLES)
            sides[name] = {column: table[column][part] for column in COLUMNS}
        found.append(sides)
    return found


def sides_without_jump(
    columns: Mapping[str, FloatArray], cycle: FloatArray, first: int, last: int
) -> Row:
    """The same of a run that computed every cycle: `CYCLES` up to ``first`` and behind ``last``."""
    gains = dict(columns) | {"settlement": np.diff(columns["settlement"], prepend=np.nan)}
    inside = {
        "before": (cycle > first - CYCLES) & (cycle <= first),
        "after": (cycle > last) & (cycle <= last + CYCLES),
    }
    sides: Row = {"first": first, "last": last}
    for name, rows in inside.items():
        sides[name] = {column: gains[column][rows].tolist() for column in COLUMNS}
    return sides


def like(sides: Row, other: Row) -> Row:
    """The sides of a full run cut to the cycles that a jump's ``sides`` know: windows are short.

    The last cycles before and the first behind; nan where the jump's own are.
    """
    cut: Row = {"first": other["first"], "last": other["last"]}
    for name in ("before", "after"):
        cut[name] = {}
        for column in sides[name]:
            mine, full = (np.array(one[name][column], float) for one in (sides, other))
            full = full[-len(mine) :] if name == "before" else full[: len(mine)]
            cut[name][column] = np.where(np.isfinite(mine), full, np.nan)
    return cut


def change_of(sides: Row, column: str, skipped: int = 0) -> float:
    """Mean behind a jump, or behind so many ``skipped`` cycles more, less mean before it.

    Settlement a cycle is multiplied by the cycle's number, the slope of the logarithm: that a bed
    slows down is no transient.  A cycle that is not known (nan) is left out: records made before
    November 2026 lack the first of a window.
    """
    before, after = (np.array(sides[name][column], float) for name in ("before", "after"))
    if column == "settlement":
        before = before * (sides["first"] - len(before) + 1 + np.arange(len(before)))
        after = after * (sides["last"] + 1 + np.arange(len(after)))
    return float(np.nanmean(after[skipped:]) - np.nanmean(before))


def continues(change: float, others: FloatArray) -> bool:
    """Whether the change over a jump is one that full runs have between the same cycles.

    ``others``: their changes, shape (n,), two at least; the bound is Student's for one more of the
    same kind, t s sqrt(1 + 1/n), at `PROBABILITY`.
    """
    bound = stdtrit(len(others) - 1, (1 + PROBABILITY) / 2) * others.std(ddof=1)
    bound *= np.sqrt(1 + 1 / len(others))
    return bool(abs(change - others.mean()) <= bound)


def stays(sides: Row, column: str, skipped: int) -> bool:
    """Whether the mean behind a jump and ``skipped`` cycles is one that single cycles before it
    have: within two of their standard deviations of their mean.

    No full run is asked, and a bed need not slow down: what is called no shock, and less than
    `continues`.
    """
    return abs(scatters_off(sides, column, skipped)) <= SCATTERS


def scatters_off(sides: Row, column: str, skipped: int, slowing: bool = False) -> float:
    """Mean behind a jump and ``skipped`` cycles less that before it, in standard deviations of
    single cycles before it; ``slowing``: less what cycles behind it settle by the same slope of
    ln N, where that is less a cycle."""
    before, after = (np.array(sides[name][column], float) for name in ("before", "after"))
    known, behind = np.isfinite(before), after[skipped:]
    expected = before[known].mean()
    if slowing:
        number = sides["first"] - len(before) + 1 + np.arange(len(before))
        later = sides["last"] + 1 + skipped + np.arange(len(behind))
        expected = (before * number)[known].mean() * (1 / later).mean()
    return float((behind.mean() - expected) / before[known].std(ddof=1))
