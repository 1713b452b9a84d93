"""The bars of the way that is judged, from the record: chosen with the record in sight."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from validation.case import Check
from validation.studies.settlement.beds import COARSE, CONFINED, EVERY, KINDS
from validation.studies.settlement.reading import (
    find_errors,
    find_speedup,
    find_spread,
    find_step_speedup,
    judge_layers,
    select_rows,
    summarise_reference,
)

JUDGED = "5 growing jumps, by history, profile"
"""At paper scale."""
JUDGED_COARSE = "5 jumps, by history"


def check_max(name: str, value: float, bar: float, unit: str = "", why: str = "") -> Check:
    """A value that may not exceed its bar."""
    return Check(name, value, f"<= {bar:g}", value <= bar, unit, "docs/settlement.md", why)


def check_min(name: str, value: float, bar: float, unit: str = "") -> Check:
    """A value that may not fall below its bar."""
    return Check(name, value, f">= {bar:g}", value >= bar, unit, "docs/settlement.md")


def check_bars(rows: Sequence[dict[str, Any]]) -> list[Check]:
    """Enough full runs, and the judged jumps beside them."""
    checks = []
    for kind in KINDS.values():
        runs = select_rows(rows, kind, EVERY)
        checks += [
            check_min(f"{kind.name}: full runs", len(runs), kind.packings * kind.members),
            check_min(f"{kind.name}: packings", len({row["seed"] for row in runs}), kind.packings),
        ]
    truth = summarise_reference(rows, CONFINED, "settlement")
    error = abs(float(find_errors(rows, CONFINED, JUDGED, "settlement").mean()))
    name = f"confined, {JUDGED}"
    checks += [
        check_max(
            f"{name}: error of the mean over half the full runs' interval, these packings",
            error * truth.mean / truth.half_given, 1.0,
        ),
        check_max(f"{name}: spread over the full runs'", find_spread(rows, CONFINED, JUDGED), 1.3),
        check_max(f"{name}: density profile", 100 * judge_layers(rows, CONFINED, JUDGED), 2.0, "%"),
    ]  # fmt: skip
    for figure, bar in (("coordination number", 3.0), ("elastic deflection", 2.0)):
        value = 100 * abs(float(find_errors(rows, CONFINED, JUDGED, figure).mean()))
        checks.append(check_max(f"{name}: {figure}", value, bar, "%"))
    checks += [
        check_min(f"{name}: cheaper by", find_speedup(rows, CONFINED, JUDGED), 5.0),
        check_min(
            f"{name}: cheaper by, at equal cost a step",
            find_step_speedup(rows, CONFINED, JUDGED), 5.0,
        ),
    ]  # fmt: skip
    truth = summarise_reference(rows, COARSE, "settlement")
    error = abs(float(np.mean(find_errors(rows, COARSE, JUDGED_COARSE, "settlement"))))
    name = f"coarse, {JUDGED_COARSE}: error of the mean over what chaos alone makes"
    return [*checks, check_max(name, error * truth.mean / truth.alone, 1.0)]
