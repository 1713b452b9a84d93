"""Contact law: closed forms of Hertz and Mindlin, restitution by integration, LIGGGHTS' figures."""

from __future__ import annotations

from math import gamma, inf, log, pi, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from adapters.bed import contact_law as law

YOUNG = st.floats(1e6, 1e12)
POISSON = st.floats(0, 0.49)
LENGTH = st.floats(1e-5, 1.0)


@given(young=YOUNG, poisson=POISSON)
def test_equivalent_moduli_of_equal_grains(young: float, poisson: float) -> None:
    """Two alike: E* = E/(2 (1 - nu^2)) and G* = G/(2 (2 - nu)), as below eqs 5 and 6."""
    shear = law.find_shear_modulus(young, poisson)
    assert law.combine_moduli(young, poisson, young, poisson) == pytest.approx(
        young / (2 * (1 - poisson**2)), rel=1e-14
    )
    assert law.combine_shear_moduli(young, poisson, young, poisson) == pytest.approx(
        shear / (2 * (2 - poisson)), rel=1e-14
    )


@given(young=YOUNG, poisson=POISSON, radius=LENGTH)
def test_mirror_is_a_rigid_plane(young: float, poisson: float, radius: float) -> None:
    """A grain on a rigid plane feels what it would feel from its mirror image.

    Two mirrored grains overlap by 2 delta, the grain and the plane by delta: with E* twice as
    large and R* twice as large the force is 2 * sqrt(2)/2^(3/2) = 1 times the same.
    """
    stiffness = law.make_hertz_stiffness(young, poisson, 3 * young, poisson / 2)
    overlap = 1e-3 * radius
    assert law.find_normal_force(overlap, stiffness.mirror, radius) == pytest.approx(
        law.find_normal_force(2 * overlap, stiffness.grain, radius / 2), rel=1e-13
    )


@given(overlap=st.floats(1e-9, 1e-3), modulus=YOUNG, radius=LENGTH)
def test_normal_force_slope_and_inverse(overlap: float, modulus: float, radius: float) -> None:
    """dF/d delta = S_n = 2 E* sqrt(R* delta), and the overlap under a force inverts eq. 5."""
    force = law.find_normal_force(overlap, modulus, radius)
    slope = 2 * modulus * np.sqrt(radius * overlap)
    assert 1.5 * force / overlap == pytest.approx(slope, rel=1e-13)
    assert law.find_overlap_under_force(force, modulus, radius) == pytest.approx(overlap, rel=1e-12)


def test_no_force_without_overlap() -> None:
    """Grains apart exert nothing: force and stiffnesses are zero for an open gap."""
    gaps = np.array([-1e-3, 0.0])
    for function in (law.find_normal_force, law.find_tangential_stiffness):
        assert function(gaps, 1e10, 1e-3).tolist() == [0, 0]


@given(poisson=POISSON)
def test_ratio_of_stiffnesses(poisson: float) -> None:
    """k_t/S_n = 4 G*/E* = 2 (1 - nu)/(2 - nu), Mindlin's ratio for two equal grains."""
    modulus = law.combine_moduli(1e9, poisson, 1e9, poisson)
    normal = 1.5 * law.find_normal_force(1e-6, modulus, 1e-3) / 1e-6
    shear = law.combine_shear_moduli(1e9, poisson, 1e9, poisson)
    tangential = law.find_tangential_stiffness(1e-6, shear, 1e-3)
    assert tangential / normal == pytest.approx(2 * (1 - poisson) / (2 - poisson), rel=1e-13)


@pytest.mark.parametrize(
    ("young", "poisson", "density", "radius", "speed", "wall", "overlap", "force", "time"),
    [
        (48e9, 0.20, 2800, 0.01, 20.0, False, 274.113e-6, 10.697e3, 40.340e-6),
        (20e9, 0.25, 2500, 0.01, 20.0, False, 368.304e-6, 7.108e3, 54.201e-6),
        (48e9, 0.20, 2500, 0.01, 20.0, False, 261.9642e-6, 9.99371e3, 38.55163e-6),
        (70e9, 0.30, 2699, 0.10, 0.2, True, 49.717e-6, 11.370e3, 731.66e-6),
        (40e9, 0.35, 1800, 0.10, 0.2, True, 52.123e-6, 7.233e3, 767.07e-6),
    ],
)
def test_elastic_impacts_of_chung_and_ooi(
    young: float,
    poisson: float,
    density: float,
    radius: float,
    speed: float,
    wall: bool,
    overlap: float,
    force: float,
    time: float,
) -> None:
    """Chung & Ooi (2011), tests 1 and 2: greatest overlap, greatest force, contact time.

    The figures have five digits, so the tolerance is half a unit of the fifth.
    """
    partner = (inf, 0.0) if wall else (young, poisson)
    modulus = law.combine_moduli(young, poisson, *partner)
    r = radius if wall else radius / 2
    mass = 4 / 3 * pi * density * radius**3
    hit = law.solve_hertz_collision(speed, modulus, r, mass if wall else mass / 2)
    assert hit.overlap_max == pytest.approx(overlap, rel=5e-5)
    assert float(law.find_normal_force(hit.overlap_max, modulus, r)) == pytest.approx(
        force, rel=5e-5
    )
    assert hit.contact_time == pytest.approx(time, rel=5e-5)


def test_contact_time_factor() -> None:
    """t v/delta_max = 2 int_0^1 dx/sqrt(1 - x^(5/2)) = (4 sqrt(pi)/5) Gamma(2/5)/Gamma(9/10)."""
    exact = 4 * sqrt(pi) / 5 * gamma(0.4) / gamma(0.9)
    assert exact == pytest.approx(law.CONTACT_TIME_FACTOR, rel=1e-7)


@settings(max_examples=10)
@given(speed=st.floats(1e-4, 100), modulus=YOUNG, radius=LENGTH, mass=st.floats(1e-9, 100))
def test_integration_meets_the_closed_form(
    speed: float, modulus: float, radius: float, mass: float
) -> None:
    """Without damping the integrated collision is Hertz's, at its tolerance of 1e-10 a step."""
    closed = law.solve_hertz_collision(speed, modulus, radius, mass)
    for may_pull in (True, False):
        ode = law.solve_collision(speed, modulus, radius, mass, 0.0, may_pull=may_pull)
        assert ode.restitution == pytest.approx(1, abs=1e-7)
        assert ode.overlap_max == pytest.approx(closed.overlap_max, rel=1e-7)
        assert ode.contact_time == pytest.approx(closed.contact_time, rel=1e-6)


@settings(max_examples=15)
@given(alpha=st.floats(0.01, 0.68), speed=st.floats(1e-3, 10), radius=st.floats(1e-4, 0.1))
def test_restitution_of_both_laws(alpha: float, speed: float, radius: float) -> None:
    """e = exp(-pi a/sqrt(1 - a^2)): a = alpha in LIGGGHTS' law, alpha/sqrt(5/6) in a literal eq. 7.

    Integrated at a random speed, size and alpha; the restitution depends on alpha alone.
    """
    modulus, mass = 1e10, 4 / 3 * pi * 2710 * radius**3 / 2
    arguments = (speed, modulus, radius / 2, mass)
    engine = law.solve_collision(*arguments, law.DAMPING_FACTOR * alpha)
    assert engine.restitution == pytest.approx(law.find_restitution(alpha), abs=1e-6)
    literal = law.solve_collision(*arguments, alpha)
    assert literal.restitution == pytest.approx(law.find_literal_restitution(alpha), abs=1e-6)


def test_restitution_of_the_papers_alpha() -> None:
    """alpha = 0.44: 0.2145 as the paper defines alpha, 0.1776 with eq. 7 taken literally."""
    assert law.find_restitution(0.44) == pytest.approx(0.2145, abs=5e-5)
    assert law.find_literal_restitution(0.44) == pytest.approx(0.1776, abs=5e-5)


@pytest.mark.parametrize(
    ("restitution", "measured"), [(0.2145, 0.335), (0.5, 0.550), (0.1776, 0.309)]
)
def test_restitution_without_tension(restitution: float, measured: float) -> None:
    """A contact that ends where the force turns to tension rebounds as LIGGGHTS 3.8.0 measures.

    Two spheres with ``limitForce on``; the measured figures have three digits.
    """
    ratio = law.DAMPING_FACTOR * law.find_alpha(restitution)
    hit = law.solve_collision(1.0, 1e10, 1e-3, 1e-4, ratio, may_pull=False)
    assert hit.restitution == pytest.approx(measured, abs=6e-4)


@given(alpha=st.floats(0, 0.99))
def test_alpha_and_restitution_are_inverse(alpha: float) -> None:
    """alpha -> e -> alpha, and e = e^(-pi alpha/...) falls from 1 as alpha grows."""
    restitution = law.find_restitution(alpha)
    assert 0 < restitution <= 1
    assert law.find_alpha(restitution) == pytest.approx(alpha, rel=1e-9, abs=1e-15)
    linear_oscillator = log(restitution) * sqrt(1 - alpha**2)
    assert linear_oscillator == pytest.approx(-pi * alpha, rel=1e-9, abs=1e-15)


@pytest.mark.parametrize(
    ("young", "time_step", "fraction"), [(46.9e9, 1e-7, 0.0371158), (1e9, 7e-7, 0.0379)]
)
def test_rayleigh_time_is_liggghts(young: float, time_step: float, fraction: float) -> None:
    """``check/timestep/gran`` of LIGGGHTS 3.8.0 printed these shares, smallest grain 2.07 mm."""
    time = law.find_rayleigh_time(2.07e-3, 2710, young, 0.25)
    last_digit = 10.0 ** -(len(str(fraction)) - 2)
    assert time_step / time == pytest.approx(fraction, abs=last_digit / 2)
