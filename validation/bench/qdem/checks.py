"""Figures of a trial with their bars, as rows of a record keep them and as pages tell them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from math import isfinite, nan
from typing import Any

import numpy as np

from validation.case import UNBARRED, Check
from validation.study import Row, format_table

RANGE = re.compile(r"(\S+) to (\S+)")
WITHIN = re.compile(r"= (\S+) within (\S+) %")


def check_below(name: str, value: float, bar: float, unit: str = "", why: str = "") -> Check:
    """A value that must stay below its bar; ``why`` it does not, where that is known."""
    holds = bool(value < bar)
    return Check(name, float(value), f"< {bar:g}", holds, unit, why="" if holds else why)


def check_near(name: str, value: float, target: float, share: float, unit: str = "") -> Check:
    """A value that must be within a share of its target."""
    good = abs(value / target - 1) < share
    return Check(name, float(value), f"= {target:.6g} within {100 * share:g} %", bool(good), unit)


def check_between(name: str, value: float, low: float, high: float, unit: str = "") -> Check:
    """A value that must lie between two bars."""
    return Check(name, float(value), f"{low:g} to {high:g}", bool(low <= value <= high), unit)


def report(name: str, value: float, unit: str = "") -> Check:
    """A value without a bar."""
    return Check(name, float(value), "reported", True, unit)


def fit_order(sizes: Sequence[float], errors: Sequence[float]) -> float:
    """Order of convergence: slope of log error over log size, by least squares."""
    return float(np.polyfit(np.log(sizes), np.log(np.abs(errors)), 1)[0])


def meets(value: float, bar: str) -> bool:
    """Whether a value meets a bar as it is written: ``< x``, ``>= x``, ``a to b``; else True."""
    if not isfinite(value):
        return False
    if bar in UNBARRED:
        return True
    if found := RANGE.fullmatch(bar):
        return float(found[1]) <= value <= float(found[2])
    if found := WITHIN.fullmatch(bar):
        return abs(value / float(found[1]) - 1) < float(found[2]) / 100
    sign, bound = bar.split()[:2]
    limit = float(bound)
    return {"<": value < limit, "<=": value <= limit, ">": value > limit, ">=": value >= limit,
            "==": value == limit}[sign]  # fmt: skip


# --- rows of a record ---------------------------------------------------------------------------


def make_row(checks: Sequence[Check], **more: Any) -> Row:
    """A row of a record: figures as ``[name, value, bar, unit]``, no finite number as null."""
    return {
        "figures": [[c.name, c.value if isfinite(c.value) else None, c.bar, c.unit] for c in checks]
    } | more


def list_checks(rows: Sequence[Row], page: str = "") -> list[Check]:
    """The figures of all rows, each against its bar."""
    return [
        Check(name, value, bar, meets(value, bar), unit, page)
        for row in rows
        for name, number, bar, unit in row["figures"]
        for value in [nan if number is None else float(number)]
    ]


def find_check(checks: Sequence[Check], start: str) -> Check:
    """The check whose name begins so (``*``: anything): of several one that fails, else the worst.

    KeyError for none.
    """
    found = [check for check in checks if fnmatchcase(check.name, f"{start}*")]
    if not found:
        raise KeyError(f"the record has no figure {start}")
    failing = [check for check in found if not check.holds]
    least = min if "order" in start else max
    return least(failing or found, key=lambda check: check.value)


def describe_checks(checks: Sequence[Check], points: Mapping[str, str]) -> str:
    """A table of figures: ``points`` gives each a sentence and how its name begins."""
    lines = []
    for words, start in points.items():
        check = find_check(checks, start)
        bar = "" if not check.barred else check.asked
        whole = check.value.is_integer() and check.value >= 1000
        said = f"{check.value:{',.0f' if whole else '.3g'}} {check.unit}".rstrip()
        lines.append([words, bar, said if check.holds else f"{said}: **missed**"])
    return format_table(["what", "bar", "measured"], lines)


def describe_origin(rows: Sequence[Row]) -> str:
    """Where and when the rows were made."""
    origins = [row["origin"] for row in rows]
    machines = sorted({origin["machine"] for origin in origins})
    dates = sorted({origin["started"][:10] for origin in origins})
    days = " to ".join(dict.fromkeys((dates[0], dates[-1])))
    hours = sum(row.get("cpu_s") or 0.0 for row in rows) / 3600
    spent = f", {hours:.2g} h of processor time" if hours else ""
    return f"{days}, {', '.join(machines)}{spent}."
