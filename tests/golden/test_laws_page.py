"""docs/laws.md is what its record says, number for number."""

from __future__ import annotations

import pytest

from adapters.laws import laws_known
from validation.law_page import FORMS, PAGE, page, row_of
from validation.law_study import LAWS, Row, record_read


@pytest.fixture(scope="module")
def rows() -> list[Row]:
    return record_read()


def test_page_is_made_from_the_record(rows: list[Row]) -> None:
    """Made again, the page is the one that ships; every law that ships is in it."""
    text = PAGE.read_text(encoding="utf-8")
    assert page(rows) == text
    assert "{{" not in text
    assert set(LAWS) == set(laws_known()) <= set(FORMS)


def test_sentences_about_errors(rows: list[Row]) -> None:
    """On real ballast auto beats each law in the 90th percentile, and both rivals in the median."""
    auto = row_of(rows, "ballast")
    others = [row for row in rows if row["source"] == "ballast" and row["method"] != "auto"]
    assert all(auto["error_90"] < row["error_90"] for row in others)
    for name in ("polyfit", "curve_fit"):
        assert 3 * auto["error"] < row_of(rows, "ballast", name)["error"]
    assert row_of(rows, "fast")["refused"] >= 0.95 * row_of(rows, "fast")["cases"]
