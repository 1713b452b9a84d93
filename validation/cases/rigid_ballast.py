"""A ballast bed in the plane, poured, tamped and loaded cyclically: rigid against soft grains.

    trackbed validate rigid-ballast            judges the record, after the runs that it lacks
    trackbed validate rigid-ballast --quick    two small beds, three cycles: under a minute

What comes out in words and pictures: ``docs/rigid-ballast.md``.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from validation.case import Check
from validation.rigid_ballast_bed import Bed
from validation.rigid_ballast_judge import (
    FEWEST,
    WITHIN,
    cheapest,
    cost_ratio,
    gain_most,
    limits_of,
    summaries,
)
from validation.rigid_ballast_runs import (
    BEDS,
    CONTROLS,
    CYCLES,
    LEVELS,
    LONG,
    PUSHED,
    QUICK_LEVELS,
    RECORD,
    rows_read,
    study,
)

Row = dict[str, Any]
OVERLAP, PAPER_STEP = 1e-6, 1e-3
"""Greatest overlap of rigid grains at the end of a step, as a share of the smallest stone [-], and
the step [s] from which on energy may not be gained."""
SMALLEST = 0.025
"""Diameter of the smallest stone [m]."""
UPRIGHT = 1e-3
"""Angle by which the sleeper may turn in a run [rad]."""


def run(quick: bool) -> list[Check]:
    """All checks; the quick form makes runs of its own."""
    if quick:
        rows: list[Row] = []
        beds = [Bed(seed, stones=30, crib=3, width=0.28, sleeper=0.12, peak=16e3)
                for seed in (1, 2)]  # fmt: skip
        study(beds, QUICK_LEVELS, 3, rows, rows.append)
        return record_checks(rows)
    rows = rows_read(RECORD)
    beds = [Bed(seed) for seed in range(1, BEDS + 1)]
    study(beds, LEVELS, CYCLES, rows, rows.append, CONTROLS, PUSHED, LONG)
    return record_checks(rows)


def record_checks(rows: Sequence[Row]) -> list[Check]:
    """What must hold of every rigid run, and what came out."""
    ours = [row for row in rows if row["kind"] == "rigid"]
    soft = [row for row in rows if row["kind"] == "soft"]
    lost = sum(not row["ok"] for row in ours)
    lost += sum(row["kind"] == "no bed" for row in rows)
    blown = sum(not row["ok"] for row in soft)
    ours = [row for row in ours if row["ok"]]
    fine = [row for row in ours if row["level"]["value"] <= PAPER_STEP]
    checks = [
        Check("rigid runs and beds that did not go to their end", lost, "= 0", lost == 0),
        Check("the sleeper's turn, held by the rail", max(abs(row["tilt"]) for row in ours),
              f"<= {UPRIGHT:g}", all(abs(row["tilt"]) <= UPRIGHT for row in ours), "rad"),
        Check("soft runs that did not go to their end", blown, "reported", True),
        Check("rigid: deepest approach at the middle of a step, of the smallest stone",
              max(row["overlap"] for row in ours) / SMALLEST, "reported", True),
        *overlap_checks(ours),
        Check("rigid: energy gained in a cycle, of the greatest loss in one, any step",
              gain_most(ours), "reported", True),
        *([Check("rigid: the same, steps of 1 ms and less", gain_most(fine), "<= 0.01",
                 gain_most(fine) <= 0.01)] if fine else []),
    ]  # fmt: skip
    residual = max(row["residual"] / row["level"]["extra"] for row in ours)
    checks.append(Check("rigid: worst residual of any step, of that asked for", residual,
                        "reported", True))  # fmt: skip
    return [*checks, *limit_checks(rows)]


def overlap_checks(ours: Sequence[Row]) -> list[Check]:
    """Overlap at the ends of steps, of runs that recorded it."""
    ends = [row["overlap_after"] / SMALLEST for row in ours if "overlap_after" in row]
    if not ends:
        return []
    return [Check("rigid: greatest overlap at the end of half a cycle, of the smallest stone",
                  max(ends), f"<= {OVERLAP:g}", max(ends) <= OVERLAP)]  # fmt: skip


def limit_checks(rows: Sequence[Row]) -> list[Check]:
    """The reference, every level's error, and the cost at equal error."""
    limits = limits_of(rows)
    found = summaries(rows, limits)
    scale = abs(limits.mean)
    ensemble = len(limits.reference) >= FEWEST  # two small beds may heave
    checks = [
        Check("mean settlement of the reference", limits.mean, "> 0" if ensemble else "reported",
              not ensemble or limits.mean > 0, "m"),
        Check("the two limits: their difference, of the mean", limits.difference / scale,
              "reported", True),
        Check("half width of its 95 % interval", limits.interval / scale, "reported", True),
    ]  # fmt: skip
    for s in found:
        checks.append(Check(f"{s.method}, {s.name}: error of the mean settlement", s.error,
                            "reported", True))  # fmt: skip
        checks.append(Check(f"{s.method}, {s.name}: cost of a run", s.cost, "reported", True, "s"))
    for most in WITHIN:
        ours, theirs = (cheapest(found, method, most, True) for method in ("rigid", "soft"))
        if ours is not None and theirs is not None:
            checks.append(Check(f"cost of soft over rigid grains, errors shown within {most:g}",
                                cost_ratio(theirs, ours)[0], "reported", True))  # fmt: skip
    return [*checks, *rest_checks(rows)]


def rest_checks(rows: Sequence[Row]) -> list[Check]:
    """Rigid beds at rest under the least load keep still before the first cycle; a few small ones
    may not have come to rest."""
    mine = [row for row in rows if row["kind"] == "rigid" and row["ok"]]
    found = float(np.median([abs(row["rest_drift"]) for row in mine]))
    few = len({row["bed"]["seed"] for row in mine}) < FEWEST
    return [Check("rigid: median drift in 50 ms under the least load", found,
                  "reported" if few else "<= 1e-05", few or found <= 1e-5, "m")]  # fmt: skip
