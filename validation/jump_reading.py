"""What the record of jump control on curves says: jumps within their tolerance, overspend."""

from __future__ import annotations

from typing import Any

import numpy as np

from validation import jump_study
from validation.jump_liggghts import Rows

BAR = 0.9
"""Share of jumps that are to hold their tolerance."""


def group(rows: Rows, name: str, **keys: Any) -> list[dict[str, Any]]:
    """Rows of a group with these values."""
    chosen = [row for row in rows if row["group"] == name]
    return [row for row in chosen if all(row[key] == value for key, value in keys.items())]


def total(rows: Rows, key: str) -> int:
    """Sum of a column."""
    return int(sum(row[key] for row in rows))


Setting = tuple[str, float, float]
"""Law, bursts and tolerance."""


def settings_of(rows: Rows) -> dict[Setting, list[dict[str, Any]]]:
    """Runs on curves by setting, those of other tolerances among them."""
    settings: dict[Setting, list[dict[str, Any]]] = {}
    for row in rows:
        if row["group"] in jump_study.BURSTS or (
            row["group"] == "tolerances" and row["tolerance"] != 0.02  # those are above already
        ):
            settings.setdefault((row["law"], row["bursts"], row["tolerance"]), []).append(row)
    return settings


def within(rows: Rows) -> float:
    """Share of the jumps of runs that hold their tolerance; nan without any jump."""
    jumps = total(rows, "jumps")
    return total(rows, "within") / jumps if jumps else float("nan")


def overspend_median(rows: Rows) -> float:
    """Cycles computed over the oracle's, median of the runs that have one; nan without any."""
    found = [row["computed"] / row["oracle"] for row in rows if row.get("oracle")]
    return float(np.median(found)) if found else float("nan")


def bursty(rows: Rows) -> list[dict[str, Any]]:
    """Runs on the curve of the demo's bed."""
    return [row for row in group(rows, "measured") if row["run"].startswith("coarse")]
