"""docs/engine-speed.md is what its record says, number for number."""

from __future__ import annotations

from pathlib import Path

import pytest

from validation.engine_speed_page import PAGE, of_kind, page, speeds
from validation.engine_speed_runs import RECORD, Row, record_read

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def rows() -> list[Row]:
    return record_read()


def test_page_is_made_from_the_record(rows: list[Row]) -> None:
    """Made again, the page is the one that ships."""
    assert page(rows) == PAGE.read_text(encoding="utf-8")
    assert len(rows) == len(RECORD.read_text().splitlines())


def test_enough_runs(rows: list[Row]) -> None:
    """Five runs behind each median, at 1,111 and 9,999 grains, on all three engines."""
    found = speeds(rows)
    assert {key for key in found} == {
        (engine, grains) for engine in ("liggghts", "lammps", "yade") for grains in (1111, 9999)
    }
    assert min(value[3] for value in found.values()) >= 5


def test_sentences_about_errors(rows: list[Row]) -> None:
    """At the same step all engines rebound alike; undamped order 5/2, damped order 1."""
    errors: dict[tuple[str, int], dict[str, float]] = {
        (row["method"], row["setting"]["steps_in_contact"]): row["error"]
        for row in of_kind(rows, "accuracy")
    }
    for steps in (20, 50, 100, 200):
        one, *others = (errors[engine, steps] for engine in ("liggghts", "lammps", "yade"))
        for other in others:
            for kind in ("rebound, e = 1", "rebound, e = 0.2"):
                assert other[kind] == pytest.approx(one[kind], rel=0.02)
    few, many = errors["lammps", 100], errors["lammps", 200]
    assert few["rebound, e = 1"] / many["rebound, e = 1"] == pytest.approx(2**2.5, rel=0.05)
    assert few["rebound, e = 0.2"] / many["rebound, e = 0.2"] == pytest.approx(2, rel=0.05)
    own = [errors["lammps", steps]["friction, own rule"] for steps in (10, 100, 1000)]
    assert own == sorted(own, reverse=True)
    assert own[-1] < 1e-3
    for engine in ("liggghts", "yade"):
        assert 3e-3 < errors[engine, 1000]["friction, own rule"] < 5e-3
    for engine in ("liggghts", "lammps", "yade"):
        assert all(errors[engine, steps]["sliding limit"] < 0.02 for steps in (100, 200, 1000))
