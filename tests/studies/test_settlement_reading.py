"""The settlement study's arithmetic: paired errors, equivalence, costs, a table, its plan."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.stats import t as student

from validation.studies.settlement.bars import check_bars
from validation.studies.settlement.beds import COARSE, EVERY, KINDS, list_methods, list_runs
from validation.studies.settlement.reading import find_errors, find_interval, find_step_speedup
from validation.studies.settlement.run import (
    GAINS,
    JUDGED_LAWS,
    PARTS,
    average_block,
    count_computed,
    thin_table,
)

pytestmark = pytest.mark.studies


def row(way: str, seed: int, loaded_body: float, **more: Any) -> dict[str, Any]:
    """A run on the coarse bed: 400 cycles of 10 steps for 40 CPU s, if ``more`` says no other."""
    given: dict[str, Any] = {"computed": 400, "steps_per_cycle": 10, "cost": {"engine": 40.0}}
    figures = {"loaded_body": loaded_body, "settlement": loaded_body / 4, "stiffness": 2.0}
    return {"bed": "coarse", "way": way, "seed": seed, **figures, **given, **more}


def test_errors_are_packing_by_packing_over_the_mean_of_the_full_runs() -> None:
    """Full runs sink by 1 and 3, a way by 1.5 and 2: errors of +25 % and -50 % of their mean of 2;
    a packing without its full run and one that failed count in neither."""
    rows = [row(EVERY, 1, 1.0), row(EVERY, 2, 3.0), row("way", 1, 1.5), row("way", 2, 2.0)]
    failed = {"bed": "coarse", "way": "way", "seed": 4, "refused": "no room"}
    rows += [row("way", 3, 9.0), failed, row(EVERY, 4, 9.0)]
    np.testing.assert_allclose(find_errors(rows, COARSE, "way", "loaded_body"), [0.25, -0.5])


def test_a_stiffness_that_is_not_known_is_left_out() -> None:
    """Of two packings one has a stiffness in both runs: 3 for 2, an error of a half."""
    rows = [row(EVERY, 1, 1.0), row(EVERY, 2, 1.0), row("way", 1, 1.0, stiffness=float("nan"))]
    rows += [row("way", 2, 1.0, stiffness=3.0)]
    np.testing.assert_allclose(find_errors(rows, COARSE, "way", "stiffness"), [0.5])


def test_the_interval_is_that_of_two_one_sided_tests() -> None:
    """Of errors -.1, 0, .1: 0 -+ t(.95, 2) .1 / sqrt(3); one packing bounds nothing."""
    half = student.ppf(0.95, 2) * 0.1 / np.sqrt(3)
    np.testing.assert_allclose(find_interval(np.array([-0.1, 0.0, 0.1])), [-half, half])
    assert find_interval(np.array([0.0])) == (-np.inf, np.inf)


def test_a_margin_is_met_by_the_whole_interval_alone() -> None:
    """Errors of exactly +4 % lie within the coarse bed's 5 %; of +4 -+ 4 % they do not."""
    for spread, met in ((0.0, True), (0.04, False)):
        rows = [row(EVERY, seed, 1.0) for seed in range(101, 105)]
        rows += [row("growing", seed, 1.04 + spread * (-1) ** seed) for seed in range(101, 105)]
        (check,) = [one for one in check_bars(rows) if one.name.startswith("coarse") and
                    "interval" in one.name]  # fmt: skip
        assert bool(check.ok) is met


def test_what_a_way_costs() -> None:
    """A tenth of the steps at twice the cost a step, of it 2 s a start, and 2 s of relaxation."""
    cost = {"engine": 10.0, "start_up": 2.0, "relax": 2.0}
    rows = [row(EVERY, 1, 1.0), row("way", 1, 1.0, computed=40, cost=cost)]
    assert find_step_speedup(rows, COARSE, "way") == pytest.approx(4000 * (8 / 400) / 12)


def test_every_way_starts_at_the_packings_state_and_ends_with_the_full_runs() -> None:
    """The last window of growing jumps ends at the bed's last cycle, the first begins at k_i."""
    for kind in KINDS.values():
        for method in list_methods(kind):
            p = kind.scene(kind.seeds[0], *method.settings).procedure
            assert p is not None
            assert p.total_cycles == kind.last
            assert p.k_i == kind.k_i
            if method.family == "growing":
                assert p.h is not None
                computed = p.window_cycles + len(p.h) * (p.healing_cycles + p.window_cycles)
                assert kind.k_i + computed + sum(p.h) == kind.last
                assert method.name != "growing" or computed == count_computed(kind)


def test_every_run_has_one_name() -> None:
    """As many parts as runs, and a law for each full run of two beds; full runs come first."""
    runs = [run for kind in KINDS.values() for run in list_runs(kind)]
    laws = sum(len(KINDS[name].seeds) for name in JUDGED_LAWS)
    assert len(PARTS) == len(runs) + laws
    assert next(iter(PARTS)) == f"confined-1, {EVERY}"


def test_a_thinned_table_is_even_in_the_logarithm() -> None:
    """First and last row stay, gaps in ln N differ by no more than rounding cycles makes."""
    found = {cycle: dict.fromkeys(("cycle", *GAINS), float(cycle)) for cycle in range(1, 10_001)}
    table = thin_table(found)
    assert table["cycle"][0] == 1
    assert table["cycle"][-1] == 10_000
    assert 40 <= len(table["cycle"]) <= 60
    late = np.diff(np.log([cycle for cycle in table["cycle"] if cycle > 100]))
    assert late.max() / late.min() < 1.1
    assert table["loaded_body"] == [float(cycle) for cycle in table["cycle"]]
    assert average_block(found, 20, "settlement") == pytest.approx(15.5)
