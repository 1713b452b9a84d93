"""Errors, speed-up and gained time of a report, against hand-made runs with closed forms."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from math import isnan, log, nan
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from adapters.errors import UsageError
from adapters.files.run_folder import Outcome, RunFolder
from adapters.laws import get_law
from adapters.procedure.history import AVERAGED, History, list_failed_jumps, make_history, sum_cost
from adapters.procedure.members import compare_pairs
from adapters.procedure.record import Record, Track
from adapters.report.error import (
    COORDINATION_BAR,
    HEIGHT_BAR,
    compare_runs,
    extrapolate_curve,
    find_relative_error,
    find_speed_up,
    measure_jump,
)
from adapters.report.jumps import show_with_verdict

A = 3e-5  # settlement a ln(1 + N) of the hand-made full run [m]

SINKING = 4.0  # what the loaded body sinks by over the settlement of the mean grain

CYCLE_S = 4.0  # its CPU time a cycle [s]


def settled(cycle: float) -> float:
    """u(N) = a ln(1 + N) [m]."""
    return A * log(1 + cycle)


def row(cycle: int, kind: str = "computed", **columns: float) -> dict[str, Any]:
    """A row of a table; settlement of the closed form unless given."""
    values: dict[str, Any] = {
        "settlement": settled(cycle),
        "coordination_number": 4.0,
        "relative_density": 0.56,
        "elastic_deflection": 1e-5,
        "stiffness": 4e7,
        "force_error": 0.01,
        "maximum_overlap": 1e-7,
    }
    values |= {"cycle": cycle, "kind": kind} | columns
    return {"loaded_body": SINKING * values["settlement"]} | values


def window(first: int, last: int, healing: int = 0, **columns: float) -> Outcome:
    """A window of computed cycles, `CYCLE_S` each, a tenth of it Python's."""
    kinds = ["healing"] * healing + ["computed"] * (last - first - healing)
    rows = [row(first + 1 + c, kind, **columns) for c, kind in enumerate(kinds)]
    total = CYCLE_S * (last - first)
    cost = {"engine": 0.9 * total, "start_up": 0.2 * total, "parse": 0.1 * total}
    return Outcome("window", first, last, rows, cost)


def jump(first: int, last: int, cost_s: float, settlement: float | None = None) -> Outcome:
    """A jump; its record of relaxation has round numbers, see the tests."""
    if settlement is None:
        settlement = settled(last)
    before, estimated = 0.03 - settled(first), 0.03 - settlement - 1e-7
    record = {
        "method": "smallest-move",
        "before": {"mean_height": before, "coordination_number": 5.0},
        "estimated": {"mean_height": estimated, "coordination_number": 3.0},
        "relaxed": {"mean_height": 0.03 - settlement, "coordination_number": 4.9},
    }
    notes = {"h": last - first, "relaxation": record}
    rows = [row(last, "jumped", settlement=settlement)]
    return Outcome(
        "jump", first, last, rows, {"fit": 0.25 * cost_s, "relax": 0.75 * cost_s}, notes=notes
    )


def full_run(cycles: int = 100) -> History:
    """A full run in windows of 25 cycles."""
    return make_history([window(first, first + 25) for first in range(0, cycles, 25)])


def follow(outcomes: tuple[Outcome, ...]) -> Track:
    """A run of these stages, whose folder nobody looks into."""
    return Track(RunFolder(Path()), outcomes, ("",) * len(outcomes), (), (), ())


PROCEDURE = (
    Outcome("preparation", 0, 0, [], {"engine": 1000.0}),
    window(0, 25),
    window(25, 50),
    jump(50, 70, 3.0),
    window(70, 100, healing=5),
)


def test_definitions() -> None:
    """S = T_full / T_procedure; the error is signed, positive for too much; start-up counts once,
    as a part of the engine's time."""
    assert find_speed_up(28.0, 10.0) == pytest.approx(2.8)
    assert isnan(find_speed_up(1.0, 0.0))
    for value, reference, error in ((110, 100, 0.1), (-90, -100, 0.1), (90, 100, -0.1)):
        assert find_relative_error(value, reference) == pytest.approx(error)
    assert isnan(find_relative_error(1.0, 0.0))
    cost = {"engine": 5.0, "start_up": 2.0, "parse": 0.5, "fit": 0.25, "relax": 1.0, "other": 0.125}
    assert sum_cost(cost) == 6.875


def test_history_spreads_a_windows_cost_over_its_cycles() -> None:
    """CPU time at cycle N of a run of equal cycles is N times a cycle's; the rain is left out."""
    history = make_history(PROCEDURE)
    assert history.cycle.tolist() == [*range(1, 51), *range(70, 101)]
    assert np.allclose(history.cpu_s[:50], CYCLE_S * np.arange(1, 51))
    assert history.cpu_s[history.row(70)] == pytest.approx(50 * CYCLE_S + 3.0)
    assert history.cpu_s[-1] == pytest.approx(80 * CYCLE_S + 3.0)
    assert history.count_computed(100) == 80
    assert follow(PROCEDURE).spans == [(50, 70)]
    with pytest.raises(UsageError, match="60"):
        history.row(60)


@given(
    costs=st.lists(st.floats(0, 1e6), min_size=1, max_size=6),
    lost=st.lists(st.tuples(st.integers(0, 5), st.floats(0, 1e6)), max_size=4),
)
def test_no_cost_is_lost(costs: list[float], lost: list[tuple[int, float]]) -> None:
    """The last row bears all that the stages and the failed attempts before it cost."""
    stages = [
        Outcome("window", n, n + 1, [row(n + 1)], {"engine": cost, "start_up": cost / 2})
        for n, cost in enumerate(costs)
    ]
    history = make_history(stages, lost)
    borne = sum(seconds for cycle, seconds in lost if cycle < len(costs))
    assert history.cpu_s[-1] == pytest.approx(sum(costs) + borne)
    round_off = 1e-15 * len(history.cpu_s) * history.cpu_s[-1]  # of the running sum
    assert (np.diff(history.cpu_s) >= -round_off).all()


def test_a_jump_of_no_cycles_costs_too() -> None:
    """h = 0 leaves no row, but its relaxation is paid by the cycles after it."""
    still = Outcome("jump", 10, 10, [], {"relax": 7.0}, notes={"relaxation": {"method": "none"}})
    history = make_history([window(0, 10), still, window(10, 20)])
    assert history.cpu_s[9] == pytest.approx(10 * CYCLE_S)
    assert history.cpu_s[10] == pytest.approx(11 * CYCLE_S + 7)


def test_comparison_in_closed_form() -> None:
    """A run 2 % too deep, cut short or not: every error and the speed-up as by hand."""
    own = make_history(
        [
            *PROCEDURE[:-1],
            window(70, 100, 5, settlement=1.02 * settled(100), coordination_number=3.8,
                   elastic_deflection=1.5e-5, stiffness=3e7, loaded_body=3.8 * settled(100)),
        ]
    )  # fmt: skip
    row_ = compare_runs("x", own, 100, full_run(), 100, preparation_s=1000.0)
    assert row_.computed == 80
    assert row_.loaded_body_error == pytest.approx(-0.05)
    assert row_.settlement_error == pytest.approx(0.02)
    assert row_.stiffness_error == pytest.approx(-0.25)
    assert row_.coordination_number_error == pytest.approx(-0.05)
    assert row_.elastic_deflection_error == pytest.approx(0.5)
    assert row_.speed_up == pytest.approx(400 / 323)
    assert row_.speed_up_with_preparation == pytest.approx(1400 / 1323)
    assert isnan(row_.jump_displacement_error)


@pytest.mark.parametrize("zero", [0.0, 1.16e-3, -5.12e-4, -settled(100)])
def test_errors_know_no_zero(zero: float) -> None:
    """Wherever the piston came to rest: 2 % too much of what is gained since cycle 50 is 2 %."""
    own, full = (
        replace(one, settlement=one.settlement + zero, loaded_body=one.loaded_body - zero)
        for one in (make_history(PROCEDURE), full_run())
    )
    own.settlement[-1] += 0.02 * (settled(100) - settled(50))
    own.loaded_body[-1] -= 0.03 * SINKING * (settled(100) - settled(50))
    row_ = compare_runs("x", own, 100, full, 100, 0.0, before=50)
    assert row_.settlement_error == pytest.approx(0.02)
    assert row_.loaded_body_error == pytest.approx(-0.03)
    assert isnan(compare_runs("x", own, 100, full, 100, 0.0, before=100).settlement_error)
    for of, error in (("loaded_body", -0.03), ("settlement", 0.02)):
        assert compare_pairs([(own, full)], 50, 100, of).value == pytest.approx(error)


def test_stages_of_older_runs_know_the_loaded_body_by_its_heights() -> None:
    """Rows without its settlement, as version 0.2 wrote them: it counts from the first cycle."""
    old = window(0, 3)
    for one, height in zip(old.rows, (0.03, 0.0299, 0.0297), strict=True):
        del one["loaded_body"]
        one["piston_height"] = height
    history = make_history([old])
    np.testing.assert_allclose(history.loaded_body, [0.0, 1e-4, 3e-4], atol=1e-15)
    assert history.gain(2, 3, "loaded_body") == pytest.approx(2e-4)
    whole = make_history([old], loaded_start=0.031)
    np.testing.assert_allclose(whole.loaded_body, [1e-3, 1.1e-3, 1.3e-3], atol=1e-15)


def test_a_jump_that_settles_nothing_divides_by_no_zero() -> None:
    """A relaxation by 1 um in a jump that settles 1e-17 m: over a hundredth of the run's gain."""
    outcome = jump(50, 70, 1.0)
    record = outcome.notes["relaxation"]
    height = record["before"]["mean_height"]
    record["estimated"]["mean_height"] = height - 1e-17
    record["relaxed"]["mean_height"] = height - 1e-6
    own = make_history(PROCEDURE)
    figures = measure_jump("x", outcome, own, None)
    assert figures.height_change == pytest.approx(1e-6 / (0.01 * own.gain(50, 100)))


def test_averages_leave_jumped_rows_out() -> None:
    """Coordination number and deflection are means of the last computed cycles alone."""
    stages = [window(0, 50), jump(50, 70, 1.0), window(70, 74, coordination_number=2.0)]
    history = make_history(stages)
    assert AVERAGED == 10
    assert history.late_mean("coordination_number", 74) == 2.0
    assert history.late_mean("coordination_number", 50) == 4.0
    assert isnan(history.late_mean("coordination_number", 70))


@given(share=st.floats(0.01, 2.0), shift=st.floats(-10, 10), unit=st.sampled_from([1.0, 1e3]))
def test_displacement_error_of_a_share(share: float, shift: float, unit: float) -> None:
    """Moving every grain ``share`` of its way gives E_r = |1 - share|, in any unit and frame.

    E_r of the coordinates is smaller by the size of the sample, and not the same in every frame.
    """
    random = np.random.default_rng(3)
    before = unit * (random.uniform(0, 0.06, (40, 3)) + shift)
    full = before + unit * random.normal(0, 1e-4, (40, 3))
    beds = (before, full, before + share * (full - before))
    own, truth = make_history(PROCEDURE), full_run()
    row_ = compare_runs("x", own, 100, truth, 100, 0.0, beds)
    # Differences of coordinates of size |shift| + 0.06 carry round-off of that size over 1e-4.
    exact = abs(1 - share)
    tolerance = 1e-15 * (abs(shift) + 1) / 1e-5
    assert row_.jump_displacement_error == pytest.approx(exact, abs=tolerance)
    by_hand = exact * np.linalg.norm(full - before) / np.linalg.norm(full)
    assert row_.coordinates_error == pytest.approx(by_hand, abs=1e-12)


def test_a_run_that_did_not_move_has_no_displacement_error() -> None:
    """Without a denominator E_r is not known, rather than an exception or zero."""
    still = np.ones((5, 3))
    for before in (still, None):
        row_ = compare_runs("x", full_run(), 100, full_run(), 100, 0.0, (before, still, still))
        assert isnan(row_.jump_displacement_error)
        assert row_.coordinates_error == 0


def test_moving_nothing_is_the_full_run_cut_short() -> None:
    """The null hypothesis at m computed cycles: error ln(1+m)/ln(1+N) - 1 at a speed-up N/m."""
    row_ = compare_runs("x", full_run(), 80, full_run(), 100, 0.0)
    assert row_.settlement_error == pytest.approx(log(81) / log(101) - 1)
    assert row_.speed_up == pytest.approx(100 / 80)


def test_a_law_that_holds_is_extrapolated_without_error() -> None:
    """Fitting c + a ln N to a settlement of that form gives the full run at any cost."""
    rows = [row(n, settlement=1e-4 + A * log(n)) for n in range(1, 101)]
    full = make_history([Outcome("window", 0, 100, rows, {"engine": 400.0})])
    law = get_law("log")
    assert isnan(extrapolate_curve(full, law, 10, 11, 100))  # two cycles: no error of their own
    for last in (12, 20, 50, 99):
        exact = pytest.approx(1e-4 + A * log(100), rel=1e-9)
        assert extrapolate_curve(full, law, 10, last, 100) == exact


def test_the_steps_of_a_jump_add_up() -> None:
    """law + relaxation + healing = the run's settlement less the control's, same cycles."""
    own = make_history(
        [window(0, 50), jump(50, 70, 1.0, 1.1 * settled(70)), window(70, 100, 5, settlement=2e-4)]
    )
    full = full_run()
    figures = measure_jump("jump_000050_1", jump(50, 70, 1.0, 1.1 * settled(70)), own, full)
    assert figures.estimated == pytest.approx(1.1 * settled(70) - settled(50) + 1e-7)
    assert figures.truth == pytest.approx(settled(70) - settled(50))
    assert figures.relaxation_change == pytest.approx(-1e-7)
    apart = (2e-4 - settled(50)) - (settled(75) - settled(50))
    steps = figures.law_error + figures.relaxation_change + figures.healing_error
    assert steps == pytest.approx(apart)
    assert figures.coordination_change == pytest.approx(-0.02)
    assert figures.height_change == pytest.approx(1e-7 / figures.estimated)
    assert isnan(measure_jump("x", jump(50, 70, 1.0), own, None).truth)


@pytest.mark.parametrize(
    ("share", "verdict"),
    [(0.99, "met"), (-0.99, "met"), (1.01, "missed"), (-1.01, "missed"), (nan, "\N{EN DASH}")],
)
def test_a_jump_is_judged(share: float, verdict: str) -> None:
    """A relaxation keeps the coordination number within 3 % of the state before and the estimated
    mean height within 5 % of the jump's settlement, both ways; without one there is no verdict."""
    outcome = jump(50, 70, 1.0)
    record = outcome.notes["relaxation"]
    own = record["before"]["mean_height"] - record["estimated"]["mean_height"]
    height = record["estimated"]["mean_height"] + share * HEIGHT_BAR * own
    record["relaxed"] = {
        "mean_height": height, "coordination_number": 5 * (1 + share * COORDINATION_BAR),
    }  # fmt: skip
    if isnan(share):
        outcome.notes["relaxation"] = {"method": "none"}
    figures = measure_jump("x", outcome, make_history(PROCEDURE), None)
    for found, bar in (
        (figures.coordination_change, COORDINATION_BAR), (figures.height_change, HEIGHT_BAR),
    ):  # fmt: skip
        assert verdict in show_with_verdict(found, ".2f", bar)
    assert (COORDINATION_BAR, HEIGHT_BAR) == (0.03, 0.05)


def test_common_cycle() -> None:
    """Run and control are compared at the last cycle both have, behind the first jump."""
    cases = ((PROCEDURE, 75, 75), (PROCEDURE[:4], 75, 70), (PROCEDURE, 50, 0))
    for outcomes, last, expected in cases:
        control: Any = SimpleNamespace(history=full_run(last))
        record = Record(Path(), {}, control, follow(outcomes), control, (), 1)
        assert record.comparable_cycle == expected


def folder_of(path: Path, outcomes: tuple[Outcome, ...]) -> RunFolder:
    """A run folder with these stages."""
    folder = RunFolder(path)
    path.mkdir()
    for outcome in outcomes:
        name = outcome.stage
        if name != "preparation":
            name += f"_{outcome.first_cycle:06d}" + ("_1" if name == "jump" else "")
        folder.finish(folder.begin(name), outcome)
    return folder


def test_a_failed_jump_is_charged(tmp_path: Path) -> None:
    """A jump given up in the window after it costs its own time and the clock's until then."""
    folder = folder_of(tmp_path / "run", PROCEDURE[:4])
    times = ("2026-01-01T10:00:00Z", "2026-01-01T10:02:30Z", "2026-01-01T11:00:00Z")
    whats = ("finished", "jump failed", "finished")
    events = [
        f'{{"time": "{time}", "event": "{what}", "stage": "jump_000050_1"}}\n'
        for time, what in zip(times, whats, strict=True)
    ]
    folder.give_up("jump_000050_1", "nan")
    folder.give_up("jump_000050_2", "the relaxation did not converge")
    (tmp_path / "run" / "events.jsonl").write_text("".join(events))
    lost = [(one.stage, one.why, one.lost_s) for one in list_failed_jumps(folder)]
    assert lost == [
        ("jump_000050_1", "nan", pytest.approx(3.0 + 150.0)),
        ("jump_000050_2", "the relaxation did not converge", 0.0),
    ]
    assert all(
        before.first_cycle <= after.first_cycle
        for before, after in pairwise(list_failed_jumps(folder))
    )
