"""Material of QDEM: constants, arrays for each element, and what is no material."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from qdem_fem.element.material import Material
from qdem_fem.files.errors import MaterialError

CONCRETE = Material(45e9, 0.167, 2350, shear_viscosity=1e4)
positive = st.floats(1e-3, 1e15)
poissons = st.floats(-0.99, 0.499)
viscosities = st.floats(0, 1e12)


@given(positive, poissons, positive, viscosities, viscosities)
def test_constants_obey_the_relations_of_elasticity(
    young: float, poisson: float, density: float, shear: float, bulk: float
) -> None:
    """E = mu (3 lambda + 2 mu)/(lambda + mu), nu = lambda/(2 (lambda + mu)), rho c^2 = M.

    lambda + mu loses digits by 1/(1 + nu) and 1/(1 - 2 nu), at most 1000 here.
    """
    m = Material(young, poisson, density, shear, bulk)
    lam, mu = m.lame_first, m.lame_second
    assert mu * (3 * lam + 2 * mu) / (lam + mu) == pytest.approx(young, rel=1e-11)
    assert lam / (2 * (lam + mu)) == pytest.approx(poisson, rel=1e-11, abs=1e-11)
    assert density * m.wave_speed**2 == pytest.approx(lam + 2 * mu, rel=1e-11)
    assert m.viscous_second == shear
    assert m.viscous_first + 2 / 3 * shear == pytest.approx(bulk, rel=1e-15, abs=1e-15 * shear)
    assert m.is_viscous == (shear > 0 or bulk > 0)
    assert isinstance(m.wave_speed, float)
    wide = m.broadcast(3)
    for name in ("lame_first", "lame_second", "viscous_first", "viscous_second", "wave_speed"):
        np.testing.assert_array_equal(getattr(wide, name), [getattr(m, name)] * 3)


def test_concrete_of_the_paper() -> None:
    """rho c^2 = E (1 - nu)/((1 + nu)(1 - 2 nu)) = 45 GPa * 0.833/(1.167 * 0.666) = 48.23 GPa."""
    assert CONCRETE.wave_speed == pytest.approx(np.sqrt(48.23e9 / 2350), rel=1e-4)
    assert CONCRETE.viscous_first == pytest.approx(-2e4 / 3)


@pytest.mark.parametrize(
    ("field", "value", "said"),
    [
        ("young", 0, "0.0 Pa is not above zero"),
        ("young", -1e9, "not above zero"),
        ("density", 0.0, "0.0 kg/m^3 is not above zero"),
        ("poisson", 0.5, "finite bulk modulus"),
        ("poisson", 0.7, "finite bulk modulus"),
        ("poisson", -1, "not above -1"),
        ("shear_viscosity", -1e-9, "create energy"),
        ("bulk_viscosity", -1 / 3, "create energy"),
        ("young", 1e-320, "range of numbers"),
        ("young", 1.7e308, "range of numbers"),
        ("density", 1e-308, "range of numbers"),
        ("density", [1.0, 1e-308], "young, element 1"),
        ("density", [2350.0, 2400.0, -1.0, -2.0], "density, element 2: -1.0 kg/m^3"),
        ("poisson", np.array([0.2, 0.5]), "poisson, element 1"),
        ("young", [1e9, float("nan"), 1.0], "young, element 1: nan"),
    ],
)
def test_what_breaks_a_law_of_physics(field: str, value: Any, said: str) -> None:
    """The message has the field, the value, and of an array the first bad element."""
    given_values: dict[str, Any] = {"young": 1e9, "poisson": 0.4999, "density": 1e3, field: value}
    with pytest.raises(MaterialError) as error:
        Material(**given_values)
    assert said in str(error.value)
    assert field in str(error.value) or "young" in said or "range" in said
    assert error.value.remedy


NOT_REAL = [
    None,
    True,
    "45e9",
    1j,
    float("nan"),
    float("inf"),
    10**400,
    np.bool_(True),
    np.complex128(1),
    np.array([True, True]),
    np.array(["1"]),
    np.array([1j]),
    np.array([1, None]),
    np.array(np.nan),
    [1.0, True],
    [1.0, None],
    [1.0, 10**400],
    [[1.0], [1.0, 2.0]],
    [[1.0, 2.0]],
    [],
]


@pytest.mark.parametrize("value", NOT_REAL, ids=repr)
@pytest.mark.parametrize(
    "field", ["young", "poisson", "density", "shear_viscosity", "bulk_viscosity"]
)
def test_what_is_no_number(field: str, value: Any) -> None:
    """Booleans, text, nothing, complex, NaN, infinity, nested arrays: `MaterialError`, no other."""
    given_values: dict[str, Any] = {"young": 1e9, "poisson": 0.2, "density": 1e3, field: value}
    with pytest.raises(MaterialError, match=field):
        Material(**given_values)


anything = st.one_of(
    st.none(),
    st.booleans(),
    st.text(max_size=3),
    st.integers(),
    st.floats(),
    st.complex_numbers(),
    st.fractions(),
    st.lists(st.one_of(st.floats(), st.integers(), st.booleans(), st.none()), max_size=3),
)


@given(st.tuples(*[anything] * 5))
def test_any_input_makes_a_material_or_a_material_error(values: tuple[Any, ...]) -> None:
    """Whatever comes in; what comes out has finite moduli of a stable solid."""
    try:
        m = Material(*values)
    except MaterialError:
        return
    assert np.all(np.isfinite(m.lame_first + 2 * m.lame_second))
    assert np.all(np.greater(m.lame_second, 0))
    assert np.all(np.greater(m.wave_speed, 0))
    assert np.all(np.isfinite(m.wave_speed))


def test_kinds_of_numbers_that_are_taken() -> None:
    """Integers, NumPy scalars and fractions are floats afterwards; lists are arrays."""
    m = Material(np.float32(2), Fraction(1, 4), np.int64(3), np.array(1.0), [1, 2])
    assert m.young == 2.0
    assert (m.poisson, m.density, m.shear_viscosity) == (0.25, 3.0, 1.0)
    assert all(type(value) is float for value in (m.young, m.poisson, m.density))
    np.testing.assert_array_equal(m.bulk_viscosity, [1.0, 2.0])


def test_arrays_are_kept_safe() -> None:
    """A copy, not to be written: neither the giver nor the taker can change a material."""
    density = np.array([1.0, 2.0])
    m = Material(1.0, 0.2, density)
    density[0] = -1.0
    np.testing.assert_array_equal(m.density, [1.0, 2.0])
    with pytest.raises(ValueError, match="read-only"):
        m.density[0] = 5.0  # type: ignore[index]
    with pytest.raises(AttributeError):
        m.young = 2.0  # type: ignore[misc]


def test_lengths_must_agree() -> None:
    """Among the properties, and with the mesh."""
    with pytest.raises(MaterialError, match="young has 3, density has 2 values"):
        Material([1.0, 2.0, 3.0], 0.2, [1.0, 2.0])
    m = Material([1.0, 2.0, 3.0], 0.2, 1.0)
    np.testing.assert_array_equal(m.broadcast(3).density, [1.0, 1.0, 1.0])
    with pytest.raises(MaterialError, match="young has 3 values, but the mesh has 4 elements"):
        m.broadcast(4)
    with pytest.raises(MaterialError, match="but the mesh has 4 elements"):
        Material(1.0, 0.2, [1.0]).broadcast(4)
