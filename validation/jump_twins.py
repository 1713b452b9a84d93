"""What each jump by tolerance errs by: the state it started from, computed cycle by cycle.

    python -m validation.jump_twins --work FOLDER [--members N]

FOLDER is that of `validation.jump_runs`, with the runs by tolerance in it.  From the end of the
window before each jump that stands, h + m cycles are computed, N times, one grain moved by a
member's 1e-10 m: *twins*, which part from one another by chaos alone.  Their mean is what the bed
would have gained; a line a twin goes to the record as it ends, the first twin of all jumps before
any second.  Goes on where the record ends.
"""

from __future__ import annotations

import argparse
import json
import shutil
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, fields, replace
from itertools import pairwise, takewhile
from pathlib import Path
from typing import Any

import numpy as np

from adapters.procedure import CONTROL
from adapters.provenance import commit, machine
from adapters.report_history import cost_total
from adapters.run_folder import Outcome
from adapters.stages import bed_behind, compute
from adapters.state import FloatArray
from validation import jump_runs
from validation.jump_liggghts import spans, tolerance_of, ways_told
from validation.jump_runs import STUDY
from validation.settlement_ensemble import STEP
from validation.settlement_rivals import run_in

RECORD = jump_runs.RESULTS / "jump-control-twins.jsonl"
MEMBERS = 6
"""Twins of a jump."""
WAYS = tuple(way for way in STUDY.ways if way.name.startswith("tolerance"))


@dataclass(frozen=True)
class Jump:
    """A jump that stands, with the healing cycles behind it, beside its twins; lengths in m."""

    way: str
    seed: int
    first: int
    last: int
    """Cycles N and N + h + m."""
    gained: float
    """Settlement between them."""
    settled: float
    """Since the rain, at the later."""
    made_good: float
    """What of the jump was to make good what the bed was ahead, or behind, by earlier jumps."""
    twins: FloatArray
    """Settlement of each twin between the same cycles, shape (members,)."""
    commit: str = ""
    """Of the code that computed the twins."""

    @property
    def allowed(self) -> float:
        """What the tolerance allows [m]."""
        return tolerance_of({"way": self.way}) * abs(self.settled)

    @property
    def error(self) -> float:
        """What it gained beyond the mean of its twins [m]."""
        return self.gained - float(self.twins.mean())

    @property
    def forecast_error(self) -> float:
        """The same without what was to make good earlier jumps [m]."""
        return self.error - self.made_good

    @property
    def within(self) -> bool:
        """Whether the forecast holds the tolerance, as the check behind a jump has it."""
        return abs(self.forecast_error) <= self.allowed

    @property
    def side(self) -> int:
        """1 where every twin gains more than the run, what was to make good earlier jumps left out,
        -1 where every twin gains less, else 0."""
        own = self.gained - self.made_good
        return int(self.twins.min() > own) - int(self.twins.max() < own)

    @property
    def twin_errors(self) -> FloatArray:
        """What each twin gained beyond the mean of the others [m], shape (members,)."""
        others = (self.twins.sum() - self.twins) / (len(self.twins) - 1)
        return np.asarray(self.twins - others)


def jumps_read(runs: Sequence[dict[str, Any]], rows: Sequence[dict[str, Any]]) -> list[Jump]:
    """Jumps of ``runs`` with at least two twins in ``rows``."""
    found = []
    for run in runs:
        for first, last, gained, settled in spans(run):
            mine = [
                row
                for row in rows
                if (row["way"], row["seed"], row["first"], row["last"])
                == (run["way"], run["seed"], first, last)
            ]
            if len(mine) >= 2:
                good = made_good_of(run, first)
                head = run["way"], run["seed"], first, last, gained, settled, good
                twins = np.array([row["gained"] for row in mine])
                found.append(Jump(*head, twins, mine[0].get("commit", "")))
    return found


def made_good_of(run: dict[str, Any], first: int) -> float:
    """Of the decision that the jump which stands from cycle ``first`` came of [m]."""
    stands = {(one["cycle"], one["attempt"]) for one in run["checks"] if one["accepted"]}
    return next(
        float(one["made_good"])
        for one in run["decisions"]
        if one["cycle"] == first and (one["cycle"], one["attempt"]) in stands
    )


@dataclass(frozen=True)
class Twin:
    """A computation from the state before a jump."""

    way: str
    seed: int
    first: int
    last: int
    """Cycles N and N + h + m."""
    member: int
    """From 1: how many times `STEP` one grain begins aside."""


def by_way(jumps: Sequence[Jump]) -> dict[str, list[Jump]]:
    """The jumps of each way by tolerance that has some."""
    ways = {way.name: [jump for jump in jumps if jump.way == way.name] for way in WAYS}
    return {way: these for way, these in ways.items() if these}


def twins_told(jumps: Sequence[Jump]) -> dict[str, str]:
    """What the twins say, for the page: shares of jumps within, of twins beside one another, and
    how often all twins lie on one side of the run."""
    ways = by_way(jumps)
    alone = 2 / (1 + MEMBERS)  # of so many equal draws one is the greatest or the least
    return {
        "twins": ways_told({way: [one.within for one in these] for way, these in ways.items()}),
        "twins_strict": ways_told(
            {way: [abs(one.error) <= one.allowed for one in these] for way, these in ways.items()}
        ),
        "twins_chaos": " and ".join(
            f"{np.mean([abs(one.twin_errors) <= one.allowed for one in these]):.0%} at {way}"
            for way, these in ways.items()
        ).replace("%", " %"),
        "twins_sum": " and ".join(
            f"{sum(o.gained - o.made_good for o in these) / sum(o.twins.mean() for o in these):.2f}"
            f" times what their twins do at {way}"
            for way, these in ways.items()
        ),
        "twins_sides": " and ".join(
            f"in {sum(one.side != 0 for one in these)} of {len(these)} jumps at {way} "
            f"(in {sum(one.side < 0 for one in these)} it gains more, in "
            f"{sum(one.side > 0 for one in these)} less; by chance in {alone * len(these):.0f})"
            for way, these in ways.items()
        ),
    }


def plan(work: Path, members: int) -> Iterator[Twin]:
    """Every twin of the runs in ``work``."""
    for member in range(1, members + 1):
        for way in WAYS:
            for seed in range(1, STUDY.seeds + 1):
                home = jump_runs.folder_of(way, seed, work)
                for first, last in jumps_of(home.outcomes()):
                    yield Twin(way.name, seed, first, last, member)


def jumps_of(outcomes: Sequence[Outcome]) -> Iterator[tuple[int, int]]:
    """First cycle of each jump of a finished run, and the last of the healing ones behind it."""
    for one, behind in pairwise(outcomes):
        if one.stage == "jump":
            healing = [*takewhile(lambda row: row["kind"] == "healing", behind.rows)]
            yield one.first_cycle, one.last_cycle + len(healing)


def twin_run(twin: Twin, work: Path) -> dict[str, float]:
    """What a twin gains [m], and what it costs [CPU s]."""
    way = next(one for one in WAYS if one.name == twin.way)
    home = jump_runs.folder_of(way, twin.seed, work)
    window = next(
        one for one in home.outcomes() if one.stage == "window" and one.last_cycle == twin.first
    )
    shutil.rmtree(work / "twin", ignore_errors=True)  # what the last one, or a kill, has left
    run = run_in(work / "twin", STUDY.scene(way, twin.seed), CONTROL)
    run.folder.share_start(home, 0)
    bed = bed_behind(home, f"window_{window.first_cycle:06d}", window)
    bed = replace(bed, start=replace(bed.start, perturbation=twin.member * STEP))
    done = run.folder.outcome(compute(run, bed, twin.last - twin.first).window)
    assert done is not None
    gained = done.rows[-1]["settlement"] - window.rows[-1]["settlement"]
    return {"gained": float(f"{gained:.7g}"), "cpu_s": round(cost_total(done.cost), 2)}


def main(words: Sequence[str] | None = None) -> None:
    """Read the command line and run what the record lacks."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--work", type=Path, required=True, help="folder of the runs by tolerance")
    parser.add_argument("--members", type=int, default=MEMBERS, help="twins of a jump")
    parser.add_argument("--record", type=Path, default=RECORD)
    given = parser.parse_args(words)
    names = [one.name for one in fields(Twin)]
    rows = jump_runs.record_read(given.record)
    done = {Twin(*(row[name] for name in names)) for row in rows}
    origin = {"commit": commit(), "machine": machine()}
    for twin in plan(given.work, given.members):
        if twin in done:
            continue
        row = asdict(twin) | twin_run(twin, given.work) | origin
        with given.record.open("a", encoding="utf-8") as stream:
            stream.write(json.dumps(row, separators=(",", ":")) + "\n")
        print(*asdict(twin).values(), row["gained"], row["cpu_s"], flush=True)


if __name__ == "__main__":
    main()
