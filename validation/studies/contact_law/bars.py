"""Every check of every engine, from the record."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from validation.case import Check


def check_bars(rows: Sequence[dict[str, Any]]) -> list[Check]:
    """What each engine was measured to give, against its bar."""
    return [
        Check(one["name"], one["value"], one["bar"], one["ok"], page="docs/contact-law.md")
        for row in rows
        for one in row["checks"]
    ]
