"""The study of laws: its cases keep the future apart, its rivals are what they are called."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from validation.law_bound import WAYS, left_out
from validation.law_series import CUTS, REACH, LawCase, cut_cases, family_cases, fast_cases
from validation.law_study import auto_rows, auto_summary, curve_fit, law_alone, polyfit

READ = np.geomspace(1, 1e5, 61)
"""Twelve a decade: ten times a reading is one."""


def one_case(settlement: np.ndarray, name: str = "series") -> LawCase:
    """Cut at 1,000 cycles."""
    (found,) = cut_cases("made", name, READ, settlement, (1000.0,))
    return found


def test_a_case_knows_nothing_behind_its_cut() -> None:
    """Known rows end at N_c, the truth is the series itself at ten times the last of them."""
    case = one_case(np.log(READ))
    assert case.cycle[-1] <= 1000
    assert case.to_cycle == pytest.approx(REACH * case.cycle[-1])
    assert case.truth == pytest.approx(np.log(case.to_cycle))
    short = list(cut_cases("made", "series", READ[:20], READ[:20], CUTS))
    assert not short  # its end lies before ten times any cut


def test_families_are_drawn_once_and_for_all() -> None:
    """The same members every time, twelve families, settling, each read to 300 digits."""
    first, again = family_cases(1), family_cases(1)
    assert len({case.name for case in first}) == 12
    for one, other in zip(first, again, strict=True):
        np.testing.assert_array_equal(one.settlement, other.settlement)
        assert one.truth > 0.8 * one.settlement[0]
    assert len(fast_cases(2)) == 10


def test_rivals_recover_their_own_law() -> None:
    """numpy's line in ln N, scipy's power law, a law of the bank: exact on their own series."""
    straight, power = one_case(2 + 3 * np.log(READ)), one_case(2 * READ**0.3)
    assert polyfit(straight) == pytest.approx(straight.truth, rel=1e-10)
    assert law_alone("log")(straight) == pytest.approx(straight.truth, rel=1e-10)
    assert curve_fit(power) == pytest.approx(power.truth, rel=1e-6)


def test_summary_counts_refusals_apart() -> None:
    """A refused case is in no error, but in ``all`` and in the count."""
    rows = auto_rows([one_case(np.log(READ), "slow"), one_case(READ, "fast")])
    found = auto_summary(rows)
    assert (found["cases"], found["refused"], found["all"]["cases"]) == (1, 1, 2)
    assert found["error"] == abs(rows[0]["error"])
    assert found["regimes"]["ratcheting"] == 1


def test_a_test_is_judged_by_what_the_others_chose() -> None:
    """Wide bands miss by half in two tests, so 1 is chosen for the third, whose wide ones hit.

    With its own cases counted, refusing none would meet the bar there too.
    """

    def case(name: str, width: float, error: float, certain: bool = True) -> dict[str, Any]:
        ways = dict.fromkeys(WAYS, error)
        return {"name": name, "certain": certain, "width": width, "inside": True, "ways": ways}

    rows = [case(name, 1.5, 0.5) for name in "ab"] + [case(name, 0.9, 0.1) for name in "abc"]
    rows += [case("c", 3.0, 0.01) for _ in range(40)] + [case("c", 0.1, 9.0, certain=False)]
    found = left_out(rows)
    assert found["chosen"]["c"] == f"{WAYS[0]}, 1"
    assert found["chosen"]["a"].endswith(", 4")  # c's forty cases carry the bar
    assert found["cases"] == 2 + 2 + 1  # a and b whole, c's narrow one; none that ratchets
