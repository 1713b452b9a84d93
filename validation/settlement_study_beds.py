"""Bars of the settlement study on beds: its reference, and the best way of jumping on each.

The values are those of the pages, by the same functions; `validation.settlement_study` says which
bars are known to be missed, and why.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import nan

import numpy as np

from validation.case import Check
from validation.settlement_bars import (
    BARS,
    BARS_CONTINUITY,
    BARS_PARTIAL,
    Bar,
    bias,
    bias_beside_interval,
    sides_compared,
)
from validation.settlement_ensemble import COARSE, CONFINED, KINDS, PARTIAL
from validation.settlement_ensemble_record import EnsembleRecord
from validation.settlement_far_jumps import CHEAPER, cheaper
from validation.settlement_far_page import COMPUTED, FAR, Foretold, outlook_far, study
from validation.settlement_partial_page import way
from validation.settlement_rivals import Row
from validation.settlement_rivals_reading import cheaper_even, finished, reference
from validation.settlement_rivals_runs import record_read
from validation.settlement_rivals_studies import STUDIES
from validation.settlement_study_parts import at_least, mean_of, reported

ENSEMBLE, RIVALS = "docs/settlement-ensemble.md", "docs/settlement-rivals.md"
PARTLY, FAR_PAGE = "docs/settlement-partial.md", "docs/settlement-far.md"
CHOSEN = {
    "confined": "5 growing jumps, by history, profile",
    "partial": "1 jumps, by history, profile, seated for 4",
    "far": "13 growing jumps, by history, profile, rearranged",
}
"""The way that is judged on each bed: the best of its study, chosen with the record in sight."""
BEDS = {"confined": "confined", "partial": "partial", "far": f"coarse, cycle {COARSE.last:,}"}
"""The beds of these studies in words."""
MEMBERS = {"confined": 5, "partial": 3, "coarse": 10}
"""Full runs to a kind's last cycle that are asked for."""
PACKINGS = 3
BYTES = 10e6
"""Most that a run may take in the record."""
COVERAGE = 90.0
"""Share of bands of 90 % that are to have the truth [%]."""


def bar_check(bed: str, bar: Bar, rows: Sequence[Row], page: str) -> Check:
    """A bar of the chosen way; beside it what full runs between the same cycles have."""
    name, last = CHOSEN[bed], STUDIES[bed].last
    value = bar.value(rows, name, last)
    asked = f"{'>=' if bar.least else '<='} {bar.bound:g}"
    if bar.full is not None:
        asked += f" (full runs: {bar.full(rows, name, last):.0f})"
    return Check(f"{BEDS[bed]}: {bar.words}", value, asked, bar.met(value), bar.unit, page)


def ensemble_checks() -> list[Check]:
    """Full runs of the reference that came to their last cycle, and what they take."""
    record, found = EnsembleRecord(), []
    for name, kind in KINDS.items():
        pieces = [piece for piece in kind.runs() if piece.member is not None]
        kept = {piece: record.kept(piece.name) for piece in pieces}
        whole = [piece for piece, one in kept.items() if one and one.cycle >= piece.last]
        packings = len({piece.seed for piece in whole})
        for what, value, asked in (
            ("members", len(whole), MEMBERS[name]), ("packings", packings, PACKINGS),
        ):  # fmt: skip
            words = f"reference, {name}: {what} to cycle {kind.last:,}"
            found.append(Check(words, value, f">= {asked}", value >= asked, "", ENSEMBLE))
    sizes = [
        sum(path.stat().st_size for path in record.path.glob(f"{piece.name}.*"))
        for kind in KINDS.values()
        for piece in kind.runs()
    ]
    largest = max(sizes, default=0) / 1e6
    words = "reference: greatest size of a run in the record"
    most = f"<= {BYTES / 1e6:g}"
    return [*found, Check(words, largest, most, largest <= BYTES / 1e6, "MB", ENSEMBLE)]


def confined_checks(rows: Sequence[Row] | None = None) -> list[Check]:
    """The bed of the paper to cycle 500; either bar of the bias is enough."""
    rows = record_read(STUDIES["confined"].record) if rows is None else rows
    rows, last = sides_compared(rows, CONFINED, EnsembleRecord()), STUDIES["confined"].last
    share, half = (of(rows, CHOSEN["confined"], last) for of in (bias, bias_beside_interval))
    total, interval = (bar.bound for bar in BARS[:2])
    either = Check(
        "confined: bias over half the reference's interval",
        half, f"<= {interval:g}, or at most {total:g} % of the total (has {share:.1f})",
        half <= interval or share <= total, "", RIVALS,
    )  # fmt: skip
    return [either, *(bar_check("confined", bar, rows, RIVALS) for bar in BARS[2:])]


def partial_checks(rows: Sequence[Row] | None = None) -> list[Check]:
    """The bed under a piston that covers a part of it, to cycle 100."""
    rows = record_read(STUDIES["partial"].record) if rows is None else rows
    rows = sides_compared(rows, PARTIAL, EnsembleRecord())
    return [bar_check("partial", bar, rows, PARTLY) for bar in BARS_PARTIAL]


def far_checks(rows: Sequence[Row] | None = None) -> list[Check]:
    """The coarse bed: jumps to cycle 10,000, and laws with their bands, to a million too."""
    rows = record_read(STUDIES["far"].record) if rows is None else rows
    name, last, record = CHOSEN["far"], STUDIES["far"].last, EnsembleRecord()
    mine, bed = finished(rows, name, last), BEDS["far"]
    saved = cheaper(rows, name, last) if mine else nan
    even = cheaper_even(mine, reference(rows, last)) if mine else nan
    compared = sides_compared(rows, COARSE, record)
    return [
        bar_check("far", BARS[1], compared, FAR_PAGE),
        at_least(f"{bed}: cheaper by", saved, CHEAPER, FAR_PAGE),
        at_least(f"{bed}: cheaper by, at equal cost a step", even, CHEAPER, FAR_PAGE),
        *(bar_check("far", bar, compared, FAR_PAGE) for bar in (*BARS[2:6], *BARS_CONTINUITY)),
        *band_checks(record),
    ]  # fmt: skip


def band_checks(record: EnsembleRecord) -> Iterator[Check]:
    """Laws with their bands: to a million cycles, and tested where runs have gone further."""
    _, seen = outlook_far(record)
    low, high, prediction = (float(each[-1]) for each in (seen.low, seen.high, seen.prediction))
    width = 100 * (high - low) / 2 / prediction
    yield reported(
        f"coarse, cycle {FAR:,}: half of the band from {COMPUTED:,} cycles, over the prediction",
        width, FAR_PAGE, "%",
    )  # fmt: skip
    given, every = (100 * share for share in covered_of(study(record)))
    words = "bands that have the truth, where they are"
    yield at_least(f"{words} given", given, COVERAGE, FAR_PAGE, "%")
    yield reported(f"{words} refused, too", every, FAR_PAGE, "%")


def covered_of(tests: Sequence[Foretold]) -> tuple[float, float]:
    """Share of bands that have the truth [-]: of predictions that are not refused, and of all."""
    covered, trusted = (
        np.concatenate([getattr(one, what) for one in tests]) for what in ("covered", "trusted")
    )
    return mean_of(covered[trusted == 1]), mean_of(covered)


def chosen_told() -> str:
    """Which way is judged on which bed, in words."""
    return "; ".join(f"{bed}: {way(name)}" for bed, name in CHOSEN.items())
