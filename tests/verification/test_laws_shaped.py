"""Laws with shape parameters or constrained amplitudes: recovery, invariances, oracles, speed."""

from __future__ import annotations

import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import curve_fit, nnls

from adapters.bed.state import FloatArray
from adapters.errors import UsageError
from adapters.laws import Law, get_law
from adapters.laws.form.projection import amplitudes, centred, orthonormal

TRUE = {
    "log-linear": (1.0, 2.0, 0.01),
    "shenton": (1.0, 2.0, 0.01),
    "power": (1.0, 2.0, 0.3),
    "hyperbolic": (1.0, 2.0, 30.0),
    "stretched-exponential": (1.0, 2.0, 30.0, 0.5),
    "inverse-log": (1.0, 2.0, 30.0, 0.5),
    "sato": (1.0, 2.0, 0.01, 20.0),
    "hca": (1.0, 2.0, 0.01, 20.0),
}
"""Parameters of a series in mm over 100 cycles, each term of some weight."""
CYCLE = np.arange(1.0, 101.0)
every_law = pytest.mark.parametrize("name", TRUE)
"""Of the others, `test_laws` knows."""


def series(name: str) -> FloatArray:
    """The law's own values [mm] at `CYCLE`."""
    return get_law(name).value(np.array(TRUE[name]), CYCLE)


def increment(law: Law, cycle: FloatArray, displacement: FloatArray, reach: float) -> FloatArray:
    """Increment from the last cycle to ``reach`` times it."""
    last = float(cycle[-1])
    return law.increment(law.fit(cycle, displacement), last, reach * last)


@every_law
def test_own_series_is_recovered(name: str) -> None:
    """A law returns the parameters of its own values; the search ends at round-off of the data.

    The residual's rounding, 1e-16 of 3 mm, moves parameters by at most the condition of the fit,
    below 1e5 for these; so 1e-8 of each.
    """
    law = get_law(name)
    found = law.fit(CYCLE, series(name))
    np.testing.assert_allclose(found, TRUE[name], rtol=1e-8)
    ahead = law.increment(np.array(TRUE[name]), 100.0, 1e4)
    assert increment(law, CYCLE, series(name), 100) == pytest.approx(float(ahead), rel=1e-8)


@every_law
@given(
    seed=st.integers(0, 2**32 - 1),
    unit=st.sampled_from([1e-3, 1.0, 1e2, 1e3]),
    period=st.sampled_from([0.02, 1.0, 1 / 3, 2.5e-5, 20.0]),
)
@settings(max_examples=12, deadline=None)
def test_prediction_has_no_units(name: str, seed: int, unit: float, period: float) -> None:
    """Strain, %, mm or m; cycles, seconds or million gross tonnes: one and the same prediction.

    In noise the search ends where a step gains less than 1e-8 of the squares: the prediction is
    known to about 1e-4 of its own standard deviation, and that is what may differ.
    """
    law, random = get_law(name), np.random.default_rng(seed)
    noise = 0.01 * random.standard_normal(len(CYCLE))
    here = increment(law, CYCLE, series(name) + noise, 10)
    there = increment(law, CYCLE * period, unit * (series(name) + noise), 10)
    assert there / unit == pytest.approx(float(here), rel=1e-3)


@every_law
@given(shift=st.floats(-10, 10), sign=st.sampled_from([1, -1]))
@settings(max_examples=8, deadline=None)
def test_origin_and_direction_do_not_matter(name: str, shift: float, sign: int) -> None:
    """Counted from anywhere, downwards or upwards (heave): the same increment."""
    law = get_law(name)
    here = increment(law, CYCLE, series(name), 10)
    there = increment(law, CYCLE, sign * (series(name) + shift), 10)
    assert sign * there == pytest.approx(float(here), rel=1e-6)


@every_law
def test_many_series_are_fitted_as_each_alone(name: str) -> None:
    """Shape (k, 5, 3): every column is predicted as by a fit of that column only.

    Parameters in a flat valley differ by where the search ends, predictions hardly.
    """
    law, random = get_law(name), np.random.default_rng(3)
    many = series(name)[:, None, None] * random.uniform(-2, 2, (5, 3))
    many = many + 0.02 * random.standard_normal((100, 5, 3))
    found = law.fit(CYCLE, many)
    assert found.shape == (len(law.parameter_names), 5, 3)
    ahead = law.increment(found, 100.0, 1000.0)[4, 1]
    assert increment(law, CYCLE, many[:, 4, 1], 10) == pytest.approx(float(ahead), rel=1e-3)
    assert law.value(found, CYCLE).shape == many.shape
    one, two = law.value(found, 7.0), law.value(found, np.array([7.0, 8.0]))
    np.testing.assert_array_equal(one, two[0])
    twice = law.increment(found, 100.0, np.array([200.0, 300.0]))
    np.testing.assert_allclose(twice[1], law.value(found, 300.0) - law.value(found, 100.0), 1e-9)


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
@settings(max_examples=60, deadline=None)
def test_amplitudes_of_one_sign_are_non_negative_least_squares(seed: int) -> None:
    """Two amplitudes: the better of scipy's nnls for u and for -u."""
    random = np.random.default_rng(seed)
    columns = centred(random.uniform(0, 1, (2, 9)).cumsum(axis=1), 1)
    target = centred(random.standard_normal(9).cumsum(), 0)
    q, triangle = orthonormal(columns)
    found, gain = amplitudes((q * target).sum(axis=1), triangle)
    ways = [nnls(columns.T, sign * target) for sign in (1, -1)]
    better = min(range(2), key=lambda way: ways[way][1])
    np.testing.assert_allclose(found, (1, -1)[better] * ways[better][0], atol=1e-10)
    assert float(target @ target - gain) == pytest.approx(ways[better][1] ** 2, abs=1e-9)


@every_law
@pytest.mark.parametrize(
    ("cycle", "displacement", "message"),
    [
        ([1.0, 2.0], np.zeros(2), "do not determine"),
        ([3.0, 3.0, 4.0, 5.0], np.zeros(4), "ascend"),
        ([3.0, 5.0, 4.0, 6.0], np.zeros(4), "ascend"),
        ([3.0, 4.0, 5.0, 6.0], [0.0, 1.0, np.nan, 2.0], "not finite"),
        ([-1.0, 1.0, 2.0, 3.0], np.zeros(4), "negative|logarithm"),
    ],
)
def test_data_that_can_not_be_fitted_are_refused(
    name: str, cycle: list[float], displacement: FloatArray, message: str
) -> None:
    """Two points, duplicates, disorder, nan, negative cycles: a sentence, never nan."""
    with pytest.raises(UsageError, match=message):
        get_law(name).fit(np.array(cycle), np.asarray(displacement))


@every_law
@pytest.mark.parametrize("level", [0.0, 3.0])
def test_a_constant_series_stays(name: str, level: float) -> None:
    """All zeros, or any constant: amplitudes are zero, nothing is predicted to move."""
    law = get_law(name)
    found = law.fit(CYCLE, np.full(100, level))
    assert np.isfinite(found).all()
    assert law.increment(found, 100.0, 1e9) == pytest.approx(0.0, abs=1e-9)


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
