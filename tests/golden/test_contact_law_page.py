"""The tables of Chung and Ooi's tests in docs/contact-law.md against their record."""

from __future__ import annotations

import json

from validation.chung_ooi_page import PAGE, PICTURE, RESULTS, page_filled, tables_of

RECORD = json.loads((RESULTS / "engines.json").read_text())


def test_the_page_is_what_the_record_says() -> None:
    """Written by `python -m validation.chung_ooi_page`, and not by hand; its picture is there."""
    text = PAGE.read_text(encoding="utf-8")
    assert page_filled(text, tables_of(RECORD)) == text
    assert PICTURE.exists()


def test_every_check_of_the_record_holds() -> None:
    """And every engine has its part in it."""
    assert [check["name"] for check in RECORD["checks"] if not check["ok"]] == []
    for table in tables_of(RECORD).values():
        assert len(table.splitlines()) > 3


def test_what_the_page_says_of_the_gap() -> None:
    """Pull 6.7 % on LAMMPS; without it nothing; YADE's excess is its tangential damping."""
    values = {check["name"]: check["value"] for check in RECORD["checks"]}
    name = "{}, test 6, aluminium alloy: sliding limit, impulse, under the {} law"
    assert abs(values[name.format("lammps", "scene")] - 0.067) < 1e-3
    assert abs(values[name.format("lammps", "unpulled")]) < 1e-3
    assert abs(values[name.format("yade", "undamped")]) < 0.02
    assert values[name.format("liggghts", "unpulled")] > 0.1
    assert values[name.format("liggghts", "undamped")] > 0.06
