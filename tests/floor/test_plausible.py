"""Values that are hardly meant: the number, its place, and the unit that would make sense of it."""

from __future__ import annotations

import pytest

from trackbed.plausible import Quantity, describe_implausible


@pytest.mark.parametrize(
    ("quantity", "value", "words"),
    [
        ("young", 30.0, "as GPa it would be 3e+10 Pa"),
        ("young", 1000.0, "as MPa it would be 1e+09 Pa"),
        ("young", 30e3, "as MPa it would be 3e+10 Pa"),
        ("density", 2.71, "as g/cm^3 it would be 2710 kg/m^3"),
        ("density", 26.0, "as kN/m^3 it would be 2650 kg/m^3"),
        ("density", 2.35e-9, "as t/mm^3 it would be 2350 kg/m^3"),
        ("friction", 30.0, "as an angle in degrees it would be 0.5774"),
        ("grain", 4e-6, "4e-06 m is below 0.0001"),
        ("crib", 90.0, "a crib's height of 90 m is above 1"),
        ("grain", 31.5, "as mm it would be 0.0315 m"),
        ("body", 2000.0, "as mm it would be 2 m"),
        ("bending", 6.38, "as MN m^2 it would be 6.38e+06 N m^2"),
        ("line_mass", 60210.0, "as g/m it would be 60.21 kg/m"),
        ("stiffness", 28.0, "as MN/m or kN/mm it would be 2.8e+07 N/m"),
        ("stiffness", 28e12, "2.8e+13 N/m is above 1e+11; give SI units"),
        ("mass", 150e3, "as g it would be 150 kg"),
        ("axle", 200.0, "as kN it would be 2e+05 N"),
        ("axle", 22.5, "as t it would be 2.207e+05 N"),
        ("speed", 160.0, "as km/h it would be 44.44 m/s"),
        ("level", 1.5, "as mm it would be 0.0015 m"),
    ],
)
def test_the_unit_that_was_meant_is_named(quantity: Quantity, value: float, words: str) -> None:
    said = describe_implausible(quantity, value, "body 'beam'")
    assert said is not None
    assert said.startswith("body 'beam': a ")
    for part in (words, f"{value:.6g}"):
        assert part in said


@pytest.mark.parametrize(
    ("quantity", "value"),
    [("young", 210e9), ("young", 1e5), ("density", 7850.0), ("density", 500.0), ("friction", 2.0),
     ("friction", 0.0), ("grain", 0.063), ("body", 100.0)],
)  # fmt: skip
def test_what_there_is_passes_without_a_word(quantity: Quantity, value: float) -> None:
    assert describe_implausible(quantity, value, "here") is None
