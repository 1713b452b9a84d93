"""docs/settlement-rivals.md is what its record says, and its sentences hold in the record."""

from __future__ import annotations

import pytest

from validation.settlement_rivals import METHODS, Row
from validation.settlement_rivals_budget import PARTS
from validation.settlement_rivals_page import PAGE, page
from validation.settlement_rivals_runs import LAST, key, record_read


@pytest.fixture(scope="module")
def rows() -> list[Row]:
    return record_read()


def test_page_is_made_from_the_record(rows: list[Row]) -> None:
    """Made again, the page is the one that ships."""
    text = PAGE.read_text(encoding="utf-8")
    assert page(rows) == text
    assert PAGE.with_suffix(".png").exists()


def test_record_holds_what_the_study_names(rows: list[Row]) -> None:
    """Each run once; the reference whole; no method and no part that the code does not know."""
    assert len({key(row) for row in rows}) == len(rows)
    reference = {(row["seed"], row["member"]) for row in rows if row["part"] == "reference"}
    assert len(reference) == 10
    rivals = {row["method"] for row in rows if row["part"] == "rivals"}
    assert rivals <= {method.name for method in METHODS}
    assert {row["method"] for row in rows if row["part"] == "budget"} <= {p.name for p in PARTS}
    assert all(row["last"] == LAST for row in rows if row["part"] != "budget")
