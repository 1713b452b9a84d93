"""docs/qdem-cost.md against the committed record, and the record against what must hold."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from validation import qdem_work_report as report
from validation.cases.qdem_cost import cost_checks
from validation.qdem_work_precision import RECORD, plan
from validation.qdem_work_words import table

ROWS = report.rows_read(RECORD)
WORDS = " ".join(
    (Path(__file__).parents[2] / "docs" / "qdem-cost.md").read_text(encoding="utf-8").split()
)


def said(sentence: str) -> None:
    """The page has this sentence, whatever its line breaks."""
    assert " ".join(sentence.split()) in WORDS


def finest(question: str, name: str) -> report.Row:
    """A family's run on its finest mesh."""
    return max(report.family(ROWS, question, name), key=lambda row: row["elements"])


def test_the_record_is_complete_and_holds() -> None:
    """Every run of the plan, none other, and every bar."""
    assert len(ROWS) == len(plan(quick=False)) + len(report.LEVELS)
    assert all(check.holds for check in cost_checks(ROWS, finest=3))


def test_repeats_are_as_said() -> None:
    """Five below two seconds, three above."""
    for row in ROWS:
        if row["method"] != "reference":
            assert len(row["repeats_s"]) == (5 if row["repeats_s"][0] < 2 else 3)
            assert row["cost_s"] == pytest.approx(np.median(row["repeats_s"]))


@pytest.mark.parametrize("question", report.LEVELS)
def test_tables(question: str) -> None:
    """The page's tables are those of the record."""
    assert " ".join(table(ROWS, question).split()) in WORDS
