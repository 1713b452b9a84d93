"""Figures quoted in README against the committed records, and these against their tables."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
RESULTS = ROOT / "validation" / "results"


def rows_of(name: str) -> list[dict[str, str]]:
    with (RESULTS / name).open() as stream:
        return list(csv.DictReader(stream))


def lines_of(name: str) -> list[dict[str, object]]:
    return [json.loads(line) for line in (RESULTS / name).read_text().splitlines()]


def test_error_of_the_record_follows_from_its_tables() -> None:
    """Settlement error = run over control - 1 at the last cycle both have."""
    run = {int(r["cycle"]): float(r["settlement"]) for r in rows_of("settlement-karrech.run.csv")}
    control = {
        int(r["cycle"]): float(r["settlement"]) for r in rows_of("settlement-karrech.control.csv")
    }
    last = max(run.keys() & control.keys())
    line = next(
        line
        for line in lines_of("settlement-karrech.jsonl")
        if (line["method"], line["error_kind"]) == ("this run", "settlement_error")
    )
    assert line["cycle"] == last >= 100
    assert line["error"] == pytest.approx(run[last] / control[last] - 1, rel=1e-12)


def test_control_computes_every_cycle() -> None:
    """The control's table has no gap and no jump."""
    rows = rows_of("settlement-karrech.control.csv")
    assert [int(row["cycle"]) for row in rows] == list(range(1, 201))
    assert {row["kind"] for row in rows} == {"computed"}


def test_readme_quotes_the_record() -> None:
    """Speed-up and errors in README are those of the record, rounded."""
    line = {
        str(line["error_kind"]): line
        for line in lines_of("settlement-karrech.jsonl")
        if line["method"] == "this run"
    }
    quoted = re.search(
        r"jumps of 60 and 30 cycles\*\* \| (\d+) \| \*\*([\d.]+)\*\* \| \*\*([+-][\d.]+) %\*\*"
        r" \| \*\*([+-][\d.]+) %\*\* \| ([\d.]+) %",
        (ROOT / "README.md").read_text(),
    )
    assert quoted is not None
    settlement = line["settlement_error"]
    assert int(quoted[1]) == settlement["work"]
    assert float(quoted[2]) == pytest.approx(settlement["speed_up"], abs=0.005)
    assert float(quoted[3]) == pytest.approx(100 * float(str(settlement["error"])), abs=0.05)
    coordination = float(str(line["coordination_number_error"]["error"]))
    assert float(quoted[4]) == pytest.approx(100 * coordination, abs=0.05)
    coordinates = float(str(line["coordinates_error"]["error"]))
    assert float(quoted[5]) == pytest.approx(100 * coordinates, abs=0.05)
