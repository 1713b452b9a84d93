"""docs/settlement-hard-cases.md is what its record says; a quick subset of the cases is run."""

from __future__ import annotations

from pathlib import Path

import pytest

from validation.settlement_hard_page import PAGE, page
from validation.settlement_hard_runs import Row, case_run, record_read
from validation.settlement_hard_scenes import CASES, QUICK, case_named

NOT_RIGHT: set[str] = set()
"""What the page says is not right."""


@pytest.fixture(scope="module")
def rows() -> list[Row]:
    return record_read()


def test_page_is_made_from_the_record(rows: list[Row]) -> None:
    """Made again, the page is the one that ships; every case is in it once, in order."""
    text = PAGE.read_text(encoding="utf-8")
    assert page(rows) == text
    assert "TABLE_" not in text
    assert [row["name"] for row in rows] == [case.name for case in CASES]


def test_every_case_ends_right_or_is_refused(rows: list[Row]) -> None:
    """All checks hold, but for the cases that the page calls not right; codes are README's."""
    failing = {row["name"] for row in rows if not all(check["ok"] for check in row["checks"])}
    assert failing == NOT_RIGHT
    for row in rows:
        case = case_named(row["name"])
        assert row["code"] == case.code
        assert row["code"] in (0, 3, 5, 6, 7)
        assert case.says in row["says"]


def test_friction_orders_packings(rows: list[Row]) -> None:
    """The more friction, the looser the bed and the fewer its contacts."""
    figures = {row["name"]: row["figures"] for row in rows if not row["code"]}
    order = [figures[name] for name in ("friction-0", "ordinary", "friction-1.5")]
    for name in ("density", "contacts"):
        values = [each[name] for each in order]
        assert values == sorted(values, reverse=True)


@pytest.mark.engine("liggghts")
@pytest.mark.parametrize("name", QUICK)
def test_quick_cases(tmp_path: Path, rows: list[Row], name: str) -> None:
    """Run again, a case ends as in the record, with the same reason or every check kept."""
    row = case_run(case_named(name), tmp_path / "run")
    assert all(check["ok"] for check in row["checks"])
    (kept,) = [each for each in rows if each["name"] == name]
    assert row["code"] == kept["code"]
