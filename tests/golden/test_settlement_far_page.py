"""docs/settlement-far.md is what the ensemble's record says, and its sentences hold in it."""

from __future__ import annotations

import numpy as np
import pytest

from validation.settlement_ensemble import COARSE, CONFINED
from validation.settlement_ensemble_record import EnsembleRecord
from validation.settlement_far_page import PAGE, Foretold, page, study


@pytest.fixture(scope="module")
def found() -> list[Foretold]:
    return study(EnsembleRecord())


def test_page_is_made_from_the_record(found: list[Foretold]) -> None:
    """Made again, the page is the one that ships."""
    assert page(found, EnsembleRecord()) == PAGE.read_text(encoding="utf-8")
    assert PAGE.with_suffix(".png").exists()


def test_sentences_of_the_page(found: list[Foretold]) -> None:
    """To ten times the cycles: median errors from a quarter to a half; the logarithm's median is no
    greater than the laws'; bands have eight runs in ten, five in six of the confined bed's."""
    for one in found:
        if one.kind == COARSE and one.to == 10 * one.fitted:
            by_laws, by_log = (
                np.abs(one.error(each)) for each in (one.outlook.prediction, one.logarithm)
            )
            assert 0.2 < np.median(by_laws) < 0.5
            assert np.median(by_log) < np.median(by_laws)
            assert by_log.max() < 0.7
    assert min(one.covered.mean() for one in found if one.kind == COARSE) >= 0.8
    confined = [one.covered.mean() for one in found if one.kind == CONFINED]
    assert confined == pytest.approx([5 / 6] * len(confined))
