"""Pages of rigid contact are those of their records, and no bar fails unless that is known."""

from __future__ import annotations

import pytest

from validation.study import DOCS, fill_page, import_part, read_record, record_path

pytestmark = pytest.mark.studies


@pytest.mark.parametrize(
    "name", ["rigid-solvers", "rigid-hard-cases", "rigid-indeterminacy", "rigid-ballast"]
)
def test_page_and_bars(name: str) -> None:
    rows = read_record(record_path(name))
    template = record_path(name).with_name("page.md").read_text(encoding="utf-8")
    page = fill_page(template, import_part(name, "page").describe(rows))
    assert DOCS.joinpath(f"{name}.md").read_text(encoding="utf-8") == page
    checks = import_part(name, "bars").check_bars(rows)
    assert [check.name for check in checks if not (check.holds or check.known)] == []
