"""The bars that the solvers' record misses, as ``trackbed validate rigid`` judges it."""

from __future__ import annotations

from collections.abc import Sequence

from validation import rigid_report as report
from validation.case import Check
from validation.cases.rigid import record_checks
from validation.rigid_report import OURS, Row


def bars_words(rows: Sequence[Row]) -> str:
    """How many bars hold, and a line for each that does not."""
    judged = [check for check in record_checks(rows) if check.bar != "reported"]
    missed = [check for check in judged if not check.holds]
    words = (
        f"`trackbed validate rigid` judges {len(judged)} bars on this record, and "
        f"{len(judged) - len(missed)} hold."
    )
    if not missed:
        return words
    lines = [f"- {check.name}: {_value(check)}, bar {check.bar}{_least(rows, check)}"
             for check in missed]  # fmt: skip
    return "\n".join([f"{words} These do not:", "", *lines])


def _value(check: Check) -> str:
    return f"{check.value:.3g} {check.unit}".rstrip()


def _least(rows: Sequence[Row], check: Check) -> str:
    """Why a lead is zero: the residual is not reached."""
    mine = report.of(report.problems(rows).get(check.name.partition(":")[0], []), OURS)
    if check.value > 0 or not mine:
        return ""
    asked = min(row["setting"]["tolerance"] for row in mine)
    return (
        f" (`solve_friction`, asked for {asked:.0e}, stops at {report.least_error(mine):.1e}, so "
        "it has no cost there)"
    )
