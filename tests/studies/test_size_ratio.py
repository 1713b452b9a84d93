"""The study of size ratios: the closed forms that its runs are judged by."""

from __future__ import annotations

import numpy as np
import pytest

from adapters.scene.mechanics import find_wedge_ratio
from validation.studies.size_ratio.run import GRAVITY, LARGE, START, measure, roll

pytestmark = pytest.mark.studies


@pytest.mark.parametrize("friction", [0.3, 0.5, 1.0])
def test_at_the_wedge_ratio_the_contact_force_is_on_the_friction_cone(friction: float) -> None:
    """Held grains at -+R on an axis, a small one between them: the force that balances its twin on
    the other side is along the axis, and makes the angle of friction with the contact's normal."""
    small = LARGE / find_wedge_ratio(friction)
    normal = np.array([LARGE, np.sqrt((LARGE + small) ** 2 - LARGE**2)]) / (LARGE + small)
    assert normal[1] / normal[0] == pytest.approx(friction)
    assert find_wedge_ratio(0.0) == find_wedge_ratio(1e-200) == np.inf
    assert find_wedge_ratio(1e-8) == pytest.approx(2e16)


@pytest.mark.parametrize("ratio", [1.0, 3.0, 20.0])
def test_a_roll_keeps_its_energy(ratio: float) -> None:
    """m/2 v^2 + I/2 w^2 with v = w r sin(theta), from rest: speed against height."""
    small = LARGE / ratio
    height = np.sqrt((LARGE + small) ** 2 - LARGE**2)
    lever = small * height / (LARGE + small)
    time = np.linspace(0, 0.1, 2001)
    angle = roll(ratio, time)
    speed = height * np.gradient(angle, time)
    kinetic = 0.5 * speed**2 * (1 + 0.4 * (small / lever) ** 2)
    fallen = GRAVITY * height * (np.cos(START) - np.cos(angle))
    np.testing.assert_allclose(kinetic[5:-1], fallen[5:-1], rtol=1e-3)


@pytest.mark.engine("lammps")
@pytest.mark.parametrize(
    ("engine", "falls"), [("LAMMPS", False), ("LAMMPS, synchronized_verlet", True)]
)
def test_a_grain_sticks_beyond_the_wedge_ratio(engine: str, falls: bool) -> None:
    """At friction 1 and a ratio of 4, above 2.4: the error and its remedy; the roll is right."""
    row = measure(engine, 4.0, 1.0, 0.4)
    assert row["falls"] is falls
    assert abs(row["off"]) < 1e-3
