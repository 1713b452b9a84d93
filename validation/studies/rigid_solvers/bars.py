"""The bars of the record: residuals reached, costs beside the rivals."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite, isinf

from validation.case import Check
from validation.studies.rigid_solvers import reading
from validation.studies.rigid_solvers.reading import Row
from validation.studies.rigid_solvers.run import HYBRID, OSQP, OURS

SECONDS, LEAD, ENDLESS = 1.0, 10.0, 1e9
"""Most that a stored problem may cost [s], least lead on Siconos, ratio where ours has no cost."""
WHY = "near yield many contacts slide at once: our path has thousands of factorisations there"
BEHIND = "Gauss-Seidel does well on loose beds of low friction; our plan starts with dearer steps"


def check_bars(rows: Sequence[Row]) -> list[Check]:
    """All bars on a record."""
    checks = []
    for family in dict.fromkeys(row["family"] for row in reading.select(rows)):
        checks += _check_family(family, [r for r in reading.select(rows) if r["family"] == family])
    for row in reading.list_packings(rows, 500, 5000):
        error = reading.find_least_error(row, "Siconos")
        if isfinite(error):
            lead = reading.find_cost(row, "Siconos", error) / reading.find_cost(row, OURS, error)
            title = f"{row['part']}: cost of the best of Siconos over ours, residual {error:.1g}"
            why = "" if lead >= LEAD else BEHIND
            checks.append(Check(title, lead, f">= {LEAD:g}", lead >= LEAD, why=why))
    beside = reading.list_packings(rows, 500, 5000) + reading.select(rows, reading.YIELDING)
    checks += _check_beside(beside, HYBRID)
    checks += _check_beside(reading.select(rows, "frictionless"), OSQP)
    return [*checks, *_check_examination(rows)]


def _check_family(family: str, rows: Sequence[Row]) -> list[Check]:
    missed = [row["part"] for row in rows if isinf(reading.find_cost(row, OURS))]
    named = f" ({', '.join(missed)})" if missed else ""
    why = WHY if family == reading.YIELDING else ""
    slowest = max(reading.find_cost(row, OURS) for row in rows)
    barred = family == "stored"
    checks = [Check(f"{family}: problems of {len(rows)} not brought to their bar{named}",
                    len(missed), "= 0", not missed, why=why)]  # fmt: skip
    if isfinite(slowest):
        bar = f"<= {SECONDS:g}" if barred else "reported"
        held = not barred or slowest <= SECONDS
        checks.append(Check(f"{family}: greatest cost of that", slowest, bar, held, "s"))
    return checks


def _check_beside(rows: Sequence[Row], rival: str) -> list[Check]:
    """Ours is not slower than a rival where that reaches the bar; an infinite ratio, where ours
    does not reach it at all, is reported as `ENDLESS`."""
    checks = []
    for row in rows:
        found = reading.list_ratios([row], rival)
        for name, ratio in found.items():
            why = WHY if row["family"] == reading.YIELDING else ""
            value = min(ratio, ENDLESS)
            title = f"{name}: cost of ours over that of {rival}"
            checks.append(Check(title, value, "<= 1", value <= 1, why=why))
    return checks


def _check_examination(rows: Sequence[Row]) -> list[Check]:
    found = reading.join_columns(rows)
    wrong = sum(claims and not ok for claims, ok in zip(found["claims"], found["ok"], strict=True))
    solved, all_of = sum(found["ok"]), len(found["ok"])
    return [
        Check("unseen problems: answers called solved that are not", wrong, "= 0", wrong == 0),
        Check(f"unseen problems: solved, of {all_of}", solved, "reported", True),
    ]
