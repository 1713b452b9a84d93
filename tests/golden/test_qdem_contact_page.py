"""docs/qdem-contact.md is what its command makes of the committed record."""

from __future__ import annotations

from validation.qdem_contact_page import PAGE, page_text, record_read


def test_page_is_the_records() -> None:
    """Byte for byte; a figure that the record lacks is an error."""
    assert PAGE.read_text(encoding="utf-8") == page_text(record_read())


def test_bars_of_the_record_hold() -> None:
    """Checks with a bar meet it; those that are only reported say so."""
    checks = record_read()["checks"]
    assert [
        check["name"] for check in checks if check["bar"] != "reported" and not check["ok"]
    ] == []
    assert len(checks) > 15
