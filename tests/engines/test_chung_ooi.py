"""Chung and Ooi's tests on the engines that are installed: one material each, the short ones."""

from __future__ import annotations

from dataclasses import replace

import pytest

from adapters.engine_names import REAL_ENGINES
from validation.case import Check
from validation.chung_ooi import RESTITUTION, TEST_1, TEST_4, TEST_6, TEST_8, Setting
from validation.chung_ooi_checks import (
    Measured,
    closing_checks,
    normal_checks,
    order_check,
    regression_check,
    restitution_checks,
    sliding_impulse_error,
    tangential_checks,
    tangential_order_checks,
)
from validation.chung_ooi_impacts import motion_of, rebound_of
from validation.chung_ooi_reference import pull_factor

ENGINES = [pytest.param(name, marks=pytest.mark.engine(name)) for name in REAL_ENGINES]


def all_hold(checks: list[Check]) -> None:
    """Every check holds; the message names those that do not."""
    failing = [check for check in checks if not check.holds]
    assert checks
    assert not failing


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.long
def test_head_on_impacts(engine: str) -> None:
    """Tests 1 and 3 within 1 % at 1,000 steps in the contact, and as they were recorded."""
    measured: Measured = {}
    checks = normal_checks(TEST_1, engine, measured)
    checks += restitution_checks(RESTITUTION[1:2], engine, measured)
    all_hold([*checks, regression_check(engine, measured)])


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("restitution", [0.2, 1.0])
@pytest.mark.long
def test_order_in_the_step(engine: str, restitution: float) -> None:
    """First order with damping, 5/2 without."""
    all_hold([order_check(engine, restitution)])


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("setting", [TEST_4, TEST_8], ids=lambda s: f"test_{s.test}")
@pytest.mark.long
def test_sliding_and_sticking(engine: str, setting: Setting) -> None:
    """Tests 4 and 8 within 2 %, momentum to round-off, and as they were recorded."""
    measured: Measured = {}
    checks = tangential_checks(setting, engine, measured)
    all_hold([*checks, regression_check(engine, measured)])


@pytest.mark.engine("lammps")
def test_pull_of_eq_7_is_all_that_lammps_adds() -> None:
    """Under the scenes' law friction mu |F_n| adds 6.7 % at e = 0.5: the pull, and nothing else."""
    rebound = rebound_of(TEST_6, motion_of(TEST_6, "lammps"))
    excess = sliding_impulse_error(TEST_6, rebound)
    assert excess == pytest.approx(pull_factor(TEST_6.restitution) - 1, rel=2e-2)


@pytest.mark.engine("lammps")
@pytest.mark.long
def test_friction_converges_with_the_step() -> None:
    """First order, elastic and under the scenes' law."""
    all_hold(tangential_order_checks("lammps"))


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.long
def test_what_closes_the_gap(engine: str) -> None:
    """Each of pull and tangential damping adds what its law, integrated on paper, says."""
    all_hold(closing_checks(engine))


@pytest.mark.engine("lammps")
def test_a_wrong_friction_is_seen() -> None:
    """Grains whose friction is 3 % too large fail the 2 % bar of the sliding limit."""
    slippery = replace(TEST_4, friction=1.03 * TEST_4.friction)
    rebound = rebound_of(TEST_4, motion_of(slippery, "lammps", "sliding"))
    assert sliding_impulse_error(TEST_4, rebound) == pytest.approx(0.03, abs=1e-3)
