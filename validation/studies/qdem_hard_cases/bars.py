"""The figures of the record against the bars that stand beside them."""

from __future__ import annotations

from collections.abc import Sequence

from validation.bench.qdem.checks import checks_of
from validation.case import Check
from validation.study import Row


def check_bars(rows: Sequence[Row]) -> list[Check]:
    """Every figure of the record, judged anew."""
    return checks_of(rows, "docs/qdem-hard-cases.md")
