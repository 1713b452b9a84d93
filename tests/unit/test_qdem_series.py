"""Values that change with time: tables, ramps, functions."""

from __future__ import annotations

from math import inf, nan
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import qdem_fem as q
from qdem_fem.files.errors import ConditionError
from qdem_fem.files.series import Driver, is_real

numbers = st.floats(-1e6, 1e6)


@given(st.lists(st.tuples(st.floats(1e-3, 10), numbers), min_size=1, max_size=8), st.floats(-5, 90))
def test_table_is_linear_between_its_rows_and_constant_outside(
    rows: list[tuple[float, float]], time: float
) -> None:
    """At a row its value; between two rows a value between theirs; beyond the ends those."""
    times = np.cumsum([gap for gap, _ in rows])
    values = np.array([value for _, value in rows])
    series = q.Series(times, values)
    np.testing.assert_allclose(series.at(times), values)
    after = int(np.searchsorted(times, time))
    near = values[max(after - 1, 0) : after + 1]
    slack = 1e-9 * abs(values).max()
    assert near.min() - slack <= series(time) <= near.max() + slack


def test_table_of_vectors() -> None:
    series = q.Series([0, 2], [[0, 0, 0], [2, 4, -6]])
    np.testing.assert_array_equal(series(1.0), [1, 2, -3])
    np.testing.assert_array_equal(series.at(np.array([-1.0, 9.0])), [[0, 0, 0], [2, 4, -6]])


def test_ramp_rises_then_stays() -> None:
    """The loading of section 3.1: linear over its duration, then constant."""
    ramp = q.make_ramp(0.5, [0, 0, -200.0])
    assert [ramp(t)[2] for t in (-1.0, 0.0, 0.25, 0.5, 7.0)] == [0, 0, -100, -200, -200]


@pytest.mark.parametrize(
    ("times", "values", "word"),
    [
        ([0, 1], [0, nan], "value number 1"),
        ([0, inf], [0, 1], "time number 1"),
        ([0, 1, 2], [[0, 0, 1], [nan, 0, 0], [0, 0, 0]], "value number 1"),
        ([1, 0], [0, 1], "row 0 to 1"),
        ([0, 0], [0, 1], "row 0 to 1"),
        ([0, 1], [0, 1, 2], "shape"),
        ([], [], "shape"),
        ("ab", [1, 2], "not a table"),
        ([0, 1], [[1, 2], [3]], "not a table"),
        ([[0, 1]], [0], "shape"),
    ],
)
def test_bad_tables(times: Any, values: Any, word: str) -> None:
    """The row at fault is named."""
    with pytest.raises(ConditionError, match=word):
        q.Series(times, values)


@pytest.mark.parametrize("duration", [0, -1.0, nan, inf, "1", None, True])
def test_bad_ramps(duration: Any) -> None:
    with pytest.raises(ConditionError):
        q.make_ramp(duration, 1.0)


def test_real_numbers() -> None:
    assert all(map(is_real, (1, 2.5, np.float32(3), np.int64(4))))
    assert not any(map(is_real, (True, nan, inf, "1", None, 1j, [1.0])))


@given(st.lists(st.floats(0, 50), min_size=1, max_size=20))
def test_driver_samples_a_table_and_a_function_alike(times: list[float]) -> None:
    table = q.Series([0.0, 10.0, 20.0], [[0, 1, 2], [3, 4, 5], [-6, 7, 8]])
    one = Driver(table, 3, "test").sample(np.array(times))
    other = Driver(lambda t: table(t), 3, "test").sample(np.array(times))
    assert one.shape == (len(times), 3)
    np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (True, "no number: True"),
        ("5", "no number: '5'"),
        (None, "no number: None"),
        ([[0, 1], [2]], "no number"),
        (np.zeros(2), "2 components, not 1"),
        (lambda: 1.0, r"the function failed at t = 0 s \(TypeError: .*\)\n  -> give a function"),
        (lambda t: 1 / t, r"the function failed at t = 0 s \(ZeroDivisionError: "),
        (lambda t: "x", "the value at t = 0 s is no number: 'x'"),
    ],
)
def test_driver_refuses_what_is_no_value(value: Any, words: str) -> None:
    with pytest.raises(ConditionError, match=f"force: .*{words}"):
        Driver(value, 1, "force")


@pytest.mark.peer("pandas")
def test_a_record_of_pandas_is_no_vector() -> None:
    """Three rows of a record would pass for the three components of a force."""
    import pandas

    record = pandas.Series([0.0, 1.0, 2.0], index=[0.0, 0.1, 0.2])
    with pytest.raises(ConditionError, match="pandas object does not say what its times are"):
        Driver(record, 3, "load")
    assert q.Series(record.index, record)(0.05) == pytest.approx(0.5)


def test_driver_says_when_a_function_fails() -> None:
    driver = Driver(lambda t: 1.0 if t < 2 else [1.0, 2.0], 1, "force")
    with pytest.raises(ConditionError, match=r"force: the value at t = 3 s has 2 components"):
        driver.sample(np.array([1.0, 3.0]))
    driver = Driver(lambda t: 1 / (t - 2), 1, "force")
    with pytest.raises(ConditionError, match=r"failed at t = 2 s \(ZeroDivisionError"):
        driver.sample(np.array([1.0, 2.0]))
