"""docs/jump-control.md is what its records say."""

from __future__ import annotations

from validation import jump_runs, jump_study
from validation.jump_page import PAGE, page


def test_page_is_made_from_the_records() -> None:
    """Made again, the page is the one that ships."""
    made = page(jump_study.record_read(), jump_runs.record_read())
    assert made == PAGE.read_text(encoding="utf-8")
    assert "{{" not in made
