"""Laws with shape parameters or constrained amplitudes: recovery, invariances, oracles, speed."""

from __future__ import annotations

import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import curve_fit, nnls

from adapters.bed.state import FloatArray
from adapters.laws import Law, get_law

TRUE = {
    "log-linear": (1.0, 2.0, 0.01),
    "power": (1.0, 2.0, 0.3),
    "hyperbolic": (1.0, 2.0, 30.0),
    "stretched-exponential": (1.0, 2.0, 30.0, 0.5),
    "inverse-log": (1.0, 2.0, 30.0, 0.5),
}
"""Parameters of a series in mm over 100 cycles, each term of some weight."""
CYCLE = np.arange(1.0, 101.0)
every_law = pytest.mark.parametrize("name", TRUE)  # of the others, `test_laws` knows


def series(name: str) -> FloatArray:
    """The law's own values [mm] at `CYCLE`."""
    return get_law(name).value(np.array(TRUE[name]), CYCLE)


def increment(law: Law, cycle: FloatArray, displacement: FloatArray, reach: float) -> FloatArray:
    """Increment from the last cycle to ``reach`` times it."""
    last = float(cycle[-1])
    return law.increment(law.fit(cycle, displacement), last, reach * last)


@every_law
@pytest.mark.parametrize("seed", range(3))
def test_no_worse_than_a_general_optimiser(name: str, seed: int) -> None:
    """scipy's curve_fit, started at the truth, finds no lower sum of squares inside the bounds.

    Noise of 0.05 mm in 100 readings; curve_fit's own tolerance is 1e-8.
    """
    law = get_law(name)
    noisy = series(name) + 0.05 * np.random.default_rng(seed).standard_normal(len(CYCLE))
    found = law.fit(CYCLE, noisy)
    ours = ((noisy - law.value(found, CYCLE)) ** 2).sum()
    low, high = (np.full(len(found), edge) for edge in (0.0, np.inf))
    low[0] = -np.inf
    for index, parameter in enumerate(law.parameter_names):
        if parameter == "tau":
            low[index], high[index] = 0.1, 1e4
        elif name == "stretched-exponential" and parameter == "b":
            low[index], high[index] = 0.1, 1.0
        elif name == "power" and parameter == "b":
            low[index], high[index] = 0.02, 1.0
        elif parameter == "B":
            low[index], high[index] = 0.01, 10.0
    best, _ = curve_fit(
        lambda n, *p: law.value(np.array(p), n),
        CYCLE,
        noisy,
        p0=TRUE[name],
        bounds=(low, high),
        x_scale=np.abs(TRUE[name]),
        max_nfev=2000,
    )
    theirs = ((noisy - law.value(best, CYCLE)) ** 2).sum()
    assert ours <= theirs * (1 + 1e-6)


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=60)
def test_two_terms_of_one_sign_are_non_negative_least_squares(seed: int) -> None:
    """``log-linear``: the better of scipy's nnls for u and for -u."""
    random = np.random.default_rng(seed)
    cycle = random.uniform(0.5, 3.0, 9).cumsum()
    columns = np.stack([np.log(cycle), cycle])
    columns -= columns.mean(axis=1, keepdims=True)
    target = random.standard_normal(9).cumsum()
    ways = [nnls(columns.T, sign * (target - target.mean())) for sign in (1, -1)]
    better = min(range(2), key=lambda way: ways[way][1])
    found = get_law("log-linear").fit(cycle, target)
    np.testing.assert_allclose(found[1:], (1, -1)[better] * ways[better][0], atol=1e-9)


@every_law
@pytest.mark.parametrize("shape", ["burst", "accelerating", "reversing", "huge", "outlier"])
def test_hard_series_give_finite_numbers(name: str, shape: str) -> None:
    """Steps, growth as N^3, a reversal, cycles to 1e9 and one wild reading: a fit, all finite."""
    law, cycle = get_law(name), CYCLE
    if shape == "huge":
        cycle = np.geomspace(1, 1e9, 60)
    displacement = {
        "burst": (cycle > 50) * 1.0,
        "accelerating": cycle**3,
        "reversing": np.sin(cycle / 20),
        "huge": np.log(cycle),
        "outlier": np.where(cycle == 40, 50.0, np.log(cycle)),
    }[shape]
    found = law.fit(cycle, displacement)
    assert np.isfinite(found).all()
    assert np.isfinite(law.increment(found, cycle[-1], 10 * cycle[-1]))
    amplitude = found[1:3] if "b" in law.parameter_names[2] and len(found) > 3 else found[1:2]
    assert (amplitude >= 0).all() or (amplitude <= 0).all()


@pytest.mark.parametrize(("name", "bar"), [("hyperbolic", 2.5), ("stretched-exponential", 6.0)])
def test_thousands_of_grains_at_once(name: str, bar: float) -> None:
    """1,000 grains, 3 axes, 50 cycles: one shape parameter within 2.5 s, two within 6 s."""
    law, random = get_law(name), np.random.default_rng(0)
    many = series(name)[:50, None, None] + 0.05 * random.standard_normal((50, 1000, 3))
    start = time.process_time()
    law.fit(CYCLE[:50], many)
    assert time.process_time() - start < bar
