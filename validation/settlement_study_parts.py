"""Bars of the settlement study on its parts: laws, jump control, hard cases, relaxation.

The values are those of the pages, by the same functions; `validation.settlement_study` says which
bars are known to be missed, and why.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import nan
from typing import Any

import numpy as np

from adapters.state import FloatArray
from validation import (
    jump_runs,
    jump_study,
    jump_twins,
    law_study,
    relaxation_runs,
    settlement_hard_runs,
)
from validation.case import Check
from validation.cases.laws import ALARM_BAR, JUDGED, source_checks
from validation.jump_liggghts import observed, overspend, realised
from validation.jump_paper import WAY, paper_jumps
from validation.jump_reading import (
    BAR,
    bursty,
    group,
    overspend_median,
    settings_of,
    total,
    within,
)
from validation.law_page import NAMES, row_of
from validation.relaxation_reading import (
    TITLES,
    by_way,
    gained,
    of_answers,
    point_carried,
    refused,
    values,
)
from validation.settlement_ensemble_record import EnsembleRecord
from validation.settlement_hard_page import failing
from validation.settlement_hard_scenes import CASES
from validation.settlement_rivals_runs import record_read
from validation.settlement_rivals_studies import STUDIES

LAWS, JUMPS = "docs/laws.md", "docs/jump-control.md"
HARD, RELAXATION = "docs/settlement-hard-cases.md", "docs/relaxation.md"
NUMBER_OF_LAWS, SEEDS = 8, 5
DEFAULT = "smallest-move"
"""The relaxation of a run that names none."""
CONTACTS = 3.0
"""Most that a relaxation may change contacts a grain by [%]."""
ALTERNATIVES = 4
"""Damped steps, an engine's minimiser, FIRE and L-BFGS."""

Row = dict[str, Any]


def at_least(name: str, value: float, bound: float, page: str, unit: str = "") -> Check:
    """A value that is to reach its bar."""
    return Check(name, value, f">= {bound:g}", value >= bound, unit, page)


def reported(name: str, value: float, page: str, unit: str = "") -> Check:
    """A value without a bar."""
    return Check(name, value, "reported", True, unit, page)


def mean_of(held: Sequence[bool] | FloatArray) -> float:
    """Share of what holds; nan for none."""
    return float(np.mean(held)) if len(held) else nan


def law_checks(rows: Sequence[Row] | None = None) -> list[Check]:
    """Laws together on real ballast and on series made with a seed that nothing was chosen on."""
    rows = law_study.record_read() if rows is None else rows
    known = {row["method"] for row in rows} & set(law_study.LAWS) - {"karrech2007"}
    checks = [at_least("laws: how many", len(known), NUMBER_OF_LAWS, LAWS)]
    judged = (*JUDGED, "other cuts")
    for source in judged:
        row, where = row_of(rows, source), f"laws, {NAMES[source]}"
        found = source_checks(source, row, row["cases"] + row["refused"], judged, where)
        checks += [replace(check, page=LAWS) for check in found]
    fast = row_of(rows, "fast")
    share = fast["refused"] / fast["cases"]
    return [
        *checks,
        at_least("laws, constant or growing rate: share refused", share, ALARM_BAR, LAWS),
    ]


def jump_checks(
    rows: Sequence[Row] | None = None,
    runs: Sequence[Row] | None = None,
    twins: Sequence[Row] | None = None,
    paper: Sequence[Row] | None = None,
) -> list[Check]:
    """Jumps within the tolerance by which they chose themselves."""
    rows = jump_study.record_read() if rows is None else rows
    runs = jump_runs.record_read() if runs is None else runs
    twins = jump_runs.record_read(jump_twins.RECORD) if twins is None else twins
    paper = record_read(STUDIES["confined"].record) if paper is None else paper
    held_there = [one.within for one in paper_jumps(paper, EnsembleRecord())]
    known = jump_twins.by_way(jump_twins.jumps_read(runs, twins))
    settings = settings_of(rows)
    every = [row for these in settings.values() for row in these]
    measured = group(rows, "measured")
    stiff = [row for row in measured if row not in bursty(rows)]
    least = min(map(within, settings.values()), default=nan)
    seeds = min((len({row["seed"] for row in these}) for these in settings.values()), default=0)
    held = total(every, "mean_inside") / len(every) if every else nan
    checks = [
        at_least("jump control, curves: jumps within the tolerance", within(every), BAR, JUMPS),
        at_least(
            f"jump control, curves: the same, least of {len(settings)} settings", least, BAR, JUMPS
        ),
        at_least("jump control, curves: fewest seeds of a setting", seeds, SEEDS, JUMPS),
        at_least("jump control, curves: bands that hold the mean bed", held, BAR, JUMPS),
        reported(
            "jump control, curves: cycles computed over the oracle's",
            overspend_median(every),
            JUMPS,
        ),
        at_least("jump control, curves of stiff full runs: within", within(stiff), BAR, JUMPS),
        at_least(
            "jump control, curve of the demo's full run: within", within(bursty(rows)), BAR, JUMPS
        ),
    ]
    ways = {way: [run for run in runs if run["way"] == way] for way in {run["way"] for run in runs}}
    for way in sorted(way for way in ways if way.startswith("tolerance")):
        these = ways[way]
        where, (inside, jumps) = f"jump control on LIGGGHTS, {way}", observed(these)
        gained = [one for run in these for one in realised(run, runs)]
        spent = [one for run in these if (one := overspend(run, runs)) is not None]
        checks += [
            at_least(f"{where}: observed within", inside / jumps if jumps else nan, BAR, JUMPS),
            at_least(
                f"{where}: as the bed itself would have gained",
                mean_of([one.within for one in known.get(way, ())]), BAR, JUMPS,
            ),
            at_least(f"{where}: as the full run gained", mean_of(gained), BAR, JUMPS),
            reported(
                f"{where}: cycles computed over the oracle's",
                float(np.median(spent)) if spent else nan, JUMPS,
            ),
        ]  # fmt: skip
    seeds = min((len({run["seed"] for run in these}) for these in ways.values()), default=0)
    fewest = "jump control on LIGGGHTS: fewest seeds of a way"
    there = f"jump control at paper scale, {WAY}: as the packing's full runs gained"
    return [
        *checks,
        at_least(fewest, seeds, SEEDS, JUMPS),
        at_least(there, mean_of(held_there), BAR, JUMPS),
    ]


def hard_checks(rows: Sequence[Row] | None = None) -> list[Check]:
    """Each hard case ends right, or is refused with a reason."""
    rows = settlement_hard_runs.record_read() if rows is None else rows
    known = {row["name"]: float(len(failing(row))) for row in rows}
    return [
        Check(
            f"hard case, {case.title}: checks that do not hold", known.get(case.name, nan),
            "= 0", known.get(case.name) == 0, "", HARD,
        )
        for case in CASES
    ]  # fmt: skip


def relaxation_checks(rows: Sequence[Row] | None = None) -> list[Check]:
    """The default relaxation beside what a user would take."""
    rows = relaxation_runs.record_read() if rows is None else rows
    paper, beds = by_way(rows, "paper"), by_way(rows, "bed")
    others = sum(way in paper for way in TITLES if way != DEFAULT)
    reached = [point_carried(paper, DEFAULT, bed) for bed in paper[DEFAULT]]
    points = [point for point in reached if point is not None]
    ends = [row["points"][-1] for row in paper[DEFAULT].values()]
    left = len(reached) - len(points)
    changes = np.abs(values(points, "coordination_error"))
    contacts = 100 * float(np.median(changes)) if points else nan
    lost = len(refused(beds, DEFAULT))
    spring = 100 * of_answers(beds, DEFAULT, "tangential_start").mean()
    first = gained(beds, DEFAULT, 0, 1).mean()
    return [
        at_least("relaxation: ways beside it", others, ALTERNATIVES, RELAXATION),
        Check("relaxation: jumps left with a greater overlap than before", left, "= 0", left == 0,
              "", RELAXATION),
        Check("relaxation: contacts a grain, change where overlaps are back", contacts,
              f"<= {CONTACTS:g}", contacts <= CONTACTS, "%", RELAXATION),
        reported("relaxation: CPU time at its end", float(np.median(values(ends, "cpu_s"))),
                 RELAXATION, "s"),
        Check(f"relaxation: live beds that the engine refuses, of {len(beds[DEFAULT])}",
              lost, "= 0", lost == 0, "", RELAXATION),
        reported("relaxation: tangential force at the restart over that before", spring,
                 RELAXATION, "%"),
        reported("relaxation: settlement in the first cycle behind the jump", first, RELAXATION,
                 "m"),
    ]  # fmt: skip
