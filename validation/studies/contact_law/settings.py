"""The eight single impacts of Chung and Ooi (2011), as data: settings, materials, bars.

Chung, Y. C. and Ooi, J. Y. (2011), Benchmark tests for verifying discrete element modelling codes
at particle impact level, Granular Matter 13, 643-656.  The numbers are those with which other
codes' suites run these tests.  A plane is rigid: its Young's modulus is `RIGID` times the grain's.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import cos, radians, sin

RIGID = 1e6
"""Young's modulus of a rigid plane over that of the grain; it softens E* by 1e-6."""

STEPS = 1000
"""Time steps in the contact time of an undamped impact at the greatest speed: the documented step,
at which all bars hold."""

TOLERANCE_HERTZ = 0.01
"""Analytic bar of tests 1 to 3, relative."""
TOLERANCE_SLIDING = 0.02
"""Analytic bar of the sliding and sticking limits in tests 4 to 8, relative."""


@dataclass(frozen=True)
class Material:
    """Elastic constants of a grain."""

    name: str
    young: float
    """Young's modulus [Pa]."""
    poisson: float
    density: float
    """Density [kg/m^3]."""


@dataclass(frozen=True)
class Impact:
    """How a grain arrives: relative velocity of the centres, spins."""

    normal: float
    """Speed of approach V_n [m/s]."""
    tangential: float = 0.0
    """Velocity along the plane of contact [m/s]."""
    spin: float = 0.0
    """Spin of the grain [rad/s]; positive spin and negative tangential velocity slide alike."""


@dataclass(frozen=True)
class Setting:
    """One test with one material and one restitution; its impacts run side by side."""

    test: int
    material: Material
    radius: float
    """Radius of the grain [m]."""
    impacts: tuple[Impact, ...]
    restitution: float = 1.0
    friction: float = 0.0
    partner_radius: float | None = None
    """Radius of the other grain [m]; None for a rigid plane."""
    partner_mass_factor: float = 1.0
    """Density of the other grain over that of the first."""
    partner_spins: bool = False
    """The other grain has the same spin; the relative velocity is shared by both."""

    @property
    def label(self) -> str:
        """Words that begin the names of its checks."""
        return f"test {self.test}, {self.material.name}"


GLASS = Material("glass", 48e9, 0.20, 2800.0)
LIMESTONE = Material("limestone", 20e9, 0.25, 2500.0)
ALUMINIUM = Material("aluminium alloy", 70e9, 0.30, 2699.0)
MAGNESIUM = Material("magnesium alloy", 40e9, 0.35, 1800.0)
OXIDE = Material("aluminium oxide", 380e9, 0.23, 4000.0)
CAST_IRON = Material("cast iron", 100e9, 0.25, 7000.0)
ALUMINIUM_4 = Material("aluminium alloy", 70e9, 0.33, 2700.0)
STEEL = Material("steel", 208e9, 0.30, 7850.0)
POLYMER = Material("polymer", 1e9, 0.40, 1400.0)
NYLON = Material("nylon", 2.5e9, 0.40, 1000.0)
COPPER = Material("copper", 120e9, 0.35, 8900.0)


def make_oblique(speed: float, degrees: float) -> Impact:
    """A grain without spin that arrives ``degrees`` from the normal at ``speed`` [m/s]."""
    return Impact(speed * cos(radians(degrees)), speed * sin(radians(degrees)))


TEST_1 = Setting(1, GLASS, 0.01, (Impact(20.0),), friction=0.35, partner_radius=0.01)
TEST_2 = Setting(2, ALUMINIUM, 0.1, (Impact(0.2),))
TEST_3 = Setting(3, OXIDE, 2.5e-3, (Impact(3.9),))
TEST_4 = Setting(
    4,
    OXIDE,
    2.5e-3,
    tuple(make_oblique(3.9, degrees) for degrees in range(5, 90, 5)),
    restitution=0.98,
    friction=0.092,
)
TEST_5 = Setting(
    5,
    STEEL,
    1e-5,
    tuple(Impact(5.0, v) for v in (0.1, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 12, 14, 16, 18, 21)),
    friction=0.3,
)
TEST_6 = Setting(
    6,
    ALUMINIUM_4,
    0.1,
    tuple(Impact(0.2, spin=w) for w in (0.175, 1, 2, 3, 4, 5, 6, 8, 10, 12, 14, 16, 18, 21)),
    restitution=0.5,
    friction=0.4,
)
TEST_7 = replace(
    TEST_6,
    test=7,
    impacts=tuple(replace(impact, normal=0.4) for impact in TEST_6.impacts),
    partner_radius=0.1,
    partner_spins=True,
)
TEST_8 = replace(TEST_6, test=8, partner_radius=0.5, partner_mass_factor=1000.0)

RESTITUTIONS = (0.2, 0.4, 0.6, 0.8, 1.0)
"""Of test 3."""

NORMAL = (TEST_1, replace(TEST_1, material=LIMESTONE), TEST_2, replace(TEST_2, material=MAGNESIUM))
"""Tests 1 and 2: elastic, head-on, followed step by step."""
RESTITUTION = tuple(
    replace(TEST_3, material=material, restitution=e)
    for material in (OXIDE, CAST_IRON)
    for e in RESTITUTIONS
)
"""Test 3."""
TANGENTIAL = (
    TEST_4,
    replace(TEST_4, material=ALUMINIUM_4),
    TEST_5,
    replace(TEST_5, material=POLYMER),
    TEST_6,
    replace(TEST_6, material=NYLON),
    TEST_7,
    replace(TEST_7, material=COPPER),
    TEST_8,
    replace(TEST_8, material=NYLON),
)
"""Tests 4 to 8: oblique or spinning, judged by what is left afterwards."""
