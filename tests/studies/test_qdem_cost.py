"""The race of errors on trial: its arithmetic, its references, its methods."""

from __future__ import annotations

from copy import deepcopy
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sparse

from validation import study
from validation.studies.qdem_cost import reading as report
from validation.studies.qdem_cost.bars import check_bars
from validation.studies.qdem_cost.methods import Costs, answer_by, march_newmark
from validation.studies.qdem_cost.questions import BENDING, TRAVEL
from validation.study import Row

pytestmark = pytest.mark.studies


def row(error: float, cost: float, elements: int = 1000, **more: Any) -> Row:
    """A run of the record."""
    return {
        "method": "QDEM float64", "setting": {"cells": [elements, 1, 1]}, "error": error,
        "cost_s": cost, "elements": elements, "step_s": 1e-6, "work": 100,
    } | more  # fmt: skip


def power_law(errors: list[float], exponent: float = -2.0) -> list[Row]:
    """Runs whose cost is 0.01 error^exponent, on meshes of elements ~ error^(-3/2)."""
    return [row(e, 0.01 * e**exponent, round(1e6 * e**-1.5)) for e in errors]


def test_cost_between_runs_and_beyond_them() -> None:
    """A power law is a line in logarithms: it is met between runs, and beyond, there marked."""
    rows = power_law([0.2, 0.1, 0.05])
    between, beyond = report.find_cost(rows, 0.07), report.find_cost(rows, 0.01)
    assert between.seconds == pytest.approx(0.01 * 0.07**-2)
    assert not between.guessed
    assert beyond.seconds == pytest.approx(0.01 * 0.01**-2)
    assert beyond.guessed
    assert "extrapolated" in str(beyond)
    assert "extrapolated" not in str(between)


def test_cost_above_the_largest_error_is_the_cheapest_run() -> None:
    """Nothing costs less than the coarsest mesh; that is no extrapolation."""
    cost = report.find_cost(power_law([0.2, 0.1]), 0.9)
    assert cost.seconds == pytest.approx(0.01 * 0.2**-2)
    assert not cost.guessed


def test_cost_unknown() -> None:
    """No run, or one alone below whose error nothing is known: no number is made up."""
    assert np.isnan(report.find_cost([], 0.1).seconds)
    assert np.isnan(report.find_cost(power_law([0.2]), 0.1).seconds)


def test_dominated_runs_are_off_the_frontier() -> None:
    """Dearer and no better: dropped, wherever it stands in the list."""
    good = power_law([0.2, 0.1, 0.05])
    worse = row(0.15, 5.0, good[0]["elements"] + 1)
    assert report.find_best([worse, *good]) == good


def test_cancelled_errors_do_not_count() -> None:
    """A lucky long step has the error that a shorter step, or a finer mesh, shows."""
    lucky = row(0.01, 1.0, 1000, step_s=2.0)
    shorter, finer = row(0.1, 2.0, 1000, step_s=1.0), row(0.05, 3.0, 2000, step_s=2.0)
    errors = [r["error"] for r in report.list_dependable([lucky, shorter, finer])]
    assert errors == [0.1, 0.1, 0.05]
    assert report.find_cost([lucky, shorter, finer], 0.05).seconds == pytest.approx(3.0)


def test_order_of_convergence() -> None:
    """Error ~ elements^(-2/3) is second order; only the finest meshes count."""
    rows = power_law([0.08, 0.04, 0.02])
    assert report.fit_order([row(0.9, 0.1, 10), *rows]) == pytest.approx(2.0, rel=1e-6)


def test_table_marks_the_cheapest_and_what_is_extrapolated() -> None:
    """Bold: the least cost of a line.  Brackets: beyond the runs.  "none": unknown."""
    newmark = [
        r | {"method": "P1 Newmark", "cost_s": 10 * r["cost_s"]} for r in power_law([0.3, 0.03])
    ]
    rows = [{"part": "bending", "runs": power_law([0.3, 0.1]) + newmark}]
    lines = report.list_costs(rows, "bending").splitlines()
    assert lines[2] == "| 30% | **0.11** | none | none | 1.1 | none |"
    assert lines[5] == "| 3% | **(11)** | none | none | 110 | none |"


def test_error_of_a_history() -> None:
    """0 of the answer itself, a tenth of one a tenth too large; of displacement, or velocity."""
    times = np.linspace(0, BENDING.end, 4001)
    moved, wanted = np.sin(100 * times), np.sin(100 * BENDING.times)
    assert BENDING.error(times, moved, wanted) < 1e-8
    assert BENDING.error(times, 1.1 * moved, wanted) == pytest.approx(0.1, rel=1e-6)
    times = np.linspace(0, TRAVEL.end, 4001)
    speed = 1e4 * np.cos(1e4 * TRAVEL.times)
    assert TRAVEL.error(times, np.sin(1e4 * times), speed) < 1e-6


def test_newmarks_method_on_one_mass() -> None:
    """m u'' + k u = sin(a t) from rest: second order towards the closed form."""
    omega, a, errors = 30.0, 7.0, []
    for steps in (100, 200):
        step = 1.0 / steps
        found = march_newmark(
            sparse.csr_matrix([[omega**2]]), sparse.csr_matrix([[1.0]]), np.ones(1),
            lambda t: np.sin(a * t), 0, step, steps, Costs(),
        )  # fmt: skip
        times = step * np.arange(steps + 1)
        exact = (np.sin(a * times) - a / omega * np.sin(omega * times)) / (omega**2 - a**2)
        errors.append(abs(found - exact).max())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.15)


def test_methods_of_one_mesh_agree() -> None:
    """QDEM and central differences: the same history; Newmark with short steps: near it."""
    setting = {"cells": [22, 2, 2]}
    wanted, _ = TRAVEL.reference()
    errors = {}
    for method, more in (
        ("QDEM", {}), ("P1 central difference", {}), ("P1 Newmark", {"steps_per_unit": 100}),
    ):  # fmt: skip
        found = answer_by(method, TRAVEL, setting | more)
        assert found.elements == 440
        errors[method] = TRAVEL.error(found.times, found.displacement, wanted)
    assert errors["P1 central difference"] == pytest.approx(errors["QDEM"], rel=1e-3)
    assert errors["P1 Newmark"] == pytest.approx(errors["QDEM"], rel=0.1)


def test_quadratic_elements_find_the_reference() -> None:
    """66 elements and steps of T/100: within 2 % of the reference, in amplitude and in time."""
    found = answer_by("P2 Newmark", BENDING, {"cells": [11, 1, 1], "steps_per_unit": 100})
    assert BENDING.error(found.times, found.displacement, BENDING.reference()[0]) < 0.02


@pytest.mark.parametrize("name", ["another answer", "slow"])
def test_checks_can_fail(name: str) -> None:
    """On the record all hold or say why not; with one thing wrong at least one does neither."""
    rows = study.read_record(study.find_record("qdem-cost"))
    assert all(check.holds or check.why for check in check_bars(rows))
    wrong = deepcopy(rows)
    for run in wrong[0]["runs"]:
        if run["method"] == "QDEM float64":
            run["error" if name == "another answer" else "cost_s"] *= 1.01 if name != "slow" else 3
    assert not all(check.holds or check.why for check in check_bars(wrong))
