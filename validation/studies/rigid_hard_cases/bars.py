"""The bars: each of our rows has its own."""

from __future__ import annotations

from collections.abc import Sequence
from math import nan
from typing import Any

from validation.case import Check

Row = dict[str, Any]


def list_rows(rows: Sequence[Row]) -> list[Row]:
    """The rows of all families."""
    return [row for family in rows for row in family["rows"]]


def check_bars(rows: Sequence[Row]) -> list[Check]:
    """Ours against the bars."""
    return [
        Check(f"{row['case']}, {row['method']}: {row['measure']}",
              nan if row["value"] is None else row["value"], row["bar"], row["ok"], row["unit"])
        for row in list_rows(rows) if not row["peer"]
    ]  # fmt: skip
