"""Jumps by tolerance at paper scale beside the full runs of the packing."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from validation.jump_paper import PaperJump, paper_jumps, paper_told
from validation.settlement_ensemble_record import EnsembleRecord


def jump(gained: float, *full: float) -> PaperJump:
    """One to a settlement of 100 m, of which the tolerance of 0.02 allows 2 m."""
    return PaperJump(1, 60, 80, gained, np.array(full), 100.0)


@pytest.mark.parametrize(("gained", "held"), [(6.9, True), (7.1, False), (3.1, True), (2.9, False)])
def test_a_jump_is_compared_with_the_mean_of_the_full_runs(gained: float, held: bool) -> None:
    """4 and 6 m: within 2 m of 5."""
    assert jump(gained, 4.0, 6.0).within == held


def test_full_runs_are_compared_with_one_another() -> None:
    """4 and 6 m are 2 m apart, which is allowed; 4 and 6.5 m are not."""
    assert jump(5.0, 4.0, 6.0).full_within
    assert not jump(5.0, 4.0, 6.5).full_within
    assert paper_told([jump(5.0, 4.0, 6.5)])["paper_within"].startswith("1 of 1 (100 %")


def test_gains_of_a_row_are_those_of_the_jump_and_its_healing_cycles(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Moved by 3 m, 1 m in each of five healing cycles, not in the sixth: 8 m from cycle 60 to 85,
    where two full runs gain 25 and 50 m and have settled 85 and 170."""
    curves = [slope * np.arange(501.0) for slope in (1.0, 2.0)]
    monkeypatch.setattr("validation.jump_paper.full_curves", lambda seed, record: curves)
    row: dict[str, Any] = {
        "method": "tolerance 0.02", "refused": "", "last": 500, "seed": 1,
        "sides": [{"first": 60, "last": 80, "after": {"settlement": [1.0] * 6}}],
        "moved": [[2.0, 3.0]],
    }  # fmt: skip
    other = row | {"method": "2 jumps"}
    (one,) = paper_jumps([row, other, row | {"refused": "why"}], EnsembleRecord())
    assert one.gained == 8.0
    assert one.full.tolist() == [25.0, 50.0]
    assert one.settled == 127.5
