"""Residual displacement and its measures (eqs 8 to 15, 22) against values known by hand."""

from __future__ import annotations

from math import exp, log

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from adapters import residual
from adapters.errors import UsageError
from adapters.laws import law_named
from adapters.state import FloatArray


@pytest.fixture
def position() -> FloatArray:
    """Positions of 5 grains at the ends of 30 cycles, and before them [m], shape (31, 5, 3)."""
    steps = np.random.default_rng(0).normal(-1e-6, 1e-6, (31, 5, 3))
    return 0.05 + steps.cumsum(axis=0)


def test_displacement_is_the_sum_of_increments(position: FloatArray) -> None:
    """Eq. 12: u(t + pT) - u(t) is the sum of the increments up to p."""
    displacement = residual.residual_displacement(position)
    increment = residual.residual_increment(position)
    assert displacement.shape == (31, 5, 3)
    assert increment.shape == (30, 5, 3)
    assert not displacement[0].any()
    np.testing.assert_allclose(displacement[1:], np.cumsum(increment, axis=0), atol=1e-16)


def test_stability_of_displacement_is_eq_13_term_by_term(position: FloatArray) -> None:
    """g_u(k) equals the triple sum of eq. 13, and steps s of one grain give s k^(-1/2)."""
    measured = residual.stability_of_displacement(position)
    for k in (1, 7, 30):
        total = sum(
            (position[p, grain, axis] - position[p - 1, grain, axis]) ** 2
            for p in range(1, k + 1)
            for grain in range(5)
            for axis in range(3)
        )
        assert measured[k - 1] == pytest.approx(total**0.5 / k, rel=1e-12)
    steady = np.zeros((10, 1, 3))
    steady[:, 0, 2] = -2e-6 * np.arange(10)
    expected = 2e-6 * np.arange(1, 10) ** -0.5
    np.testing.assert_allclose(residual.stability_of_displacement(steady), expected, rtol=1e-12)


@pytest.mark.parametrize("name", ["linear", "log", "log-linear"])
def test_stability_of_error_is_eq_14_with_the_law_refitted(name: str, position: FloatArray) -> None:
    """f_xi(k) is the norm of the residuals of a law fitted to k cycles only, over k."""
    law = law_named(name)
    cycle = np.arange(10.0, 41.0)
    displacement = residual.residual_displacement(position)
    measured = residual.stability_of_error(law, cycle, displacement)
    for k in (12, 29, 30):
        rows = slice(law.first_state, k + 1)
        fitted = law.value(law.fit(cycle[rows], displacement[rows]), cycle[rows])
        square = ((displacement[rows] - fitted) ** 2).sum()
        assert measured[k - 31] == pytest.approx(square**0.5 / k, rel=1e-12)
    assert len(measured) == 30 - (law.minimum_cycles + law.first_state - 1) + 1


@pytest.mark.parametrize("name", ["log", "log-linear"])
def test_error_terms_have_zero_mean(name: str, position: FloatArray) -> None:
    """Eq. 12 takes xi as of zero mean: so it is for a law with a constant, grain by grain."""
    displacement = residual.residual_displacement(position)[1:]
    term = residual.error_term(law_named(name), np.arange(11.0, 41.0), displacement)
    assert term.shape == (30, 5, 3)
    assert np.abs(term.mean(axis=0)).max() < 1e-12 * np.abs(displacement).max()
    assert np.abs(term).max() > 1e-3 * np.abs(displacement).max()


def test_relative_errors_tell_displacements_from_coordinates() -> None:
    """Eq. 22 on a jump that is missed whole: 1 of the displacement, 1e-3 of the coordinates."""
    start = np.array([[0.0, 0.0, 1.0]])
    computed = start - [0.0, 0.0, 1e-3]
    assert residual.error_of_displacement(start, computed, start) == pytest.approx(1.0)
    assert residual.error_of_coordinates(computed, start) == pytest.approx(1e-3, rel=2e-3)
    assert residual.error_of_displacement(start, computed, computed) == 0.0
    half = start - [0.0, 0.0, 0.5e-3]
    assert residual.error_of_displacement(start, computed, half) == pytest.approx(0.5)
    with pytest.raises(UsageError, match="nothing moved"):
        residual.error_of_displacement(start, start, computed)


def test_chernoff_bound_is_eq_15() -> None:
    """k from eq. 15 by hand, and with it 2 exp(-2 k eps^2 / (b - a)^2) falls to p, not before."""
    low, high, error, probability = -3e-6, 2e-6, 1e-6, 0.1
    cycles = residual.cycles_for_error(low, high, error, probability)
    assert cycles == 38  # 25 / 2 ln 20 = 37.4...

    def chance(k: int) -> float:
        return 2 * exp(-2 * k * error**2 / (high - low) ** 2)

    assert chance(cycles) <= probability < chance(cycles - 1)
    level = residual.error_for_cycles(low, high, 38, probability)
    assert level == pytest.approx(5e-6 * (log(20) / 76) ** 0.5)


@given(
    width=st.floats(1e-6, 1e3),
    cycles=st.integers(1, 10**6),
    probability=st.floats(1e-9, 0.999),
)
def test_chernoff_bound_and_its_inverse_agree(
    width: float, cycles: int, probability: float
) -> None:
    """The level that k cycles reach needs k cycles: one more where round-off lifts the ceiling."""
    level = residual.error_for_cycles(-width / 3, 2 * width / 3, cycles, probability)
    needed = residual.cycles_for_error(-width / 3, 2 * width / 3, level, probability)
    assert needed - cycles in (0, 1)


def test_chernoff_bound_holds_for_independent_terms() -> None:
    """2,000 samples of k fair coins: the mean leaves [-eps, eps] no oftener than p."""
    k = residual.cycles_for_error(-1.0, 1.0, 0.25, 0.2)
    means = np.random.default_rng(1).choice([-1.0, 1.0], (2000, k)).mean(axis=1)
    assert np.mean(np.abs(means) >= 0.25) <= 0.2


def test_chernoff_bound_fails_for_correlated_terms() -> None:
    """What the docstring warns of: terms that repeat 20 times break the bound."""
    k = residual.cycles_for_error(-1.0, 1.0, 0.25, 0.2)
    blocks = np.random.default_rng(1).choice([-1.0, 1.0], (2000, -(-k // 20)))
    means = np.repeat(blocks, 20, axis=1)[:, :k].mean(axis=1)
    assert np.mean(np.abs(means) >= 0.25) > 0.4


@pytest.mark.parametrize(
    "arguments",
    [(0.0, 1.0, 0.0, 0.1), (0.0, 1.0, -1.0, 0.1), (0.0, 1.0, np.nan, 0.1), (0.0, 1.0, 1e-200, 0.1),
     (0.0, 1.0, 0.1, 0.0), (0.0, 1.0, 0.1, 1.0), (0.0, 1.0, 0.1, np.nan), (1.0, 0.0, 0.1, 0.1),
     (0.0, np.inf, 0.1, 0.1)],
)  # fmt: skip
def test_bound_refuses_what_it_has_no_answer_for(arguments: tuple[float, ...]) -> None:
    """Levels, probabilities and intervals out of range are refused with a sentence."""
    with pytest.raises(UsageError):
        residual.cycles_for_error(*arguments)


def test_bound_of_a_perfect_law_is_one_cycle() -> None:
    """No residual at all needs one cycle, and no cycle is no number of cycles."""
    assert residual.cycles_for_error(0.0, 0.0, 1e-6, 0.1) == 1
    with pytest.raises(UsageError, match="at least one"):
        residual.error_for_cycles(0.0, 1.0, 0, 0.1)
