"""Kelvin-Voigt material of QDEM: an isotropic spring and an isotropic dashpot side by side."""

from __future__ import annotations

import numbers
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from qdem_fem.files import Floats, MaterialError

Value = float | Floats

_UNITS = {
    "young": "Pa",
    "poisson": "",
    "density": "kg/m^3",
    "shear_viscosity": "Pa s",
    "bulk_viscosity": "Pa s",
}


@dataclass(frozen=True, eq=False)
class Material:
    """Properties of a body; each one float, or an array (m,) with a value for every element.

    Eqs 2 and 7 of Nishiura et al. 2017 with lambda_E, mu_E from Young's modulus and Poisson's
    ratio and lambda_D = bulk_viscosity - 2/3 shear_viscosity, mu_D = shear_viscosity.

    Raises `MaterialError`, naming the property, its value and the first bad element, for what is
    no finite real number and for what breaks a law of physics.  Dissipation D : T_D >= 0 for every
    D asks for shear and bulk viscosity >= 0; lambda_D itself may be negative, and is in the
    paper's tests, where the bulk viscosity is zero.  Arrays are copied and can not be written.
    """

    young: Value
    """Young's modulus E [Pa], > 0."""
    poisson: Value
    """Poisson's ratio [-], -1 < nu < 0.5.  Linear tetrahedra lock well below 0.5."""
    density: Value
    """Density in the reference configuration [kg/m^3], > 0."""
    shear_viscosity: Value = 0.0
    """mu_D [Pa s], >= 0."""
    bulk_viscosity: Value = 0.0
    """lambda_D + 2/3 mu_D [Pa s], >= 0."""

    def __post_init__(self) -> None:
        lengths: dict[str, int] = {}
        for field in fields(self):
            value = _check_real(field.name, getattr(self, field.name))
            object.__setattr__(self, field.name, value)
            if isinstance(value, np.ndarray):
                lengths[field.name] = len(value)
        if len(set(lengths.values())) > 1:
            named = ", ".join(f"{name} has {length}" for name, length in lengths.items())
            raise MaterialError(
                f"arrays of different lengths: {named} values",
                where="material", remedy="give every array one value for each element",
            )  # fmt: skip
        _check_laws(self)

    @property
    def lame_first(self) -> Value:
        """lambda_E = E nu/((1 + nu)(1 - 2 nu)) [Pa], float or (m,)."""
        return self.young * self.poisson / ((1 + self.poisson) * (1 - 2 * self.poisson))

    @property
    def lame_second(self) -> Value:
        """mu_E = E/(2 (1 + nu)) [Pa], float or (m,): the shear modulus."""
        return self.young / (2 * (1 + self.poisson))

    @property
    def viscous_first(self) -> Value:
        """lambda_D = bulk - 2/3 shear viscosity [Pa s], float or (m,); may be negative."""
        return self.bulk_viscosity - 2 / 3 * self.shear_viscosity

    @property
    def viscous_second(self) -> Value:
        """mu_D = shear viscosity [Pa s], float or (m,)."""
        return self.shear_viscosity

    @property
    def wave_speed(self) -> Value:
        """Speed of dilatational waves sqrt((lambda_E + 2 mu_E)/rho) [m/s], float or (m,)."""
        modulus = self.lame_first + 2 * self.lame_second
        speed = np.sqrt(modulus / self.density)
        return float(speed) if np.ndim(speed) == 0 else speed

    @property
    def is_viscous(self) -> bool:
        """Whether any element has a viscosity."""
        return bool(np.any(self.shear_viscosity) or np.any(self.bulk_viscosity))

    def broadcast(self, elements: int) -> Material:
        """The same material with an array (elements,) for each property.

        Raises `MaterialError` if a property is already an array of another length.
        """
        for field, value in zip(fields(self), self._values(), strict=True):
            if np.ndim(value) and np.size(value) != elements:
                raise MaterialError(
                    f"{field.name} has {np.size(value)} values, but the mesh has {elements} "
                    "elements",
                    where="material",
                    remedy="give one value for each element, in the order of the mesh, or a float",
                )
        return Material(*(np.broadcast_to(value, (elements,)) for value in self._values()))

    def _values(self) -> tuple[Value, ...]:
        return tuple(getattr(self, field.name) for field in fields(self))


def _check_real(name: str, value: Any) -> Value:
    """``value`` as a float or as an array (m,) that can not be written; `MaterialError` if not."""
    where = f"material, {name}"
    remedy = "give a real number" + (f" in {_UNITS[name]}" if _UNITS[name] else "")
    remedy += ", or one for each element"
    not_real = MaterialError(f"{value!r} is no real number", where=where, remedy=remedy)
    if isinstance(value, numbers.Real) and not isinstance(value, bool):
        try:
            number = float(value)
        except (OverflowError, ValueError):
            raise not_real from None
        if not np.isfinite(number):
            raise MaterialError(f"{number} is not finite", where=where, remedy=remedy)
        return number
    if not isinstance(value, np.ndarray | list | tuple):
        raise not_real
    try:
        array = np.asarray(value)
    except (ValueError, OverflowError):  # rows of different lengths
        raise not_real from None
    if array.dtype.kind not in "iuf":
        raise not_real
    if array.ndim == 0:
        return _check_real(name, array.item())
    if not isinstance(value, np.ndarray) and any(isinstance(v, bool | np.bool_) for v in value):
        raise not_real  # NumPy takes [1.0, True] for two numbers
    if array.ndim != 1 or array.size == 0:
        raise MaterialError(
            f"an array of shape {array.shape} does not give one value for each element",
            where=where, remedy=remedy,
        )  # fmt: skip
    array = np.array(array, float)
    _refuse_where(~np.isfinite(array), name, array, "is not finite", remedy)
    array.flags.writeable = False
    return array


def _check_laws(material: Material) -> None:
    """`MaterialError` for what no material can have."""
    m = material
    for name, value in (("young", m.young), ("density", m.density)):
        _refuse_where(
            np.less_equal(value, 0),
            name,
            value,
            "is not above zero",
            f"give a positive number in {_UNITS[name]}",
        )
    _refuse_where(
        np.greater_equal(m.poisson, 0.5),
        "poisson",
        m.poisson,
        "has no finite bulk modulus, which an explicit method needs: its waves would be "
        "infinitely fast",
        "stay below 0.5; near it (0.499) linear tetrahedra lock and the step gets short, up to "
        "about 0.4 they are sound",
    )
    _refuse_where(
        np.less_equal(m.poisson, -1),
        "poisson",
        m.poisson,
        "is not above -1: the shear modulus would not be positive",
        "solids lie between 0 and 0.5, auxetic ones above -1",
    )
    for name, value in (
        ("shear_viscosity", m.shear_viscosity),
        ("bulk_viscosity", m.bulk_viscosity),
    ):
        _refuse_where(
            np.less(value, 0),
            name,
            value,
            "is negative: the material would create energy",
            "give zero or more; lambda_D = bulk - 2/3 shear may be negative, and is for bulk = 0",
        )
    tiny, huge = np.finfo(float).tiny, np.finfo(float).max
    with np.errstate(all="ignore"):
        modulus = np.asarray(m.lame_first + 2 * m.lame_second)
        shear, speed_squared = np.asarray(m.lame_second), modulus / m.density
    sound = np.greater_equal(shear, tiny) & (modulus <= huge)
    _refuse_where(
        ~(sound & (tiny <= speed_squared) & (speed_squared <= huge)),
        "young",
        m.young,
        "gives moduli or a wave speed outside the range of numbers",
        f"check the units: {_UNITS['young']}, {_UNITS['density']}",
    )


def _refuse_where(bad: Any, name: str, value: Value, why: str, remedy: str) -> None:
    """Raise `MaterialError` with the first bad element of ``value``, if there is one."""
    if not np.any(bad):
        return
    first = int(np.argmax(np.ravel(bad)))
    unit = f" {_UNITS[name]}" if _UNITS[name] else ""
    element = f", element {first}" if np.ndim(bad) else ""
    shown = f"{float(np.broadcast_to(value, np.shape(bad) or (1,))[first])!r}{unit}"
    raise MaterialError(f"{shown} {why}", where=f"material, {name}{element}", remedy=remedy)
