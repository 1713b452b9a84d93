"""The page on contact between deformable bodies, written from its record.

    trackbed validate qdem-contact --json validation/results/qdem-contact.json     the record
    python -m validation.qdem_contact_page                          writes docs/qdem-contact.md

The words are in ``qdem_contact_page.md`` beside this file; every figure in them is looked up, as
``[[how the check's name begins | format]]``.  A test holds the page to the record.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

from validation.qdem_contact_hertz import CELLS, CLOSED_RADIUS, SIZE

ROOT = Path(__file__).parents[1]
WORDS = Path(__file__).with_suffix(".md")
RECORD = ROOT / "validation" / "results" / "qdem-contact.json"
PAGE = ROOT / "docs" / "qdem-contact.md"
FIGURE = re.compile(r"\[\[([^|\]]+?) \| ([^\]]+?)\]\]")


def record_read() -> dict[str, Any]:
    """The committed record."""
    found: dict[str, Any] = json.loads(RECORD.read_text(encoding="utf-8"))
    return found


def figure_of(checks: list[dict[str, Any]], start: str, form: str) -> str:
    """The value of the one check whose name begins so; raises `KeyError` for none or several."""
    found = [check for check in checks if check["name"].startswith(start)]
    if len(found) != 1:
        raise KeyError(f"{len(found)} checks begin with {start!r}")
    value = found[0]["value"]
    return "never" if value is None else format(value, form)


def table_of(checks: list[dict[str, Any]]) -> str:
    """All checks as a table."""
    lines = ["| check | value | bar |", "|---|---|---|"]
    for check in checks:
        value = (
            "none" if check["value"] is None else f"{check['value']:.3g} {check['unit']}".strip()
        )
        failed = "" if check["ok"] else " (fails)"
        lines.append(f"| {check['name']} | {value}{failed} | {check['bar']} |")
    return "\n".join(lines)


def page_text(record: dict[str, Any]) -> str:
    """The page for a record."""
    checks = record["checks"]
    text = WORDS.read_text(encoding="utf-8")
    for cells in CELLS:
        text = text.replace(f"[[cells {cells}]]", f"{CLOSED_RADIUS / (SIZE / (4 * cells)):.1f}")
    text = FIGURE.sub(lambda found: figure_of(checks, *found.groups()), text)
    origin = record["provenance"]
    made = f"`{origin['command']}` on {origin['machine']}, {origin['started'][:10]}."
    return text.replace("[[table]]", table_of(checks)).replace("[[made]]", made)


if __name__ == "__main__":
    PAGE.write_text(page_text(record_read()), encoding="utf-8")
