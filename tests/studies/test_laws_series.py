"""The study of laws: its cases keep the future apart, and tests teach what they were made of."""

from __future__ import annotations

import numpy as np
import pytest

from adapters.laws.fit.prior import PRIOR, predict_growth
from validation.studies.laws.run import LEARNED, judge_auto, learn_prior, summarise_auto
from validation.studies.laws.series import (
    CUTS,
    REACH,
    LawCase,
    cut_cases,
    list_family_cases,
    list_fast_cases,
)

pytestmark = pytest.mark.studies
READ = np.geomspace(1, 1e5, 61)  # Twelve a decade: ten times a reading is one


def one_case(settlement: np.ndarray, name: str = "series") -> LawCase:
    """Cut at 1,000 cycles."""
    (found,) = cut_cases(name, READ, settlement, (1000.0,))
    return found


def test_a_case_knows_nothing_behind_its_cut() -> None:
    """Known rows end at N_c, the truth is the series itself at ten times the last of them."""
    case = one_case(np.log(READ))
    assert case.cycle[-1] <= 1000
    assert case.to_cycle == pytest.approx(REACH * case.cycle[-1])
    assert case.truth == pytest.approx(np.log(case.to_cycle))
    short = list(cut_cases("series", READ[:20], READ[:20], CUTS))
    assert not short  # its end lies before ten times any cut


def test_families_are_drawn_once_and_for_all() -> None:
    """The same members every time, twelve families, settling."""
    first, again = list_family_cases(1), list_family_cases(1)
    assert len({case.name for case in first}) == 12
    for one, other in zip(first, again, strict=True):
        np.testing.assert_array_equal(one.settlement, other.settlement)
        assert one.truth > 0.8 * one.settlement[0]
    assert len(list_fast_cases(2)) == 10


def test_tests_teach_what_they_were_made_of() -> None:
    """Strains that go as those of the prior teach its numbers."""
    cycle = np.geomspace(1, 5e5, 60)
    reach = np.array([np.ones(60), cycle])
    made = [(f"_f_{f}Hz", cycle, np.exp(predict_growth(reach, f))) for f in (5, 15, 50)]
    found, numbers = learn_prior(made), [getattr(PRIOR, name) for name in LEARNED]
    assert [getattr(found, name) for name in LEARNED] == pytest.approx(numbers, rel=0.1)


def test_summary_counts_refusals_apart() -> None:
    """A refused case is in no error, but in ``all`` and in the count."""
    rows = judge_auto([one_case(np.log(READ), "slow"), one_case(READ, "fast")])
    found = summarise_auto(rows)
    assert (found["cases"], found["refused"], found["all"]["cases"]) == (1, 1, 2)
    assert found["error"] == abs(rows[0]["error"])
    assert [row["regime"] for row in rows] == ["steady", "ratcheting"]
