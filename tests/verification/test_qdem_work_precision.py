"""The work-precision report on trial: its arithmetic, its references, what it counts."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sparse
from scipy.integrate import solve_ivp

from validation import qdem_work_precision as precision
from validation import qdem_work_report as report
from validation.cases.qdem_cost import cost_checks
from validation.qdem_closed_forms import CONCRETE_BEAM, bar_speed, timoshenko_tip
from validation.qdem_work_methods import Answer, Costs, answer, newmark_matrices
from validation.qdem_work_problems import BENDING, TRAVEL
from validation.qdem_work_reference import (
    bending_reference,
    lobatto,
    mode_response,
    pulse_reference,
    raised,
)
from validation.qdem_work_words import table

Row = dict[str, Any]


def row(error: float | None, cost: float | None, elements: int = 1000, **more: Any) -> Row:
    """A run of the record."""
    return {
        "case": "qdem-cost-bending", "method": "QDEM", "setting": {"cells": [elements, 1, 1]},
        "error": error, "cost_s": cost, "elements": elements, "step_s": 1e-6, "work": 100,
        "parts_s": {"stepping": cost}, "ok": cost is not None,
    } | more  # fmt: skip


def power_law(errors: list[float], exponent: float = -2.0) -> list[Row]:
    """Runs whose cost is 0.01 error^exponent, on meshes of elements ~ error^(-3/2)."""
    return [row(e, 0.01 * e**exponent, round(1e6 * e**-1.5)) for e in errors]


# --- costs at equal error --------------------------------------------------------------------


def test_cost_between_runs_and_beyond_them() -> None:
    """A power law is a line in logarithms: it is met between runs, and beyond, there marked."""
    rows = power_law([0.2, 0.1, 0.05])
    between, beyond = report.cost_at(rows, 0.07), report.cost_at(rows, 0.01)
    assert between.seconds == pytest.approx(0.01 * 0.07**-2)
    assert not between.guessed
    assert beyond.seconds == pytest.approx(0.01 * 0.01**-2)
    assert beyond.guessed
    assert "extrapolated" in str(beyond)
    assert "extrapolated" not in str(between)


def test_cost_above_the_largest_error_is_the_cheapest_run() -> None:
    """Nothing costs less than the coarsest mesh; that is no extrapolation."""
    cost = report.cost_at(power_law([0.2, 0.1]), 0.9)
    assert cost.seconds == pytest.approx(0.01 * 0.2**-2)
    assert not cost.guessed


def test_cost_unknown() -> None:
    """No run, or one alone below whose error nothing is known: no number is made up."""
    assert np.isnan(report.cost_at([], 0.1).seconds)
    assert np.isnan(report.cost_at(power_law([0.2]), 0.1).seconds)


def test_dominated_runs_are_off_the_frontier() -> None:
    """Dearer and no better: dropped, wherever it stands in the list."""
    good = power_law([0.2, 0.1, 0.05])
    worse = row(0.15, 5.0, good[0]["elements"] + 1)
    assert report.frontier([worse, *good]) == good


def test_cancelled_errors_do_not_count() -> None:
    """A lucky long step has the error that a shorter step, or a finer mesh, shows."""
    lucky = row(0.01, 1.0, 1000, step_s=2.0)
    shorter, finer = row(0.1, 2.0, 1000, step_s=1.0), row(0.05, 3.0, 2000, step_s=2.0)
    errors = [r["error"] for r in report.dependable([lucky, shorter, finer])]
    assert errors == [0.1, 0.1, 0.05]
    assert report.cost_at([lucky, shorter, finer], 0.05).seconds == pytest.approx(3.0)


def test_order_of_convergence() -> None:
    """Error ~ elements^(-2/3) is second order; only the finest meshes count."""
    rows = power_law([0.08, 0.04, 0.02])
    assert report.order([row(0.9, 0.1, 10), *rows]) == pytest.approx(2.0, rel=1e-6)


def test_failed_runs_are_not_counted() -> None:
    """Neither in a family, nor in a cost."""
    good, failed, wrong = row(0.1, 1.0), row(None, None, 2000), row(0.01, 0.1, 3000, ok=False)
    assert report.family([good, failed, wrong], "bending", "QDEM float64") == [good]


def test_families_keep_settings_apart() -> None:
    """Precision, shorter steps and gmsh's meshes are families of their own."""
    rows = [
        row(0.1, 1.0, setting={"cells": [1, 1, 1]} | more)
        for more in ({}, {"precision": "float32"}, {"safety": 0.45})
    ]
    rows.append(row(0.1, 1.0, setting={"h": 0.1, "slowest": 0.0}))
    rows.append(row(0.1, 1.0, case="qdem-cost-pulse"))
    names = ("QDEM float64", "QDEM float32", "QDEM, shorter steps", "QDEM on gmsh's meshes")
    for name, wanted in zip(names, rows, strict=False):
        assert report.family(rows, "bending", name) == [wanted]


def test_table_marks_the_cheapest_and_what_is_extrapolated() -> None:
    """Bold: the least cost of a line.  Brackets: beyond the runs.  "none": unknown."""
    newmark = [
        r | {"method": "P1 Newmark", "cost_s": 10 * r["cost_s"]} for r in power_law([0.3, 0.03])
    ]
    lines = table(power_law([0.3, 0.1]) + newmark, "bending").splitlines()
    assert lines[0].startswith("| error | QDEM float64 | QDEM float32 |")
    assert lines[2] == "| 30% | **0.11** | none | none | 1.1 | none |"
    assert lines[5] == "| 3% | **(11)** | none | none | 110 | none |"


def test_same_mesh_compares_the_longest_step_that_is_as_good() -> None:
    """Cost of a step, number of steps and time to solution against closed values."""
    setting = {"cells": [9, 1, 1], "solver": "direct"}
    ours = row(0.1, 10.0, setting={"cells": [9, 1, 1]}, work=1000)
    newmark = {"method": "P1 Newmark", "setting": setting}
    coarse = row(0.2, 1.0, work=10, step_s=4.0, **newmark)
    good = row(0.105, 3.0, work=20, step_s=2.0, parts_s={"stepping": 2.0}, **newmark)
    fine = row(0.1, 5.0, work=40, step_s=1.0, **newmark)
    found = report.same_mesh([ours, coarse, good, fine], "bending")
    assert found is not None
    assert found.per_step == pytest.approx((2.0 / 20) / (10.0 / 1000))
    assert found.steps == 50
    assert found.time == pytest.approx(10 / 3)


# --- the runs --------------------------------------------------------------------------------


def made(cost: float, displacement: float = 1.0) -> Answer:
    """A method's answer of a constant displacement."""
    times = np.linspace(0, BENDING.end, 20)
    moved = np.full(20, displacement)
    return Answer(times, moved, 1, 4, 19, float(times[1]), {"stepping": cost})


@pytest.mark.parametrize(("costs", "repeats"), [((0.1, 0.5, 0.2, 0.3, 0.4), 5), ((4, 2, 3), 3)])
def test_short_runs_are_made_five_times_and_long_ones_three(
    monkeypatch: pytest.MonkeyPatch, costs: tuple[float, ...], repeats: int
) -> None:
    """The median counts, and all are recorded."""
    rest = iter(costs)
    monkeypatch.setattr(precision, "answer", lambda *_: made(next(rest)))
    found = precision.row_of(("bending", "QDEM", {}), precision.RESULTS)
    assert found["repeats_s"] == list(costs)
    assert len(costs) == repeats
    assert found["cost_s"] == np.median(costs)


def test_a_motion_that_is_not_finite_has_no_cost(monkeypatch: pytest.MonkeyPatch) -> None:
    """A row is written that says so and never counts."""
    monkeypatch.setattr(precision, "answer", lambda *_: made(0.1, np.nan))
    found = precision.row_of(("bending", "QDEM", {}), precision.RESULTS)
    assert not found["ok"]
    assert found["cost_s"] is found["error"] is None
    assert "finite" in found["why"]


def test_a_run_that_raises_has_no_cost(monkeypatch: pytest.MonkeyPatch) -> None:
    """The other runs go on, and the reason is kept."""

    def fail(*_: object) -> Answer:
        raise ArithmeticError("too long a step")

    monkeypatch.setattr(precision, "answer", fail)
    found = precision.row_of(("pulse", "QDEM", {}), precision.RESULTS)
    assert not found["ok"]
    assert found["cost_s"] is None
    assert found["why"] == "ArithmeticError: too long a step"


def test_a_record_is_resumed(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Runs that the file has are not made again; rows stand in the order of the plan."""
    runs = [("bending", "QDEM", {"cells": [n, 1, 1]}) for n in (1, 2, 3)]
    asked: list[Any] = []

    def row_of(run: Any, _: Path) -> Row:
        asked.append(run)
        case, method, setting = run
        return row(0.1, 1.0, case=f"qdem-cost-{case}", method=method, setting=setting)

    monkeypatch.setattr(precision, "plan", lambda quick: runs[:2])
    monkeypatch.setattr(precision, "row_of", row_of)
    monkeypatch.setattr(precision, "_compile", lambda: None)
    path = tmp_path / "record.jsonl"
    precision.record_complete(path, True, ["command"])
    monkeypatch.setattr(precision, "plan", lambda quick: runs)
    rows = precision.record_complete(path, True, ["command"])
    assert asked == runs
    assert rows == [json.loads(line) for line in path.read_text().splitlines()]
    assert [r["setting"] for r in rows if r["method"] == "QDEM"] == [run[2] for run in runs]


# --- references ------------------------------------------------------------------------------


def test_lobatto_is_exact_for_polynomials() -> None:
    """Quadrature to degree 2p - 1, derivatives to degree p."""
    for p in (3, 6):
        points, weights, derivative = lobatto(p)
        for k in range(2 * p):
            assert weights @ points**k == pytest.approx((1 + (-1) ** k) / (k + 1), abs=1e-13)
        np.testing.assert_allclose(derivative @ points**p, p * points ** (p - 1), atol=1e-12)


def test_mode_response_solves_its_equation() -> None:
    """q'' + omega^2 q = raised(t) against a Runge-Kutta solution to 1e-9."""
    omega, rise = 170.0, 0.02
    times = np.linspace(0, 0.06, 61)
    found = solve_ivp(
        lambda t, q: [q[1], float(raised(np.array(t), rise)) - omega**2 * q[0]],
        (0, 0.06), [0.0, 0.0], "DOP853", times, rtol=1e-11, atol=1e-16, max_step=1e-3,
    )  # fmt: skip
    wanted = found.y[0]
    np.testing.assert_allclose(
        mode_response(times, np.array(omega), rise), wanted, atol=1e-7 * abs(wanted).max()
    )


@pytest.mark.long
def test_slow_bending_reference_is_timoshenkos_deflection() -> None:
    """A load raised in 10 s, 270 periods, is static: P L^3/3EI + P L/kappa G A.

    0.2 % less in three dimensions, where the clamp also holds the section's sides.
    """
    tip = bending_reference(CONCRETE_BEAM, 200.0, 10.0, np.array([10.0]), order=4)[0]
    assert tip == pytest.approx(timoshenko_tip(200.0), rel=4e-3)
    assert tip < timoshenko_tip(200.0)


@pytest.mark.long
def test_pulse_reference_is_dalemberts_without_poissons_ratio() -> None:
    """With nu = 0 the wave is plane: the free end moves with 2 p(t - L/c) / rho c."""
    beam = replace(CONCRETE_BEAM, poisson=0.0)
    times, speed, length = np.linspace(0, 8e-4, 401), bar_speed(beam.young, beam.density), 2e-4
    found = pulse_reference(beam, 1e6, length, times, order=4, count=20)
    since = times - beam.length / speed
    pressure = 1e6 * np.sin(np.pi * since / length) ** 2 * ((since > 0) & (since < length))
    wanted = 2 * pressure / beam.density / speed
    assert np.linalg.norm(found - wanted) < 3e-3 * np.linalg.norm(wanted)


def test_error_of_a_history() -> None:
    """0 of the answer itself, a tenth of one a tenth too large; of displacement, or velocity."""
    times = np.linspace(0, BENDING.end, 4001)
    moved, wanted = np.sin(100 * times), np.sin(100 * BENDING.times)
    assert BENDING.error(times, moved, wanted) < 1e-8
    assert BENDING.error(times, 1.1 * moved, wanted) == pytest.approx(0.1, rel=1e-6)
    times = np.linspace(0, TRAVEL.end, 4001)
    speed = 1e4 * np.cos(1e4 * TRAVEL.times)
    assert TRAVEL.error(times, np.sin(1e4 * times), speed) < 1e-6


# --- methods ---------------------------------------------------------------------------------


def test_newmarks_method_on_one_mass() -> None:
    """m u'' + k u = 1 - cos: second order towards the closed form of a load raised at once."""
    omega = 30.0
    errors = []
    for steps in (100, 200):
        step = 1.0 / steps
        found = newmark_matrices(
            sparse.csr_matrix([[omega**2]]), sparse.csr_matrix([[1.0]]), np.ones(1),
            lambda t: raised(t, 0.5), 0, step, steps, Costs(),
        )  # fmt: skip
        times = step * np.arange(steps + 1)
        errors.append(abs(found - mode_response(times, np.array(omega), 0.5)).max())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.15)


def test_methods_of_one_mesh_agree() -> None:
    """QDEM and central differences: the same history; Newmark with short steps: near it.

    The two explicit ones differ by their steps, 0.1 % apart, which move the error, of second
    order in the step, by 0.2 % of the step's share of it; Newmark's has none of that share.
    """
    setting = {"cells": [22, 2, 2]}
    wanted, _ = TRAVEL.reference()
    errors = {}
    for method, more in (
        ("QDEM", {}), ("QDEM", {"safety": 0.1}), ("P1 central difference", {}),
        ("P1 Newmark", {"steps_per_unit": 100}),
    ):  # fmt: skip
        found = answer(TRAVEL, method, setting | more)
        assert found.elements == 440
        errors[method, *more.values()] = TRAVEL.error(found.times, found.displacement, wanted)
    assert errors["P1 central difference",] == pytest.approx(errors["QDEM",], rel=1e-3)
    assert errors["P1 Newmark", 100] == pytest.approx(errors["QDEM", 0.1], rel=0.02)


def test_quadratic_elements_find_the_reference() -> None:
    """66 elements and steps of T/100: within 2 % of the reference, in amplitude and in time."""
    found = answer(BENDING, "P2 Newmark", {"cells": [11, 1, 1], "steps_per_unit": 100})
    assert BENDING.error(found.times, found.displacement, BENDING.reference()[0]) < 0.02


# --- the case's checks -----------------------------------------------------------------------


def broken(rows: list[Row], name: str) -> list[Row]:
    """The record with one thing wrong."""
    ours = max(
        (r for r in rows if r["method"] == "QDEM" and "bending" in r["case"]
         and list(r["setting"]) == ["cells"]),
        key=lambda r: 0 if r["elements"] > 60_000 else r["elements"],
    )  # fmt: skip
    if name == "a failed run":
        return [*rows, row(None, None)]
    changed = dict(ours)
    if name == "another answer":
        changed["error"] = 1.01 * ours["error"]
    else:
        changed["cost_s"] = 3 * ours["cost_s"]
        changed["parts_s"] = {"stepping": 3 * ours["parts_s"]["stepping"]}
    return [changed if r is ours else r for r in rows]


@pytest.mark.parametrize("name", ["a failed run", "another answer", "slow"])
def test_checks_can_fail(name: str) -> None:
    """On the committed record all hold; with one thing wrong at least one does not."""
    rows = report.rows_read(precision.RECORD)
    assert all(check.holds for check in cost_checks(rows, finest=3))
    assert not all(check.holds for check in cost_checks(broken(rows, name), finest=3))
