"""What every law of residual displacement satisfies, found as it is; none is named here."""

from __future__ import annotations

import numpy as np
import pytest

from adapters.bed.state import FloatArray
from adapters.errors import UsageError
from adapters.laws import get_law, list_laws
from adapters.laws.form.contract import Law
from tests.contracts.protocols import list_missing

CYCLE = np.arange(1.0, 41.0)
SETTLING = -1e-5 * np.stack(
    [np.log(CYCLE), 10 * -np.expm1(-CYCLE / 10), np.sqrt(CYCLE), np.log(CYCLE) + CYCLE / 40], axis=1
)
"""Settlements of four kinds [m]."""
FAULTY = np.where(CYCLE[:5, None] == 3.0, np.nan, 0.0)
ROUND_OFF = 1e-12
SEARCHED = 1e-7  # of a shape parameter, which is searched to half of the digits of a number

every_law = pytest.mark.parametrize("name", list_laws())


def as_printed(law: Law) -> bool:
    """Whether it is kept with the faults of the paper it is from, and says so."""
    return getattr(law, "as_printed", False)


@every_law
def test_nothing_is_missing(name: str) -> None:
    """It has all that `Law` asks for, the name of its file, and a unit for each parameter."""
    law = get_law(name)
    assert not (missing := list_missing(law, Law)), f"the law {name} lacks {', '.join(missing)}"
    assert law.name == name
    assert len(law.parameter_names) == len(law.parameter_units)
    assert law.minimum_cycles >= 2
    assert law.first_state in (0, 1)


@every_law
def test_bed_at_rest_stays(name: str) -> None:
    """Nothing moved, so nothing will; parameters have the shape of the data behind their own."""
    law = get_law(name)
    still = law.fit(CYCLE, np.zeros((40, 2, 3)))
    assert still.shape == (len(law.parameter_names), 2, 3)
    assert not law.increment(still, 40.0, 80.0).any()
    if not as_printed(law):
        lasting = law.fit(CYCLE, np.full(40, 3.0))
        assert law.increment(lasting, 40.0, 1e9) == pytest.approx(0.0, abs=1e-9)


@every_law
def test_origin_and_direction_do_not_matter(name: str) -> None:
    """Counted from anywhere, downwards or upwards (heave): the same increment."""
    law = get_law(name)
    here = law.increment(law.fit(CYCLE, SETTLING), 40.0, 80.0)
    there = law.increment(law.fit(CYCLE, -SETTLING), 40.0, 80.0)
    np.testing.assert_array_equal(there, -here)
    if not as_printed(law):
        there = law.increment(law.fit(CYCLE, SETTLING + 1e-3), 40.0, 80.0)
        np.testing.assert_allclose(there, here, rtol=0, atol=SEARCHED * np.abs(here).max())


@every_law
def test_own_curve_is_recovered(name: str) -> None:
    """Fitted to its own values a law returns them, and the same prediction, to round-off."""
    law = get_law(name)
    parameters = law.fit(CYCLE, SETTLING)
    value = law.value(parameters, CYCLE)
    again = law.fit(CYCLE, value)
    assert np.abs(law.value(again, CYCLE) - value).max() <= ROUND_OFF * np.ptp(value)
    ahead, expected = (law.increment(p, 40.0, 80.0) for p in (again, parameters))
    np.testing.assert_allclose(ahead, expected, rtol=0, atol=SEARCHED * np.abs(expected).max())


@every_law
def test_increment_is_a_difference_of_values(name: str) -> None:
    """increment(n, n) = 0 and increment(n, m) = u(m) - u(n), for one m and for many at once."""
    law = get_law(name)
    parameters, ends = law.fit(CYCLE, SETTLING), np.array([40.0, 41.0, 80.0, 4000.0])
    found = law.increment(parameters, 40.0, ends)
    assert found.shape == (4, 4)
    np.testing.assert_array_equal(found[2], law.increment(parameters, 40.0, 80.0))
    if not as_printed(law):
        assert not found[0].any()
        values = law.value(parameters, ends)
        bound = ROUND_OFF * np.abs(values).max()
        np.testing.assert_allclose(found, values - law.value(parameters, 40.0), atol=bound)


@every_law
def test_a_bed_that_settles_settles_on(name: str) -> None:
    """After a settlement by ln N no prediction turns back, and none is longer than a millimetre."""
    law = get_law(name)
    ahead = law.increment(law.fit(CYCLE, SETTLING[:, 0]), 40.0, np.geomspace(41.0, 4000.0, 30))
    assert (np.diff(ahead) <= 0).all()
    assert -1e-3 < ahead[10] < 0


@every_law
def test_units_do_not_matter(name: str) -> None:
    """Metres or 1/1024 m change no bit; cycles counted in threes no more than the search does."""
    law = get_law(name)
    here = law.increment(law.fit(CYCLE, SETTLING), 40.0, 80.0)
    long = law.increment(law.fit(CYCLE, 1024 * SETTLING), 40.0, 80.0)
    np.testing.assert_array_equal(long, 1024 * here)
    if not as_printed(law):
        counted = law.increment(law.fit(3 * CYCLE, SETTLING), 120.0, 240.0)
        np.testing.assert_allclose(counted, here, atol=SEARCHED * np.abs(here).max())


@every_law
def test_each_grain_is_fitted_by_itself(name: str) -> None:
    """Columns of an array are fitted as each alone."""
    law = get_law(name)
    together = law.increment(law.fit(CYCLE, SETTLING.reshape(40, 2, 2)), 40.0, 80.0)
    alone = [law.increment(law.fit(CYCLE, column), 40.0, 80.0) for column in SETTLING.T]
    bound = SEARCHED * np.abs(together).max()
    np.testing.assert_allclose(together.ravel(), alone, rtol=0, atol=bound)


@every_law
@pytest.mark.parametrize(
    ("cycle", "displacement", "message"),
    [
        ([1.0], [0.0], "do not determine"),
        ([3.0, 3.0, 4.0, 5.0, 6.0], np.zeros(5), "ascend"),
        ([3.0, 5.0, 4.0, 6.0, 7.0], np.zeros(5), "ascend"),
        ([3.0, 4.0, 5.0, 6.0, np.nan], np.zeros(5), "finite"),
        ([-1.0, 1.0, 2.0, 3.0, 4.0], np.zeros(5), "negative|logarithm"),
        ([3.0, 4.0, 5.0, 6.0, 7.0], np.zeros(3), "shape"),
        ([3.0, 4.0, 5.0, 6.0, 7.0], [0.0, np.inf, -np.inf, 0.0, 0.0], "2 displacements are not"),
        ([3.0, 4.0, 5.0, 6.0, 7.0], FAULTY, r"at cycle 5, grain and axis \[0"),
    ],
)
def test_data_that_can_not_be_fitted_are_refused(
    name: str, cycle: list[float], displacement: FloatArray, message: str
) -> None:
    """A fit names what is wrong with its data, and never returns nan."""
    with pytest.raises(UsageError, match=message):
        get_law(name).fit(np.array(cycle), np.asarray(displacement))
