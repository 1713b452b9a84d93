"""The settlement study's arithmetic: intervals, errors, costs, a thinned table, its plan."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.stats import t as student

from adapters.jumps.schedule import schedule_jumps
from validation.studies.settlement.beds import COARSE, CONFINED, EVERY, list_methods, list_runs
from validation.studies.settlement.reading import (
    find_errors,
    find_speedup,
    find_spread,
    find_step_speedup,
    judge_layers,
    nest,
)
from validation.studies.settlement.run import COLUMNS, PARTS, average_block, thin_table

pytestmark = pytest.mark.studies


def row(method: str, seed: int, settlement: float, **more: Any) -> dict[str, Any]:
    """A run on the coarse bed: 400 cycles of 10 steps for 40 CPU s, if ``more`` says no other."""
    state = dict.fromkeys(("coordination_number", "elastic_deflection"), 1.0)
    given: dict[str, Any] = {"computed": 400, "steps_per_cycle": 10, "cost": {"engine": 40.0}}
    return {
        "bed": "coarse", "method": method, "seed": seed, "settlement": settlement, "state": state,
        "profile": [0.5, 0.5], **given, **more,
    }  # fmt: skip


def test_intervals_of_runs_within_packings() -> None:
    """Packing means 2 and 6, variance within 2 with two degrees of freedom, by hand."""
    found = nest([np.array([1.0, 3.0]), np.array([5.0, 7.0])])
    assert found.mean == 4
    assert found.within == pytest.approx(np.sqrt(2))
    assert found.between == pytest.approx(np.sqrt(8 - 1))
    assert found.half == pytest.approx(student.ppf(0.975, 1) * 2)
    assert found.half_given == pytest.approx(student.ppf(0.975, 2) * np.sqrt(1 / 2))
    assert found.alone == pytest.approx(student.ppf(0.975, 2) * np.sqrt(2 * 1.5 / 2))


def test_errors_are_packing_by_packing_over_the_mean_of_all() -> None:
    """Full runs settle 1 and 3; a way 1.5 and 2: errors of +25 % and -50 % of their mean of 2."""
    rows = [row(EVERY, 1, 1.0), row(EVERY, 2, 2.0), row(EVERY, 2, 4.0)]
    rows += [row("way", 1, 1.5), row("way", 2, 2.0, profile=[0.6, 0.5])]
    np.testing.assert_allclose(find_errors(rows, COARSE, "way", "settlement"), [0.25, -0.5])
    spread = np.std([1.5, 2.0], ddof=1) / np.std([1.0, 2.0, 4.0], ddof=1)
    assert find_spread(rows, COARSE, "way") == pytest.approx(spread)


def test_profile_error_is_rms_over_layers() -> None:
    """0.1 off in one of two layers of 0.5, in one of two runs: 0.1 sqrt(1/2) / 0.5 / 2."""
    rows = [row(EVERY, seed, 1.0) for seed in range(1, 6)]
    rows += [row("way", 1, 1.0), row("way", 2, 1.0, profile=[0.6, 0.5])]
    assert judge_layers(rows, COARSE, "way") == pytest.approx(0.1 * np.sqrt(0.5) / 0.5 / 2)


def test_what_a_way_costs() -> None:
    """A tenth of the steps at twice the cost a step, of it 2 s a start, and 2 s of relaxation."""
    cost = {"engine": 10.0, "start_up": 2.0, "relax": 2.0}
    rows = [row(EVERY, 1, 1.0), row("way", 1, 1.0, computed=40, cost=cost)]
    assert find_speedup(rows, COARSE, "way") == pytest.approx(40 / 12)
    assert find_step_speedup(rows, COARSE, "way") == pytest.approx(4000 * (8 / 400) / 12)


def test_schedules_end_at_the_last_cycle() -> None:
    """k_i, a window, then jump, healing and window each: cycle 500 on both beds."""
    for kind in (CONFINED, COARSE):
        for method in list_methods(kind):
            if method.jumps:
                h = schedule_jumps(
                    method.jumps, kind.last, kind.k_i, method.window, 5, method.growing
                )
                jumped = sum(h) + method.jumps * (5 + method.window)
                assert kind.k_i + method.window + jumped == kind.last


def test_every_run_has_one_name() -> None:
    """As many parts as runs, and four laws for each full run; full runs come before all else."""
    runs = [run for kind in (CONFINED, COARSE) for run in list_runs(kind)]
    full = sum(method is None for method, _, _ in runs)
    assert len(PARTS) == len(runs) + 4 * full
    assert next(iter(PARTS)) == f"confined-1-0, {EVERY}"


def test_a_thinned_table_is_even_in_the_logarithm() -> None:
    """First and last row stay, gaps in ln N differ by no more than rounding cycles makes."""
    found = {cycle: dict.fromkeys(COLUMNS, float(cycle)) for cycle in range(1, 10_001)}
    table = thin_table(found)
    assert table["cycle"][0] == 1
    assert table["cycle"][-1] == 10_000
    assert 40 <= len(table["cycle"]) <= 60
    late = np.diff(np.log([cycle for cycle in table["cycle"] if cycle > 100]))
    assert late.max() / late.min() < 1.1
    assert table["settlement"] == [float(cycle) for cycle in table["cycle"]]
    assert average_block(found, 20, "settlement") == pytest.approx(15.5)
