"""docs/rigid-hard-cases.md is made from the committed record, and the record holds its bars."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import pytest

from adapters.run_folder import write_atomically
from validation import rigid_hard_page
from validation.rigid_hard_page import (
    NAMED,
    PAGE,
    RECORD,
    page,
    record_lines,
    record_read,
    with_known,
)
from validation.rigid_hard_trials import Row

ORIGIN = {"commit": "c", "command": "x", "machine": "m", "started": "now"}


def row(**changes: object) -> Row:
    given = {
        "case": "box", "answer": "rests", "method": "time-stepping", "measure": "move",
        "value": 1e-12, "bar": "<= 1e-09", "ok": True, "unit": "m", "cpu_s": 0.5, "steps": 10,
    }  # fmt: skip
    return Row(**(given | changes))  # type: ignore[arg-type]


def test_page_is_that_of_the_record() -> None:
    assert PAGE.read_text(encoding="utf-8") == page(record_read())


def test_every_case_has_a_row_of_ours_and_misses_are_told() -> None:
    lines = record_read()
    text = PAGE.read_text(encoding="utf-8")
    assert {line["case"] for line in lines if not line["peer"]} == {line["case"] for line in lines}
    misses = [line for line in lines if not line["peer"] and not line["ok"]]
    assert ("Where ours misses its bar" in text) == bool(misses)
    for line in misses:
        assert f"* {line['case']}, {line['method']}: " in text


@pytest.mark.parametrize(
    "family",
    [
        "1e4 times heavier", "mu = tan 20°", "1 - 1e-9", "1 + 1e-9", "block at rest", "card house",
        "wedge", "arch of", "Painleve rod", "bouncing", "needles", "coincident edges",
        "tower of 200", "jammed hopper", "light on heavy", "storeys", "tan a exactly",
        "lowest kicked", "needles of 1000", "by up to 1e-12", "in mm and g", "turned by 45",
        "1e+08 times heavier", "rocking block", "disc rolling", "block in space",
    ],
)  # fmt: skip
def test_no_hard_case_is_missing(family: str) -> None:
    assert any(family in line["case"] for line in record_read())


@pytest.mark.parametrize("named", NAMED, ids=lambda named: str(named[0]))
def test_every_named_case_is_met(named: tuple[str, ...]) -> None:
    """Each has a row of ours, and all its rows meet their bars."""
    rows = [line for line in record_read() if not line["peer"]]
    rows = [line for line in rows if line["case"].startswith(named[1:])]
    assert rows
    assert all(line["ok"] for line in rows)
    assert f"| {named[0]} | {len(rows)} of {len(rows)} |" in PAGE.read_text(encoding="utf-8")


def test_rows_of_peers_are_kept() -> None:
    """A run of ours alone: new lines of ours, old ones of peers after those of the same case."""
    known = record_lines([row(), row(method="ODE", peer=True), row(case="gone", peer=True)], ORIGIN)
    made = record_lines([row(value=2e-12), row(case="new")], ORIGIN)
    lines = with_known(made, known, peers=True)
    assert [(line["case"], line["method"], line["value"]) for line in lines] == [
        ("box", "time-stepping", 2e-12), ("box", "ODE", 1e-12), ("new", "time-stepping", 1e-12),
    ]  # fmt: skip


def test_rows_of_ours_are_kept() -> None:
    """A run of the peers: their lines are new, ours are those of before."""
    known = record_lines([row(), row(method="ODE", peer=True)], ORIGIN)
    made = record_lines([row(value=2e-12), row(method="ODE", value=3.0, peer=True)], ORIGIN)
    lines = with_known(made, known, peers=False)
    assert [(line["method"], line["value"]) for line in lines] == [
        ("time-stepping", 1e-12), ("ODE", 3.0),
    ]  # fmt: skip


def test_a_miss_is_bold_and_told() -> None:
    """Of two rows the second misses: it is bold, and has a line below the table."""
    text = page(record_lines([row(), row(method="acceleration", value=1.0, ok=False)], ORIGIN))
    assert "1 of 2 rows of ours" in text
    assert "**1**" in text
    assert "* box, acceleration: move 1 against <= 1e-09 m." in text


def test_a_peer_without_a_number_has_its_reason() -> None:
    """Blown up, or never run: said in the table and below it, and valid JSON in the record."""
    nan, inf = float("nan"), float("inf")
    gone = row(method="ODE", value=nan, ok=False, cpu_s=nan, steps=0, why="no discs", peer=True)
    blown = row(method="MuJoCo 4", value=inf, ok=False, peer=True)
    lines = record_lines([row(), gone, blown], ORIGIN)
    assert "NaN" not in json.dumps(lines)
    text = page(lines)
    assert "* ODE: no discs (1 case)" in text
    assert "blew up" in text
    assert "| MuJoCo 4 | 1 | 0 |" in text
    assert "| ODE |" not in text


def test_a_run_that_was_cut_off_goes_on(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """``--resume`` measures what the same code and command have not measured yet, and no more."""
    record, asked = tmp_path / "record.jsonl", list[str]()

    def rows(quick: bool, peers: Sequence[str], names: Sequence[str]) -> dict[str, list[Row]]:
        asked.extend(names)
        if len(asked) == 2:
            raise KeyboardInterrupt
        return {name: [row(case=name)] for name in names}

    monkeypatch.setattr(rigid_hard_page, "RECORD", record)
    monkeypatch.setattr(rigid_hard_page, "record_read", lambda: record_read(record))
    monkeypatch.setattr(
        rigid_hard_page, "record_write", lambda lines: write_atomically(
            record, "".join(json.dumps(line) + "\n" for line in lines)
        ),
    )  # fmt: skip
    monkeypatch.setattr(rigid_hard_page, "provenance", lambda words: ORIGIN | {"command": words})
    monkeypatch.setattr("validation.cases.rigid_hard_cases.hard_rows", rows)
    with pytest.raises(KeyboardInterrupt):
        rigid_hard_page.measure(True, None)
    assert [line["case"] for line in record_read(record)] == asked[:1]
    rigid_hard_page.measure(True, None, resume=True)
    assert asked[2] == asked[1]
    assert sorted(set(asked)) == sorted(line["case"] for line in record_read(record))
    count = len(asked)
    rigid_hard_page.measure(True, asked[:2], resume=True)
    assert len(asked) == count
    rigid_hard_page.measure(False, asked[:1], resume=True)  # longer runs: another command
    assert len(asked) == count + 1


def test_record_is_plain_json_a_line_each() -> None:
    assert all(json.loads(line) for line in RECORD.read_text(encoding="utf-8").splitlines())


def test_case_gives_checks_of_ours(monkeypatch: pytest.MonkeyPatch) -> None:
    """``trackbed validate rigid-hard-cases`` is found by its name and runs no peer."""
    from validation.case import case_load
    from validation.cases import rigid_hard_cases

    asked: list[tuple[bool, int]] = []

    def family(quick: bool, peers: Sequence[str]) -> list[Row]:
        asked.append((quick, len(peers)))
        return [row(), row(method="acceleration", value=float("nan"), ok=False, why="no solution")]

    monkeypatch.setattr(rigid_hard_cases, "_compile", lambda: None)
    monkeypatch.setattr(rigid_hard_cases, "FAMILIES", {"one": family})
    good, bad = case_load("rigid-hard-cases")(True)
    assert asked == [(True, 0)]
    assert good.name == "box, time-stepping: move"
    assert good.holds
    assert not bad.holds
    assert "no solution" in bad.bar


def test_cases_without_a_peer_are_told() -> None:
    """A case that no peer ran on is either under a reason or among those that none was given."""
    known = record_lines([row(), row(method="ODE", peer=True), row(case="alone")], ORIGIN)
    assert "* no peer was given: alone\n" in page(known)
    lines = record_read()
    given = {line["case"] for line in lines if line["peer"]}
    told = page(lines).split("* no peer was given: ")[1].splitlines()[0].split("; ")
    assert set(told) == {line["case"] for line in lines} - given
