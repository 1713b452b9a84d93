"""Jumps by tolerance beside full runs of the same seeds: what counts as within, and overspend."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from validation.jump_liggghts import (
    beside_full,
    chaos_within,
    full_run,
    overspend,
    realised,
    share_interval,
    spans,
    tolerance_of,
)
from validation.jump_study import K_I
from validation.settlement_ensemble import COARSE, Piece
from validation.settlement_ensemble_record import EnsembleRecord

LAST = 200


def full(slope: float = 1.0) -> dict[str, Any]:
    """Settlement ``slope`` ln(1 + N) [m]."""
    rows = [[cycle, "c", slope * np.log1p(cycle), 4.0, 1.0] for cycle in range(1, LAST + 1)]
    return {"way": "full", "seed": 1, "rows": rows, "computed": LAST, "lost": []}


def jumping(error: float, healed: float = 0.0) -> dict[str, Any]:
    """One jump from cycle 100 to 150 that gains the full run's, times 1 + ``error``; five healing
    cycles gain the full run's and ``healed`` [m] in all, and one cycle behind them jumps up."""
    rows = [row for row in full()["rows"] if row[0] <= 100]
    end = rows[-1][2] + (1 + error) * (np.log1p(150) - np.log1p(100))
    gains = [np.log1p(150 + n) - np.log1p(150) + n / 5 * healed for n in range(1, 6)]
    healing = [[150 + n, "h", end + gains[n - 1], 4.0, 1.0] for n in range(1, 6)]
    return {
        "way": "tolerance 0.1", "seed": 1, "computed": 150, "lost": [{"lost_cycles": 10}],
        "rows": [
            *rows, [150, "j", end, 4.0, None], *healing, [156, "c", healing[-1][2] + 9, 4.0, 1.0],
        ],
    }  # fmt: skip


def test_a_gain_within_the_tolerance_of_the_total_is_held() -> None:
    """|gain - true| <= 0.1 u: the true gain is .4 of 5.0, so up to 1.2 of it too much, not 1.5."""
    assert realised(jumping(0.0), [full()]) == [True]
    assert realised(jumping(1.2), [full()]) == [True]
    assert realised(jumping(1.5), [full()]) == [False]
    assert realised(jumping(-1.5), [full()]) == [False]
    assert realised(jumping(0.0), []) == []


def test_healing_cycles_count() -> None:
    """u is 5.05 behind them: 1 too much or too little in them is no .5, .3 is; what they make good
    of a jump that gained .59 too much, or bring further, counts; the cycle behind them does not."""
    assert realised(jumping(0.0, 1.0), [full()]) == [False]
    assert realised(jumping(0.0, -1.0), [full()]) == [False]
    assert realised(jumping(0.0, 0.3), [full()]) == [True]
    assert realised(jumping(1.5, -0.3), [full()]) == [True]
    assert realised(jumping(1.2, 0.3), [full()]) == [False]
    (span,) = spans(jumping(0.0))
    assert span[:2] == (100, 155)
    assert span[2:] == pytest.approx((np.log(156 / 101), np.log(156)))


def test_an_interval_of_few_is_wide() -> None:
    """Clopper and Pearson (1934): none of ten goes with up to 1 - .025^(1/10) = 31 %."""
    assert share_interval([False] * 10) == "0 of 10 (0 %, 95 % interval 0 to 31 %)"


def test_overspend_counts_cycles_taken_back() -> None:
    """150 cycles and 10 lost, over an oracle that computes k_i and its windows at least."""
    run = jumping(0.0)
    spent = overspend(run, [full()])
    assert spent is not None
    assert 1 < spent <= 160 / (K_I + 10)
    assert overspend(run | {"lost": []}, [full()]) == pytest.approx(spent * 150 / 160)
    assert overspend(run, []) is None
    assert beside_full([run], [full()]) == ["1 of 1 (100 %)", f"{spent:.1f}"]


def test_a_full_run_is_found_by_its_seed() -> None:
    """Settlement before the first cycle is zero."""
    found = full_run(1, [full()])
    assert found is not None
    assert found.path[0] == 0
    assert len(found.path) == LAST + 1
    assert full_run(2, [full()]) is None
    assert tolerance_of(jumping(0.0)) == 0.1


def test_members_of_a_packing_part_by_chaos() -> None:
    """All within a tolerance above what beds settle, none within one of zero, and those of between
    by what members gain to the end of the healing cycles; none beyond the ensemble's packings."""
    record, run = EnsembleRecord(), jumping(0.0)
    assert chaos_within([run | {"way": "tolerance 9"}], record) == [True]
    assert chaos_within([run | {"way": "tolerance 0"}], record) == [False]
    assert chaos_within([run | {"seed": 6}], record) == []
    one, other = (
        record.since_rain("coarse-1", Piece(COARSE, 1, member).name)["settlement"]
        for member in range(2)
    )
    apart = abs(one[154] - one[99] - other[154] + other[99]) / one[154]
    assert chaos_within([run | {"way": f"tolerance {1.01 * apart}"}], record) == [True]
    assert chaos_within([run | {"way": f"tolerance {0.99 * apart}"}], record) == [False]
