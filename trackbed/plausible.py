"""Values that no ballast, track or body has: mostly numbers in another unit than SI."""

from dataclasses import dataclass
from math import radians, tan
from typing import Literal

Quantity = Literal[
    "friction", "density", "young", "grain", "body", "settlement", "strain",
    "bending", "line_mass", "stiffness", "mass", "axle", "speed", "level", "crib",
]  # fmt: skip
DEGREES = "an angle in degrees"


@dataclass(frozen=True)
class Bounds:
    """Least and greatest value that passes without a word, and what another unit would make."""

    what: str
    unit: str
    least: float
    most: float
    usual: tuple[float, float]  # where a value lies once it is read in the unit that was meant
    units: tuple[tuple[str, float], ...] = ()
    """Units that are mistaken for it, each with its factor to SI, the likeliest first."""


PLAUSIBLE: dict[Quantity, Bounds] = {
    "friction": Bounds(
        "friction", "", 0.0, 2.0, (0.05, 2.0), ((DEGREES, radians(1)), ("%", 0.01)),
    ),
    "density": Bounds(
        "density", "kg/m^3", 500.0, 20_000.0, (1000.0, 9000.0),
        (("g/cm^3", 1e3), ("kN/m^3", 1e3 / 9.81), ("t/mm^3", 1e12), ("g/m^3", 1e-3)),
    ),
    "young": Bounds(
        "Young's modulus", "Pa", 1e5, 2e12, (1e6, 7e11), (("GPa", 1e9), ("MPa", 1e6), ("kPa", 1e3)),
    ),
    "grain": Bounds("grain", "m", 1e-4, 1.0, (1e-4, 1.0), (("mm", 1e-3), ("um", 1e-6))),
    "settlement": Bounds("settlement", "m", 0.0, 1.0, (1e-5, 0.5), (("mm", 1e-3),)),
    "strain": Bounds("strain", "", 0.0, 1.0, (1e-5, 0.5), (("%", 0.01),)),
    "body": Bounds("body", "m", 0.0, 100.0, (1e-3, 100.0), (("mm", 1e-3), ("um", 1e-6))),
    "bending": Bounds(
        "bending stiffness", "N m^2", 1e4, 1e8, (1e5, 1e8), (("MN m^2", 1e6), ("kN m^2", 1e3)),
    ),
    "line_mass": Bounds("rail", "kg/m", 0.0, 200.0, (10.0, 100.0), (("g/m", 1e-3),)),
    "stiffness": Bounds(
        "stiffness", "N/m", 1e4, 1e11, (1e6, 1e10), (("MN/m or kN/mm", 1e6), ("kN/m", 1e3)),
    ),
    "mass": Bounds("mass", "kg", 0.0, 1e4, (10.0, 1e3), (("g", 1e-3),)),
    "axle": Bounds(
        "axle load", "N", 1e3, 1e6, (5e4, 5e5), (("kN", 1e3), ("t", 9.81e3), ("kg", 9.81)),
    ),
    "speed": Bounds("speed", "m/s", 0.0, 150.0, (5.0, 140.0), (("km/h", 1 / 3.6),)),
    "level": Bounds("limit of a level", "m", 1e-5, 0.1, (1e-4, 0.05), (("mm", 1e-3),)),
    "crib": Bounds("crib's height", "m", 0.0, 1.0, (0.05, 0.6), (("mm", 1e-3), ("cm", 1e-2))),
}  # fmt: skip
"""Between soft rubber and diamond, cork and gold, a grain of sand and a long bridge span; of lines,
between a field railway's and ten times the heaviest there are."""


def describe_implausible(quantity: Quantity, value: float, where: str) -> str | None:
    """A sentence on a ``value`` [SI] that is hardly meant, or None where nothing is to be said.

    It names the place ``where`` it stands (a key, a file, a body), the number, and the unit in
    which the number would be a usual one.  Not a reason to refuse: zero is for the caller to judge.
    """
    bounds = PLAUSIBLE[quantity]
    if bounds.least <= value <= bounds.most:
        return None
    low, high = bounds.usual
    meant = ""
    for unit, factor in bounds.units:
        read = tan(value * factor) if unit == DEGREES else value * factor
        if low <= read <= high and (unit != DEGREES or value < 90):
            meant = f"; as {unit} it would be {read:.4g} {bounds.unit}".rstrip()
            break
    side, bound = ("below", bounds.least) if value < bounds.least else ("above", bounds.most)
    shown = f"{value:.6g} {bounds.unit}".rstrip()
    return f"{where}: a {bounds.what} of {shown} is {side} {bound:g}{meant}; give SI units"
