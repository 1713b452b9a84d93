"""What beds settle more behind jumps on the engine, over what they were moved by.

A table of docs/jump-history.md, and figures of docs/jump-control.md, from the records of jumps.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from adapters.state import FloatArray
from validation import jump_runs
from validation.page_text import table
from validation.paper_convergence import JUMPED, STILL
from validation.paper_convergence_runs import STUDY as CONVERGENCE
from validation.settlement_rivals_continuity import CYCLES
from validation.settlement_rivals_runs import record_read
from validation.settlement_rivals_studies import STUDIES

Row = dict[str, Any]


@dataclass(frozen=True, eq=False)
class Behind:
    """A jump of a run and the cycles on both sides of it."""

    run: str
    packing: str
    """Packings scatter by themselves; runs of one and jumps of a run do not."""
    first: int
    """Cycle at whose end it begins,"""
    last: int
    """and at whose end it ends."""
    moved: float
    """What it moved the mean grain down by, G [m]."""
    before: FloatArray
    """Settlement of each of the last cycles before it [m], shape (b,)."""
    after: FloatArray
    """The same of the first cycles behind it [m], shape (a,)."""
    unmoved: float = 0.0
    """What the first cycle behind a jump of this packing settles more with nothing moved [m]."""

    @property
    def more(self) -> FloatArray:
        """What cycles behind it settle beyond the logarithm of those before [m], shape (a,)."""
        middle = self.first - (len(self.before) - 1) / 2
        slope = middle * self.before.mean()
        return np.asarray(self.after - slope / (self.last + np.arange(1, len(self.after) + 1)))

    @property
    def weight(self) -> float:
        """Sum of 1 / n over the cycles behind it from the second on."""
        return float((1 / np.arange(2, len(self.after) + 1)).sum())


def of_rivals(study: str, method: str) -> list[Behind]:
    """Jumps of a way of a study of rivals; moved by nothing where none is recorded."""
    found = []
    for row in record_read(STUDIES[study].record):
        if row["part"] != "rivals" or row["method"] != method:
            continue
        moved = [gain for _, gain in row["moved"]] or [0.0] * len(row["sides"])
        for sides, gain in zip(row["sides"], moved, strict=True):
            before, after = (np.array(sides[side]["settlement"]) for side in ("before", "after"))
            known = before[np.isfinite(before)]  # the first cycle behind k_i has none before it
            packing, first, last = str(row["seed"]), sides["first"], sides["last"]
            run = f"{packing}-{row['member']}"
            found.append(Behind(run, packing, first, last, gain, known, after))
    return found


def beside_unmoved(study: str, method: str, still: str) -> list[Behind]:
    """The same, with what jumps of a way that moves nothing settle more, by packing."""
    more = defaultdict(list)
    for one in of_rivals(study, still):
        more[one.packing].append(one.more[0])
    return [
        replace(one, unmoved=float(np.mean(more[one.packing]))) for one in of_rivals(study, method)
    ]


def of_convergence(ways: Sequence[str]) -> list[Behind]:
    """Jumps of ways of Figs 11 and 12: one bed at paper scale, by the law."""
    rows = {row["way"]: row["rows"] for row in jump_runs.record_read(CONVERGENCE.record)}
    return [one for way in ways for one in jumps_of(way, rows[way])]


def jumps_of(run: str, rows: Sequence[Sequence[Any]]) -> Iterator[Behind]:
    """Jumps among rows (cycle, what it is, settlement [m], ...); "j" is the end of a jump.  All
    are of one packing, so runs stand in for packings."""
    cycle = [row[0] for row in rows]
    settlement = np.array([row[2] for row in rows])
    ends = [place for place, row in enumerate(rows) if row[1] == "j"]
    for number, place in enumerate(ends):
        begin = ends[number - 1] if number else 0
        stop = ends[number + 1] if number + 1 < len(ends) else len(rows)
        before = np.diff(settlement[begin:place])[-CYCLES:]
        after = np.diff(settlement[place:stop])[:CYCLES]
        moved = float(settlement[place] - settlement[place - 1])
        yield Behind(run, run, cycle[place - 1], cycle[place], moved, before, after)


@dataclass(frozen=True)
class Way:
    """A line of the table."""

    bed: str
    words: str
    read: Callable[[], list[Behind]]


PAPER_SCALE = "paper scale"
LAW, LAW_STILL = "by the law, `smoothed`, k 10 to 40, h 5 to 50", "nothing moved, k 20, h 10"
SMOOTHED, PROFILE = "by history, `smoothed`", "by history, `profile`"
GROWING, STILL_COARSE = f"{PROFILE}, 5 growing", "nothing moved, 10 equal"
TOLERANCE = "`tolerance` 0.1, `smoothed`"
RIVALS = (
    (PAPER_SCALE, GROWING, "confined", "5 growing jumps, by history, profile"),
    (PAPER_SCALE, f"{PROFILE}, 3 growing", "confined", "3 growing jumps, by history, profile"),
    ("partial", f"{SMOOTHED}, 1 jump", "partial", "1 jumps, by history"),
    ("partial", f"{PROFILE}, 1 jump", "partial", "1 jumps, by history, profile"),
)
"""Bed, jumps in words, study of rivals, name there."""
STILL_NAME = "10 jumps, nothing moved"
RIVALS_COARSE = (
    (TOLERANCE, "tolerance 0.1"),
    (f"{SMOOTHED}, 5 equal", "5 jumps, by history"),
    (f"{PROFILE}, 5 equal", "5 jumps, by history, profile"),
)
"""Jumps of the coarse bed in words, name in its study."""
WAYS = (
    Way(PAPER_SCALE, LAW, partial(of_convergence, JUMPED)),
    Way(PAPER_SCALE, LAW_STILL, partial(of_convergence, (STILL,))),
    *(Way(bed, words, partial(of_rivals, *where)) for bed, words, *where in RIVALS),
    Way("coarse", STILL_COARSE, partial(of_rivals, "coarse", STILL_NAME)),
    *(
        Way("coarse", words, partial(beside_unmoved, "coarse", name, STILL_NAME))
        for words, name in RIVALS_COARSE
    ),
)


def first_share(jumps: Sequence[Behind]) -> float:
    """What first cycles behind jumps settle more than with nothing moved, over what the beds were
    moved by [-]."""
    return float(sum(one.more[0] - one.unmoved for one in jumps) / sum(one.moved for one in jumps))


def later_share(jumps: Sequence[Behind]) -> float:
    """kappa of the cycles from the second on [-]: what they settle more over the sum of G / n."""
    return float(
        sum(one.more[1:].sum() for one in jumps) / sum(one.moved * one.weight for one in jumps)
    )


def with_error(
    jumps: Sequence[Behind], share: Callable[[Sequence[Behind]], float]
) -> tuple[float, float]:
    """A share and its standard error, by leaving out one packing at a time (jackknife)."""
    packings = dict.fromkeys(one.packing for one in jumps)
    without = np.array([share([one for one in jumps if one.packing != name]) for name in packings])
    error = np.sqrt((len(packings) - 1) * without.var())
    return share(jumps), float(error)


def told(jumps: Sequence[Behind], share: Callable[[Sequence[Behind]], float]) -> str:
    """The same in words; a dash where nothing was moved."""
    if not any(one.moved for one in jumps):
        return "-"
    return "{:+.2f} ± {:.2f}".format(*with_error(jumps, share))


def way_jumps(bed: str, words: str) -> list[Behind]:
    """Jumps of a line of the table."""
    (way,) = (one for one in WAYS if (one.bed, one.words) == (bed, words))
    return way.read()


def mean_first(jumps: Sequence[Behind]) -> float:
    """Settlement of the first cycle behind a jump, mean [m]."""
    return float(np.mean([one.after[0] for one in jumps]))


TOLD = {
    "LAW": (PAPER_SCALE, LAW),
    "PROFILE": (PAPER_SCALE, GROWING),
    "COARSE": ("coarse", TOLERANCE),
}
"""Lines of the table that pages tell of in words, by the name of their marks."""


def shares_told(*names: str) -> dict[str, str]:
    """Marks ``NAME_FIRST`` and ``NAME_KAPPA`` of lines of `TOLD`, and what stands there."""
    found = {}
    for name in names:
        jumps = way_jumps(*TOLD[name])
        found[f"{name}_FIRST"] = told(jumps, first_share)
        found[f"{name}_KAPPA"] = told(jumps, later_share)
    return found


def table_behind() -> str:
    """A line a way: what first cycles settle, and by what shares of G they settle more."""
    lines = []
    for way in WAYS:
        jumps = way.read()
        means = (
            np.mean([one.moved for one in jumps]),
            np.mean([one.before.mean() for one in jumps]),
            mean_first(jumps),
        )
        lines.append(
            [
                way.bed, way.words, str(len({one.run for one in jumps})), str(len(jumps)),
                *(f"{1e6 * value:.1f}" for value in means),
                told(jumps, first_share), told(jumps, later_share),
            ]
        )  # fmt: skip
    head = ["bed", "jumps", "runs", "number", "G, µm", "a cycle before, µm", "first cycle, µm",
            "more in the first, G", "κ, cycles 2 to 10"]  # fmt: skip
    return table(head, lines)
