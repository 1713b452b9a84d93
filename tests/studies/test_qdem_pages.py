"""Pages of the QDEM studies are what their records make of them, and their bars hold."""

from __future__ import annotations

import pytest

from validation import study

pytestmark = pytest.mark.studies
NAMES = ["qdem-contact", "qdem-cost", "qdem-hard-cases", "qdem-track", "qdem-validation"]


@pytest.mark.parametrize("name", NAMES)
def test_a_page_is_written_from_its_record(name: str) -> None:
    rows = study.read_record(study.record_path(name))
    template = study.record_path(name).with_name("page.md").read_text(encoding="utf-8")
    page = study.fill_page(template, study.import_part(name, "page").describe(rows))
    assert (study.DOCS / f"{name}.md").read_text(encoding="utf-8") == page


@pytest.mark.parametrize("name", NAMES)
def test_bars_hold_and_every_part_is_recorded(name: str) -> None:
    rows = study.read_record(study.record_path(name))
    checks = study.import_part(name, "bars").check_bars(rows)
    assert [check.name for check in checks if not check.holds] == []
    assert [row["part"] for row in rows] == list(study.import_part(name, "run").PARTS)
