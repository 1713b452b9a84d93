"""Chung and Ooi's tests on paper: closed forms against each other, limits, and the data written."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from adapters.bed import contact_law
from validation.studies.contact_law.closed_forms import (
    LAW_OF_ENGINE,
    Law,
    find_contact_time,
    find_mean_overlap,
    find_peak_force,
    find_pull_factor,
    find_rebound_tangent,
    find_sliding_restitution,
    find_sliding_spin,
    find_sliding_start,
    integrate_impulse,
)
from validation.studies.contact_law.engine_runs import Motion, choose_restitution, edit_law
from validation.studies.contact_law.impacts import find_pair, measure_rebound
from validation.studies.contact_law.settings import (
    COPPER,
    NORMAL,
    TEST_2,
    TEST_4,
    TEST_8,
    Impact,
    Setting,
)

pytestmark = pytest.mark.studies

PUBLISHED = {
    "glass": (274.113e-6, 10.697e3, 40.340e-6),
    "limestone": (368.304e-6, 7.108e3, 54.201e-6),
    "aluminium alloy": (49.717e-6, 11.370e3, 731.66e-6),
    "magnesium alloy": (52.123e-6, 7.233e3, 767.07e-6),
}
"""Greatest overlap [m], greatest force [N], contact time [s] of tests 1 and 2, to five digits."""


@pytest.mark.parametrize("setting", NORMAL, ids=lambda s: s.material.name)
def test_hertz_gives_the_known_numbers(setting: Setting) -> None:
    """Overlap, force, and t_c = 2.87 (m*^2/(R* E*^2 V))^(1/5); 2.87 is rounded, by 6e-4."""
    pair, speed = find_pair(setting), setting.impacts[0].normal
    overlap, force, time = PUBLISHED[setting.material.name]
    law = (pair.mass, pair.radius, pair.modulus, speed)
    hit = contact_law.solve_hertz_collision(speed, pair.modulus, pair.radius, pair.mass)
    assert hit.overlap_max == pytest.approx(overlap, rel=3e-5)
    assert find_peak_force(*law) == pytest.approx(force, rel=1e-4)
    assert hit.contact_time == pytest.approx(time, rel=3e-5)
    assert find_contact_time(*law) == pytest.approx(time, rel=7e-4)


def test_unequal_spheres_combine() -> None:
    """1/R* = 1/R_1 + 1/R_2; a thousand times the density of 125 times the volume hardly moves."""
    pair, alone = find_pair(TEST_8), find_pair(TEST_2)
    assert pair.radius == pytest.approx(0.1 * 0.5 / 0.6)
    mass = 4 / 3 * np.pi * 0.1**3 * TEST_8.material.density
    assert pair.mass == pytest.approx(mass * 125e3 / (125e3 + 1))
    assert alone.radius == 0.1


def test_mean_overlap_is_the_integral() -> None:
    """Integral of F delta over that of F, by quadrature over the elastic impact: 0.8176."""
    x = np.sin(np.linspace(0, np.pi / 2, 20_001)) ** 0.8  # delta, dense at both ends
    middle, step = (x[1:] + x[:-1]) / 2, np.diff(x)
    weight = step * middle**1.5 / np.sqrt(1 - middle**2.5)
    deepest = contact_law.solve_hertz_collision(1.0, 1.0, 1.0, 1.0).overlap_max
    share = find_mean_overlap(1.0, 1.0, 1.0, 1.0) / deepest
    assert share == pytest.approx(np.sum(weight * middle) / np.sum(weight), rel=2e-3)


def test_sliding_limits_of_test_4() -> None:
    """Sliding begins at 32.52 degrees; at 60 degrees e_t = 0.8948 and the spin is 355.2 rad/s."""
    mu, e = TEST_4.friction, TEST_4.restitution
    assert np.degrees(np.arctan(find_sliding_start(mu, e))) == pytest.approx(32.52, abs=5e-3)
    tangent = np.tan(np.radians([60.0]))
    assert find_sliding_restitution(tangent, mu, e)[0] == pytest.approx(0.8948, abs=5e-5)
    spin = find_sliding_spin(mu, e) * 3.9 * np.cos(np.radians(60)) / TEST_4.radius
    assert spin == pytest.approx(355.2, abs=0.05)


def test_sliding_limits_of_test_5() -> None:
    """In units of mu and for e = 1: rebound angle = incidence - 7, spin = 5."""
    mu = 0.3
    assert find_rebound_tangent(np.array([10 * mu]), mu, 1.0) / mu == pytest.approx(3.0)
    assert find_sliding_spin(mu, 1.0) / mu == pytest.approx(5.0)


@pytest.mark.parametrize("rule", ["secant", "incremental", "rescaled"])
@pytest.mark.parametrize("restitution", [0.5, 1.0])
def test_reference_slides_and_sticks(rule: str, restitution: float) -> None:
    """Large slip: mu (1 + e), whatever the rule; none: no impulse; friction is odd in the slip.

    An infinitely stiff spring under large mu stops the contact point: impulse = slip/3.5.
    """
    mu, limit, law = 0.3, 0.3 * (1 + restitution), Law(rule)
    slip = np.array([-60 * mu, 0.0, 60 * mu])
    found = integrate_impulse(slip, mu, restitution, 1.2, law, steps=4000)
    assert found == pytest.approx([-limit, 0.0, limit], rel=5e-3)
    held = integrate_impulse(np.array([0.01]), 1.0, restitution, 1.2, law, steps=4000)
    assert abs(held[0]) < 2 * 0.01 / 3.5  # no spring turns the slip round entirely


def test_reference_converges() -> None:
    """Half the step, half the distance, or less: the reference's own error is below 1e-3 mu."""
    slip = 0.3 * np.array([1.0, 3.0, 5.0])
    steps = (2_500, 5_000, 10_000, 20_000)
    found = [integrate_impulse(slip, 0.3, 0.5, 1.2, Law("rescaled"), n) for n in steps]
    moves = [np.abs(b - a).max() for a, b in pairwise(found)]
    assert moves[2] < 0.6 * moves[0]
    assert moves[2] < 1e-3 * 0.3


def test_pull_and_damping_alone() -> None:
    """Sliding at e = 0.5: a pull adds 6.7 %, damping beyond Coulomb's limit more, within it none.

    With e = 1 there is neither, and all laws of a rule are one.
    """
    slip, mu, e = np.array([8.0]), 0.4, 0.5

    def excess(law: Law, restitution: float = e) -> float:
        found = integrate_impulse(slip, mu, restitution, 1.2, law, steps=4000)[0]
        return float(found / (mu * (1 + restitution)) - 1)

    pulled = excess(LAW_OF_ENGINE["lammps"])
    assert pulled == pytest.approx(find_pull_factor(e) - 1, abs=1e-3)
    assert excess(Law("rescaled", damping="within")) == pytest.approx(0, abs=1e-3)
    assert excess(Law("secant", damping="beyond")) > 0.1
    assert excess(LAW_OF_ENGINE["liggghts"]) > excess(Law("secant", damping="beyond"))
    elastic = [excess(law, 1.0) for law in LAW_OF_ENGINE.values()]
    assert elastic == pytest.approx([elastic[0]] * 3, abs=1e-3)


def test_pull_is_what_eq_7_adds() -> None:
    """Nothing for e = 1; 6.7 % for e = 0.5, the integral of |F_n| over (1 + e) m* V."""
    assert find_pull_factor(1.0) == pytest.approx(1.0, abs=1e-9)
    assert find_pull_factor(0.5) == pytest.approx(1.0670, abs=1e-4)


def test_rebound_reads_a_made_motion() -> None:
    """Two equal grains whose slip friction stops: what is written in is read out.

    With spins omega alike the slip is 2 R omega and an impulse J (of m* V_n) changes it by 3.5 J.
    """
    setting = Setting(
        7, COPPER, 0.1, (Impact(0.4, spin=3.0),), 0.5, 0.4, partner_radius=0.1, partner_spins=True
    )
    slip = 2 * 0.1 * 3.0
    impulse = slip / 3.5  # that stops it, over m*
    velocity = np.zeros((2, 2, 3))
    velocity[0, :, 2] = [0.2, -0.2]
    velocity[1, :, 2] = [-0.1, 0.1]
    velocity[1, :, 0] = [impulse / 2, -impulse / 2]
    spin = np.zeros((2, 2, 3))
    spin[0, :, 1] = -3.0
    spin[1, :, 1] = -3.0 + 2.5 * impulse / 2 / 0.1
    none = np.zeros((2, 2, 3))
    found = measure_rebound(setting, Motion(np.array([0.0, 1.0]), none, velocity, spin, none))
    assert found.restitution == pytest.approx([0.5])
    assert found.slip_before == pytest.approx([slip / 0.4])
    assert found.slip_after == pytest.approx([0.0], abs=1e-12)
    assert found.friction_impulse == pytest.approx([impulse / 0.4])
    assert found.spin_gained == pytest.approx([2.5 * impulse / 0.4])
    assert found.momentum_error == pytest.approx(0.0, abs=1e-15)


def test_sliding_law_changes_what_it_says() -> None:
    """No pull and no tangential damping, in each engine's words; none under the scenes' law."""
    lammps = "pair_coeff * * hertz 1 0.5 tangential mindlin_rescale/force 2 0.9 0.5 damping x"
    assert edit_law("lammps", "scene", lammps) == lammps
    assert "force 2 0.0 0.5" in edit_law("lammps", "sliding", lammps)
    pair = "pair_style gran model ${contact_model}\n"
    assert "limitForce on" in edit_law("liggghts", "sliding", pair)
    yade = '{"damping_tangential": 0.2, "friction": 1}'
    assert edit_law("yade", "sliding", yade) == '{"damping_tangential": 0.0, "friction": 1}'
    assert "limitForce" not in edit_law("liggghts", "undamped", pair)
    assert "tangential_damping" not in edit_law("liggghts", "unpulled", pair)
    assert "limit_damping" not in edit_law("lammps", "undamped", lammps)
    assert "force 2 0.9 0.5" in edit_law("lammps", "unpulled", lammps)
    assert edit_law("yade", "unpulled", yade) == yade
    assert choose_restitution("yade", "sliding", 0.5) == 0.5
    assert choose_restitution("lammps", "undamped", 0.5) == 0.5
    assert choose_restitution("lammps", "scene", 0.5) == 0.5
    assert choose_restitution("lammps", "sliding", 0.5) < 0.5
