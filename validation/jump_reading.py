"""What the records of jump control say: jumps within their tolerance, overspend, errors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from validation import jump_study

Rows = Sequence[dict[str, Any]]
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


def overspend(rows: Rows) -> float:
    """Cycles computed over the oracle's, median of the runs that have one; nan without any."""
    found = [row["computed"] / row["oracle"] for row in rows if row.get("oracle")]
    return float(np.median(found)) if found else float("nan")


def bursty(rows: Rows) -> list[dict[str, Any]]:
    """Runs on the curve of the demo's bed."""
    return [row for row in group(rows, "measured") if row["run"].startswith("coarse")]


def observed(runs: Rows) -> tuple[int, int]:
    """Jumps that stand of runs by one tolerance: how many erred by no more than that, and all."""
    tolerance = float(runs[0]["way"].split()[-1])
    errors = [check["error"] for run in runs for check in run["checks"] if check["accepted"]]
    return sum(abs(error) <= tolerance for error in errors), len(errors)


def settlement_of(run: dict[str, Any]) -> float:
    """Settlement at the last cycle of a run of the record [m]."""
    return float(run["rows"][-1][2])


def liggghts_error(run: dict[str, Any], runs: Rows) -> float | None:
    """Against the full run of the same seed; None where that is not there yet."""
    full = [one for one in runs if one["way"] == "full" and one["seed"] == run["seed"]]
    return settlement_of(run) / settlement_of(full[0]) - 1 if full else None


def band_of_record(run: dict[str, Any]) -> Any:
    """The band of a run with a tolerance; None for another."""
    from adapters.jump_band import band_of

    if not run["decisions"]:
        return None
    held = [check for check in run["checks"] if check["accepted"]]
    return band_of(int(run["rows"][-1][0]), settlement_of(run), held)
