"""docs/settlement-hard-cases.md is what its record says; a quick subset of the cases is run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from validation.settlement_hard_beds import (
    APART,
    RADIUS,
    crystal,
    crystal_deflection,
    crystal_hollows,
)
from validation.settlement_hard_page import PAGE, page
from validation.settlement_hard_runs import Row, case_run, record_read
from validation.settlement_hard_scenes import CASES, QUICK, case_named

NOT_RIGHT = {"near-crystal", "far-jump-by-history"}
"""What the page says is not right."""


@pytest.fixture(scope="module")
def rows() -> list[Row]:
    return record_read()


def test_page_is_made_from_the_record(rows: list[Row]) -> None:
    """Made again, the page is the one that ships; every case is in it once, in order."""
    text = PAGE.read_text(encoding="utf-8")
    assert page(rows) == text
    assert "TABLE_" not in text
    assert [row["name"] for row in rows] == [case.name for case in CASES]


def test_every_case_ends_right_or_is_refused(rows: list[Row]) -> None:
    """All checks hold, but for the cases that the page calls not right; codes are README's."""
    failing = {row["name"] for row in rows if not all(check["ok"] for check in row["checks"])}
    assert failing == NOT_RIGHT
    for row in rows:
        case = case_named(row["name"])
        assert row["code"] == case.code
        assert row["code"] in (0, 3, 5, 6, 7)
        assert case.says in row["says"]


def test_friction_orders_packings(rows: list[Row]) -> None:
    """The more friction, the looser the bed and the fewer its contacts."""
    figures = {row["name"]: row["figures"] for row in rows if not row["code"]}
    order = [figures[name] for name in ("friction-0", "ordinary", "friction-1.5")]
    for name in ("density", "contacts"):
        values = [each[name] for each in order]
        assert values == sorted(values, reverse=True)


def test_crystal_in_closed_form() -> None:
    """Its neighbours are a diameter apart, and none nearer; a layer less deflects less."""
    place = crystal()
    reach = RADIUS * (1 + APART)
    distance = np.sort(
        np.linalg.norm(place[:, None] - place[None], axis=2)[np.triu_indices(148, 1)]
    )
    assert distance[0] == pytest.approx(2 * reach, rel=1e-12)
    level = sum(2 * n * (n - 1) for n in (5, 4, 5, 4, 5, 4, 5))
    assert (distance < 2 * reach * (1 + 1e-9)).sum() == crystal_hollows() + level
    assert place.min() == pytest.approx(reach)
    assert place[:, :2].max() + reach == pytest.approx(10 * reach)
    # By hand: 14.49 N; 0.2264 N upright a contact, 0.1724 N along the normal, closed by 3.32 um.
    assert crystal_deflection(case_named("crystal").scene()) == pytest.approx(35.7e-6, rel=0.01)


def test_raised_load_leaves_the_run(rows: list[Row]) -> None:
    """The row says so, beside code and reason."""
    (row,) = [each for each in rows if each["name"] == "load-raised"]
    assert [check["name"] for check in row["checks"]][-1] == "the run before is as it was"


@pytest.mark.engine("liggghts")
@pytest.mark.parametrize("name", QUICK)
@pytest.mark.long
def test_quick_cases(tmp_path: Path, rows: list[Row], name: str) -> None:
    """Run again, a case ends as in the record, with the same reason or every check kept."""
    row = case_run(case_named(name), tmp_path / "run")
    assert all(check["ok"] for check in row["checks"])
    (kept,) = [each for each in rows if each["name"] == name]
    assert row["code"] == kept["code"]
