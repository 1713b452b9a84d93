"""The page on the solvers of rigid contact against its record."""

from __future__ import annotations

import pytest

from validation import rigid_report as report
from validation.rigid_page import PAGE_PATH, page
from validation.rigid_picture import PICTURE
from validation.rigid_runs import RECORD, rows_read

ROWS = rows_read(RECORD)


def test_the_page_is_what_the_record_says() -> None:
    """Written by `python -m validation.rigid_page`, and not by hand."""
    assert PAGE_PATH.read_text(encoding="utf-8") == page(ROWS)
    assert PICTURE.exists()


def test_rows_are_whole() -> None:
    """Each says what it is, who made it and, where there is no answer, why."""
    assert ROWS
    for row in ROWS:
        assert {"case", "method", "setting", "seed", "work", "work_unit", "ok", "why"} <= set(row)
        assert row["commit"]
        assert row["started"]
        if row["error"] is None:
            assert not row["ok"]
            assert row["why"]
        elif row["case"] == "rigid-solvers":
            assert row["ok"] == (row["error"] <= max(row["setting"]["tolerance"], row["bar"]))
            assert row["cost_s"] >= 0


def test_no_failure_of_ours_is_silent() -> None:
    """A run of ours that misses what was asked for says so."""
    assert report.silent_failures(ROWS) == []


def test_every_method_of_a_problem_is_raced() -> None:
    """No problem lacks our default or the plain hybrid that it is measured against."""
    for name, each in report.problems(ROWS).items():
        made = {row["method"] for row in each}
        assert {report.OURS, report.HYBRID} <= made, name


def test_the_case_judges_the_record() -> None:
    """Every family and each packing within the bar on Siconos is judged."""
    from validation.cases.rigid import record_checks

    names = [check.name for check in record_checks(ROWS)]
    assert len(set(names)) == len(names)
    for family in report.families(ROWS):
        assert any(name.startswith(f"{family}: problems of") for name in names)


@pytest.mark.parametrize("method", ["dantzig", "dantzig, reversal"])
def test_without_friction_dantzig_always_solves(method: str) -> None:
    """The paper's algorithm at friction zero, all orders of contacts."""
    beds = report.dantzig_beds(ROWS)
    assert list(beds) == ["60 discs", "125 discs", "discs_125"]
    for bed in beds:
        solved, orders = report.dantzig_success(ROWS, method, bed)[0.0]
        assert solved == orders == 10


def test_the_papers_algorithm_works_at_little_friction_only() -> None:
    """On the stored packing in most orders at 0.1, on none at 0.3 and above."""
    found = report.dantzig_success(ROWS, "dantzig", "discs_125")
    assert found[0.1][0] >= 5
    assert all(solved == 0 for friction, (solved, _) in found.items() if friction >= 0.3)


def test_the_size_of_a_bed_is_not_what_stops_dantzig() -> None:
    """As the page says: more discs of the same code fare no better, those of other code do, and
    more of their contacts slide."""
    solved, slide = {}, {}
    for bed, contacts in report.dantzig_beds(ROWS).items():
        with_friction = report.dantzig_success(ROWS, "dantzig", bed)
        solved[bed] = sum(n for friction, (n, _) in with_friction.items() if friction > 0)
        slide[bed] = report.dantzig_sliding(ROWS, bed)[0.1] / contacts
    assert solved["125 discs"] <= solved["60 discs"] < solved["discs_125"]
    assert max(slide["60 discs"], slide["125 discs"]) < slide["discs_125"]


def test_bars_that_are_missed_are_told() -> None:
    """Each failing check of the case has its line; a lead of zero says what residual ours has."""
    from validation.cases.rigid import record_checks
    from validation.rigid_page_bars import bars_words

    words = bars_words(ROWS)
    missed = [check for check in record_checks(ROWS) if not check.holds]
    assert words.count("\n- ") == len(missed)
    assert all(f"- {check.name}: " in words for check in missed)
    late = [{**row, "cost_s": 1e3} if row["method"] == report.OURS else row for row in ROWS]
    assert bars_words(late).count("\n- ") > len(missed)


def test_the_ends_of_dantzig_are_told_by_what_happened() -> None:
    """``not converged`` alone names no mechanism."""
    ends = report.dantzig_ends(ROWS)
    assert {how for (method, _, how) in ends if method == "dantzig, reversal"} == {
        "the force that is driven came back to zero"
    }
