"""docs/settlement-partial.md is what its record says, and its sentences hold in the record."""

from __future__ import annotations

import numpy as np
import pytest

from validation.settlement_bars import settlement_total
from validation.settlement_ensemble_record import EnsembleRecord
from validation.settlement_partial_page import (
    NAMES,
    PAGE,
    STUDY,
    errors,
    page,
)
from validation.settlement_rivals import Row
from validation.settlement_rivals_reading import finished, reference
from validation.settlement_rivals_runs import key, record_read

LAST = STUDY.last


@pytest.fixture(scope="module")
def rows() -> list[Row]:
    return record_read(STUDY.record)


def test_page_is_made_from_the_record(rows: list[Row]) -> None:
    """Made again, the page is the one that ships."""
    assert page(rows, EnsembleRecord()) == PAGE.read_text(encoding="utf-8")
    assert PAGE.with_suffix(".png").exists()


def test_record_holds_what_the_study_names(rows: list[Row]) -> None:
    """Each run once, two full runs a packing, no method that the code does not know."""
    assert len({key(row) for row in rows}) == len(rows)
    assert [row["seed"] for row in reference(rows, LAST)] == [1, 2, 3, 1, 2, 3]
    assert {row["method"] for row in rows if row["part"] != "reference"} <= set(NAMES)
    assert all(row["last"] == LAST for row in rows)


def test_errors_are_those_of_the_settlement_over_the_total(rows: list[Row]) -> None:
    """By hand: settlement behind k_i of a run less its packing's full runs', over what all do."""
    truth = {
        seed: np.mean(
            [row["settlement"][str(LAST)] for row in reference(rows, LAST) if row["seed"] == seed]
        )
        for seed in (1, 2, 3)
    }
    begun = np.mean([row["begun"] for row in reference(rows, LAST)])
    total = float(begun + np.mean(list(truth.values())))
    assert settlement_total(rows, LAST) == pytest.approx(total, rel=1e-12)
    for name in NAMES:
        found = finished(rows, name, LAST)
        by_hand = {
            seed: 100
            * (
                np.mean([row["settlement"][str(LAST)] for row in found if row["seed"] == seed])
                - one
            )
            / total
            for seed, one in truth.items()
            if found
        }
        assert errors(rows, name) == pytest.approx(by_hand, rel=1e-9)
