"""docs/rigid-integration.md is made from the committed record, and the record holds its bars."""

from __future__ import annotations

import json
from dataclasses import fields
from math import nan
from pathlib import Path
from typing import Any

import pytest

from validation import rigid_integration
from validation.cases import rigid_integration as case
from validation.rigid_integration import RECORD, TABLES, record_make, record_read
from validation.rigid_integration_order import METHODS, PROBLEMS, OrderRow
from validation.rigid_integration_page import PAGE, absent, of_table, page, table_rows
from validation.rigid_integration_steps import Drift, Trace
from validation.rigid_integration_zeno import Zeno

LINES = record_read()


def made(kind: Any, line: dict[str, Any]) -> Any:
    """A row of the record as the dataclass it was."""
    names = [field.name for field in fields(kind)]
    return kind(**{name: nan if line[name] is None else line[name] for name in names})


def test_page_is_that_of_the_record() -> None:
    assert PAGE.read_text(encoding="utf-8") == page(LINES)
    assert PAGE.with_suffix(".png").is_file()


def test_no_table_and_no_motion_is_missing() -> None:
    assert {line["table"] for line in LINES} == set(TABLES)
    order = of_table(LINES, "order")
    ours = {(line["problem"], line["method"]) for line in order if not line["peer"]}
    assert ours == {(problem.name, method) for problem in PROBLEMS for method in METHODS}
    for problem in PROBLEMS:
        for method in METHODS:
            mine = [r for r in order if (r["problem"], r["method"]) == (problem.name, method)]
            assert [line["step"] for line in mine] == list(problem.steps[method])


def test_record_holds_the_bars_of_the_case() -> None:
    """Ours, judged as ``trackbed validate rigid-integration`` does; a miss of a row is told."""
    ours = [line for line in LINES if not line.get("peer")]
    checks = case.order_checks([made(OrderRow, line) for line in of_table(ours, "order")])
    for line in of_table(ours, "trace"):
        checks += case.trace_checks(made(Trace, line))
    checks += [case.drift_check(made(Drift, line)) for line in of_table(ours, "drift")]
    checks += case.zeno_checks(made(Zeno, line) for line in of_table(ours, "zeno"))
    assert [check.name for check in checks if not check.holds] == []
    text = PAGE.read_text(encoding="utf-8").split("## Where ours misses its bar")[1]
    for line in of_table(ours, "law") + of_table(ours, "impact"):
        told = line["ok"] or "inf" in line["bar"]
        assert told or f"* {line['case']}, {line['method']}: {line['measure']}" in text


def test_every_peer_that_did_not_run_is_told() -> None:
    text = PAGE.read_text(encoding="utf-8")
    for line in LINES:
        if line.get("peer") and not line["steps"]:
            assert f"* {line['method']}: {line['why']} (" in text


def test_a_miss_is_bold_and_a_reason_told_once() -> None:
    line = {
        "table": "impact", "case": "balls", "answer": "two out", "method": "ODE 1",
        "measure": "off", "value": 0.5, "bar": "<= 1e-09", "ok": False, "unit": "", "cpu_s": 0.1,
        "steps": 3, "why": "", "peer": True,
    }  # fmt: skip
    gone = line | {"method": "LMGC90", "why": "no discs", "steps": 0, "value": None}
    text = table_rows([line, gone], "impact")
    assert "| ODE 1 | **0.5** |" in text
    assert "LMGC90" not in text
    assert absent([gone, gone, gone | {"case": "gas"}]) == "* LMGC90: no discs (balls; gas)"


def test_a_table_that_is_measured_again_leaves_the_others(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    path = tmp_path / "record.jsonl"
    row = OrderRow("a", "b", 1.0, nan, 0.0, 1)
    monkeypatch.setattr(rigid_integration, "TABLES", {
        "order": lambda quick, peers: [row], "law": lambda quick, peers: [row, row],
    })  # fmt: skip
    record_make(True, path=path)
    record_make(True, ["law"], path=path)
    lines = record_read(path)
    assert [line["table"] for line in lines] == ["order", "law", "law"]
    assert lines[0]["error"] is None
    assert lines[0]["command"].endswith("--run --quick")
    assert lines[1]["command"].endswith("--only law")


def test_record_is_plain_json_a_line_each() -> None:
    assert all(json.loads(line) for line in RECORD.read_text(encoding="utf-8").splitlines())
