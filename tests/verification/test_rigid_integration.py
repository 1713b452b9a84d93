"""Answers and measures of `validation.rigid_integration*`: each against another way to get it."""

from __future__ import annotations

from math import nan, sqrt

import numpy as np
import pytest

from rigid_lcp.simulation_input import Method
from validation import rigid_integration_scenes as motions
from validation.cases.rigid_integration import trace_checks
from validation.rigid_integration_impacts import energy_off, impact_ours, impacts
from validation.rigid_integration_order import (
    PROBLEMS,
    OrderRow,
    coordinates,
    order_fitted,
    order_row,
)
from validation.rigid_integration_steps import Attempts, drift, traces
from validation.rigid_integration_zeno import cut_off, rest_time
from validation.rigid_scenes import G, bouncing_disc, rocking_block_answer


def test_disc_skids_and_rolls() -> None:
    """Constant accelerations, and the change from one to the other is met: exact at any step."""
    run = motions.skidding_disc("acceleration", 0.05)
    run.advance(0.5)
    assert coordinates(run) == pytest.approx(motions.skidding_disc_answer(0.5), abs=1e-13)
    assert run.contacts.status.tolist() == ["stick"]


@pytest.mark.parametrize(("method", "step"), [("acceleration", 0.0125), ("time-stepping", 4e-3)])
def test_rod_tips_over_the_edge_and_slides(method: Method, step: float) -> None:
    """Sticks, then slides: both methods come to what two equations of motion say."""
    run = motions.rod_over_edge(method, step)
    run.advance(0.3)
    assert run.contacts.status.tolist() == ["slide"]
    # where it starts to slide is not met: the step that holds it is of second order
    assert coordinates(run) == pytest.approx(motions.rod_over_edge_answer(0.3), abs=2e-5)


def test_rocking_block_is_upright_when_housner_says() -> None:
    """At the times of impact, by quadrature, the block of the equations of motion stands upright,
    on the floor, and between its first two has swung as far as its energy lets it."""
    block = (0.2, 1.0, 0.1)
    times, share = rocking_block_answer(*block, 2)
    for time in times:
        x, height, angle = motions.rocking_block_state(*block, time)
        assert abs(angle) < 1e-10
        assert height == pytest.approx(1.0, abs=1e-10)
        assert x == pytest.approx(-0.2, abs=1e-10)
    alpha, radius = np.arctan2(0.2, 1.0), sqrt(1.04)
    x, height, angle = motions.rocking_block_state(*block, times.mean())
    assert height / radius - np.cos(alpha) == pytest.approx(
        share * (np.cos(alpha - 0.1) - np.cos(alpha)), rel=1e-9
    )
    assert angle > 0  # to the left, as it came from the right
    assert x < -0.2


def test_order_is_that_of_a_power_law() -> None:
    """h^2 with round-off at its end, which does not count."""
    rows = [OrderRow("p", "m", h, max(h * h, 1e-12), 0.0, 1) for h in (1e-1, 1e-2, 1e-3, 1e-7)]
    assert order_fitted(rows) == pytest.approx(2.0)
    assert np.isnan(order_fitted([OrderRow("p", "m", 1.0, nan, 0.0, 1)]))


def test_an_orientation_is_judged_up_to_its_sign() -> None:
    """A quaternion and its opposite are one; an error in it is half an angle."""
    problem = next(each for each in PROBLEMS if each.turned)
    row = order_row(problem, "acceleration", 4e-3)
    assert row.error == pytest.approx(3.4e-6, rel=0.05)
    exact = motions.stone_in_flight_answer(problem.seconds)
    assert problem.error(-exact) < 1e-15


def test_every_attempt_at_a_step_is_noted() -> None:
    """As many kept and taken back as the step control counts; they follow each other in time."""
    scene = bouncing_disc(0.05, 0.5).world.scene
    from rigid_lcp.simulation import Simulation

    noted = Attempts(2)
    run = Simulation(scene, "acceleration", step=0.01, loads=noted)
    run.pace.locating = False
    run.advance(0.15)
    steps = noted.steps()
    kept = [(start, length) for start, length, was_kept in steps if was_kept]
    assert len(kept) == run.pace.accepted
    assert len(steps) - len(kept) == run.pace.halved > 5
    ends = [start + length for start, length in kept]
    assert ends[:-1] == pytest.approx([start for start, _ in kept[1:]], abs=1e-14)
    assert ends[-1] == pytest.approx(0.15)


def test_steps_double_after_three_clean_ones_only() -> None:
    """Grains in a trough for a moment: what the case checks of a trace holds."""
    for trace in traces(0.05):
        checks = trace_checks(trace)
        assert [check.name for check in checks if not check.holds] == []


def test_drift_is_taken_out_of_gaps() -> None:
    """A disc slides round another: to round-off with the control, the fourth power without."""
    kept = drift("acceleration", 0.05, 0.0, 0.1, control=True)
    left = drift("acceleration", 0.05, 0.0, 0.1, control=False)
    assert kept.gap[-1] < 1e-13 < 1e-10 < left.gap[-1]
    assert kept.rounds >= 0.1


def test_touching_balls_leave_as_the_paper_says() -> None:
    """The row's note is read off the end: two of five balls in, all at once."""
    impact = next(each for each in impacts(True) if "touching" in each.case)
    row = impact_ours(impact, "time-stepping")
    assert row.ok
    assert row.why == "leave with -0.2 -0.2 0.8 0.8 0.8"


def test_energy_is_told_over_that_of_rest() -> None:
    """A block that has lost all its height has lost all its energy."""
    scene = next(each for each in impacts(True) if "flat" in each.case).scene
    path = np.zeros((1, 2, 6))
    path[0, 0, 1] = -0.01
    assert energy_off(scene, path) == pytest.approx(1.0)
    path[0, 0, 4] = sqrt(2 * G * 0.01)
    assert energy_off(scene, path) == pytest.approx(0.0, abs=1e-12)


def test_time_to_rest() -> None:
    """Flights of e = 0.5 added up by hand until the speed is a thousandth of the first."""
    speed = sqrt(2 * G * 0.1)
    time, flight = speed / G, 0.5
    while flight >= 1e-3:
        time += 2 * speed * flight / G
        flight *= 0.5
    assert rest_time(0.1, 0.5) == pytest.approx(time, rel=1e-12)
    # 1e-4 sqrt(g R) over (1 - e) of a flight, over 3 sqrt(2 h / g)
    assert cut_off(0.1, 0.5) == pytest.approx(4e-4 / (3 * sqrt(2)), rel=1e-12)
