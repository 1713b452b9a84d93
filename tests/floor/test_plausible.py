"""Values that are hardly meant: the number, its place, and the unit that would make sense of it."""

from __future__ import annotations

import pytest

from trackbed.plausible import Quantity, describe_implausible


@pytest.mark.parametrize(
    ("quantity", "value", "words"),
    [
        ("young", 30.0, "as GPa it would be 3e+10 Pa"),
        ("young", 30e3, "as MPa it would be 3e+10 Pa"),
        ("density", 2.71, "as g/cm^3 it would be 2710 kg/m^3"),
        ("density", 26.0, "as kN/m^3 it would be 2650 kg/m^3"),
        ("density", 2.35e-9, "as t/mm^3 it would be 2350 kg/m^3"),
        ("friction", 30.0, "as an angle in degrees it would be 0.5774"),
        ("grain", 31.5, "as mm it would be 0.0315 m"),
        ("body", 2000.0, "as mm it would be 2 m"),
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
