"""The table of docs/export.md is that of its record."""

from __future__ import annotations

import json
from pathlib import Path

from validation.cases.export_cost import page_table

ROOT = Path(__file__).parents[2]


def test_page_has_the_record() -> None:
    """Sizes, costs and shares, as `trackbed validate export-cost --json` wrote them."""
    record = json.loads((ROOT / "validation" / "results" / "export-cost.json").read_text())
    assert all(check["ok"] for check in record["checks"])
    page = (ROOT / "docs" / "export.md").read_text()
    assert page_table(record["checks"]) in page
    kept = next(check for check in record["checks"] if "kept by the run" in check["name"])
    grains = kept["name"].split(",")[1].split()[0]
    assert f"{int(grains):,} grains" in page
    assert f"{kept['value'] / 1e3:.0f} kB" in page
