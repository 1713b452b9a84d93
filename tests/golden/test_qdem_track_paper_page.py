"""docs/qdem-track-paper.md is what its command makes of the committed records."""

from __future__ import annotations

from validation.track_paper_page import PAGE, page, records


def test_page_is_the_records() -> None:
    """Byte for byte."""
    assert PAGE.read_text(encoding="utf-8") == page(*records())
