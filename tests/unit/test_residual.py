"""Residual displacement and its measures (eqs 11, 12, 15, 22) against values known by hand."""

from __future__ import annotations

from math import exp

import numpy as np
import pytest

from adapters.bed.state import FloatArray
from adapters.errors import UsageError
from adapters.laws import get_law
from adapters.laws.fit import residual


@pytest.fixture
def position() -> FloatArray:
    """Positions of 5 grains at the ends of 30 cycles, and before them [m], shape (31, 5, 3)."""
    steps = np.random.default_rng(0).normal(-1e-6, 1e-6, (31, 5, 3))
    return 0.05 + steps.cumsum(axis=0)


@pytest.mark.parametrize("name", ["log", "log-linear"])
def test_error_terms_have_zero_mean(name: str, position: FloatArray) -> None:
    """Eq. 12 takes xi as of zero mean: so it is for a law with a constant, grain by grain."""
    displacement = (position - position[0])[1:]
    term = residual.fit_error_term(get_law(name), np.arange(11.0, 41.0), displacement)
    assert term.shape == (30, 5, 3)
    assert np.abs(term.mean(axis=0)).max() < 1e-12 * np.abs(displacement).max()
    assert np.abs(term).max() > 1e-3 * np.abs(displacement).max()


def test_relative_errors_tell_displacements_from_coordinates() -> None:
    """Eq. 22 on a jump that is missed whole: 1 of the displacement, 1e-3 of the coordinates."""
    start = np.array([[0.0, 0.0, 1.0]])
    computed = start - [0.0, 0.0, 1e-3]
    assert residual.measure_displacement_error(start, computed, start) == pytest.approx(1.0)
    assert residual.measure_coordinates_error(computed, start) == pytest.approx(1e-3, rel=2e-3)
    assert residual.measure_displacement_error(start, computed, computed) == 0.0
    half = start - [0.0, 0.0, 0.5e-3]
    assert residual.measure_displacement_error(start, computed, half) == pytest.approx(0.5)
    with pytest.raises(UsageError, match="nothing moved"):
        residual.measure_displacement_error(start, start, computed)


def test_chernoff_bound_is_eq_15() -> None:
    """k from eq. 15 by hand, and with it 2 exp(-2 k eps^2 / (b - a)^2) falls to p, not before."""
    low, high, error, probability = -3e-6, 2e-6, 1e-6, 0.1
    cycles = residual.bound_cycles_for_error(low, high, error, probability)
    assert cycles == 38  # 25 / 2 ln 20 = 37.4...

    def chance(k: int) -> float:
        return 2 * exp(-2 * k * error**2 / (high - low) ** 2)

    assert chance(cycles) <= probability < chance(cycles - 1)


@pytest.mark.parametrize(
    "arguments",
    [(0.0, 1.0, 0.0, 0.1), (0.0, 1.0, -1.0, 0.1), (0.0, 1.0, np.nan, 0.1), (0.0, 1.0, 1e-200, 0.1),
     (0.0, 1.0, 0.1, 0.0), (0.0, 1.0, 0.1, 1.0), (0.0, 1.0, 0.1, np.nan), (1.0, 0.0, 0.1, 0.1),
     (0.0, np.inf, 0.1, 0.1)],
)  # fmt: skip
def test_bound_refuses_what_it_has_no_answer_for(arguments: tuple[float, ...]) -> None:
    """Levels, probabilities and intervals out of range are refused with a sentence."""
    with pytest.raises(UsageError):
        residual.bound_cycles_for_error(*arguments)


def test_bound_of_a_perfect_law_is_one_cycle() -> None:
    """No residual at all needs one cycle."""
    assert residual.bound_cycles_for_error(0.0, 0.0, 1e-6, 0.1) == 1
