"""Pages of the studies are what their records make of them; no bar fails unless that is known."""

from __future__ import annotations

import pytest

from validation.age import list_excuses
from validation.study import DOCS, find_record, import_part, list_studies, make_page, read_record

pytestmark = pytest.mark.studies


@pytest.mark.parametrize("name", list_studies())
def test_page_and_bars(name: str) -> None:
    rows = read_record(find_record(name))
    assert DOCS.joinpath(f"{name}.md").read_text(encoding="utf-8") == make_page(name, rows)
    checks = import_part(name, "bars").check_bars(rows)
    assert [check.name for check in checks if not (check.holds or check.known)] == []


@pytest.mark.parametrize("name", [name for name in list_studies() if name.startswith("qdem")])
def test_every_part_is_recorded_and_a_missed_bar_says_why(name: str) -> None:
    rows = read_record(find_record(name))
    parts = list(import_part(name, "run").PARTS)
    measured = [row["part"] for row in rows]
    assert measured == [part for part in parts if part in measured]
    assert measured == parts or name in list_excuses()  # which its page repeats
    assert all(one.holds or one.known for one in import_part(name, "bars").check_bars(rows))
