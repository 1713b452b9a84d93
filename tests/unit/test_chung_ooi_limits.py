"""Chung and Ooi's tests on paper: closed forms against each other, limits, and the data written."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from adapters import contact_law
from validation.chung_ooi import (
    COPPER,
    NORMAL,
    TANGENTIAL,
    TEST_1,
    TEST_2,
    TEST_4,
    TEST_7,
    TEST_8,
    Impact,
    Setting,
)
from validation.chung_ooi_curves import published_checks
from validation.chung_ooi_impacts import pair_of, rebound_of, start_of
from validation.chung_ooi_limits import (
    contact_time,
    mean_overlap,
    peak_force,
    sliding_begins,
    sliding_rebound_tangent,
    sliding_spin,
    sliding_tangential_restitution,
)
from validation.chung_ooi_partial_slip import (
    MODULUS,
    partial_slip_impulse,
    springs_sheared,
)
from validation.chung_ooi_reference import LAW_OF_ENGINE, Law, friction_impulse, pull_factor
from validation.chung_ooi_runs import Motion, grains_data_started, law_text, restitution_given

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
    pair, speed = pair_of(setting), setting.impacts[0].normal
    overlap, force, time = PUBLISHED[setting.material.name]
    law = (pair.mass, pair.radius, pair.modulus, speed)
    hit = contact_law.hertz_collision(speed, pair.modulus, pair.radius, pair.mass)
    assert hit.overlap_max == pytest.approx(overlap, rel=3e-5)
    assert peak_force(*law) == pytest.approx(force, rel=1e-4)
    assert hit.contact_time == pytest.approx(time, rel=3e-5)
    assert contact_time(*law) == pytest.approx(time, rel=7e-4)


def test_unequal_spheres_combine() -> None:
    """1/R* = 1/R_1 + 1/R_2; a thousand times the density of 125 times the volume hardly moves."""
    pair, alone = pair_of(TEST_8), pair_of(TEST_2)
    assert pair.radius == pytest.approx(0.1 * 0.5 / 0.6)
    mass = 4 / 3 * np.pi * 0.1**3 * TEST_8.material.density
    assert pair.mass == pytest.approx(mass * 125e3 / (125e3 + 1))
    assert alone.radius == 0.1


def test_mean_overlap_is_the_integral() -> None:
    """Integral of F delta over that of F, by quadrature over the elastic impact: 0.8176."""
    x = np.sin(np.linspace(0, np.pi / 2, 20_001)) ** 0.8  # delta, dense at both ends
    middle, step = (x[1:] + x[:-1]) / 2, np.diff(x)
    weight = step * middle**1.5 / np.sqrt(1 - middle**2.5)
    deepest = contact_law.hertz_collision(1.0, 1.0, 1.0, 1.0).overlap_max
    share = mean_overlap(1.0, 1.0, 1.0, 1.0) / deepest
    assert share == pytest.approx(np.sum(weight * middle) / np.sum(weight), rel=2e-3)


def test_sliding_limits_of_test_4() -> None:
    """Sliding begins at 32.52 degrees; at 60 degrees e_t = 0.8948 and the spin is 355.2 rad/s."""
    mu, e = TEST_4.friction, TEST_4.restitution
    assert np.degrees(np.arctan(sliding_begins(mu, e))) == pytest.approx(32.52, abs=5e-3)
    tangent = np.tan(np.radians([60.0]))
    assert sliding_tangential_restitution(tangent, mu, e)[0] == pytest.approx(0.8948, abs=5e-5)
    spin = sliding_spin(mu, e) * 3.9 * np.cos(np.radians(60)) / TEST_4.radius
    assert spin == pytest.approx(355.2, abs=0.05)


def test_sliding_limits_of_test_5() -> None:
    """In units of mu and for e = 1: rebound angle = incidence - 7, spin = 5."""
    mu = 0.3
    assert sliding_rebound_tangent(np.array([10 * mu]), mu, 1.0) / mu == pytest.approx(3.0)
    assert sliding_spin(mu, 1.0) / mu == pytest.approx(5.0)


@pytest.mark.parametrize("rule", ["secant", "incremental", "rescaled"])
@pytest.mark.parametrize("restitution", [0.5, 1.0])
def test_reference_slides_and_sticks(rule: str, restitution: float) -> None:
    """Large slip: mu (1 + e), whatever the rule; none: no impulse; friction is odd in the slip.

    An infinitely stiff spring under large mu stops the contact point: impulse = slip/3.5.
    """
    mu, limit, law = 0.3, 0.3 * (1 + restitution), Law(rule)
    slip = np.array([-60 * mu, 0.0, 60 * mu])
    found = friction_impulse(slip, mu, restitution, 1.2, law, steps=4000)
    assert found == pytest.approx([-limit, 0.0, limit], rel=5e-3)
    held = friction_impulse(np.array([0.01]), 1.0, restitution, 1.2, law, steps=4000)
    assert abs(held[0]) < 2 * 0.01 / 3.5  # no spring turns the slip round entirely


def test_reference_converges() -> None:
    """Half the step, half the distance, or less: the reference's own error is below 1e-3 mu."""
    slip = 0.3 * np.array([1.0, 3.0, 5.0])
    steps = (2_500, 5_000, 10_000, 20_000)
    found = [friction_impulse(slip, 0.3, 0.5, 1.2, Law("rescaled"), n) for n in steps]
    moves = [np.abs(b - a).max() for a, b in pairwise(found)]
    assert moves[2] < 0.6 * moves[0]
    assert moves[2] < 1e-3 * 0.3


def test_pull_and_damping_alone() -> None:
    """Sliding at e = 0.5: a pull adds 6.7 %, damping beyond Coulomb's limit more, within it none.

    With e = 1 there is neither, and all laws of a rule are one.
    """
    slip, mu, e = np.array([8.0]), 0.4, 0.5

    def excess(law: Law, restitution: float = e) -> float:
        found = friction_impulse(slip, mu, restitution, 1.2, law, steps=4000)[0]
        return float(found / (mu * (1 + restitution)) - 1)

    pulled = excess(LAW_OF_ENGINE["lammps"])
    assert pulled == pytest.approx(pull_factor(e) - 1, abs=1e-3)
    assert excess(Law("rescaled", damping="within")) == pytest.approx(0, abs=1e-3)
    assert excess(Law("secant", damping="beyond")) > 0.1
    assert excess(LAW_OF_ENGINE["liggghts"]) > excess(Law("secant", damping="beyond"))
    elastic = [excess(law, 1.0) for law in LAW_OF_ENGINE.values()]
    assert elastic == pytest.approx([elastic[0]] * 3, abs=1e-3)


def test_partial_slip_is_cattaneos() -> None:
    """Sheared under a fixed overlap the springs give F_t = mu F_n (1 - (1 - s/s_max)^(3/2)).

    s_max = mu E* delta/G; Cattaneo 1938, Mindlin 1949.  Unloaded half way they slip twice as far.
    """
    mu, delta, stiffness, springs = 0.3, 0.8, 0.7, 4000
    dx = delta**0.5 / springs
    grip = mu * MODULUS * (delta - ((np.arange(springs) + 0.5) * dx) ** 2)
    greatest = mu * MODULUS * delta / stiffness

    def force(stretch: np.ndarray) -> float:
        return float(2 * stiffness * dx * stretch.sum())

    def cattaneo(shift: float) -> float:
        return mu * delta**1.5 * (1 - (1 - min(shift / greatest, 1.0)) ** 1.5)

    stretch = np.zeros((1, springs))
    for share in (0.2, 0.6, 1.0, 1.4):
        stretch = springs_sheared(
            stretch, np.array([[share * greatest]]) - stretch.max(), grip, stiffness
        )
        assert force(stretch) == pytest.approx(cattaneo(share * greatest), rel=1e-5)
    turned = springs_sheared(stretch, np.array([[-0.5 * greatest]]), grip, stiffness)
    back = mu * delta**1.5 - 2 * cattaneo(0.25 * greatest)
    assert force(turned) == pytest.approx(back, rel=1e-5)


@pytest.mark.parametrize("mu", [0.1, 0.6])
def test_partial_slip_ends_in_the_limits(mu: float) -> None:
    """Sliding all the time gives 2 mu; without friction there is no impulse; odd in the slip."""
    slip = mu * np.array([-40.0, 0.0, 40.0])
    assert partial_slip_impulse(slip, mu, 1.2, 1000, 100) == pytest.approx(
        [-2 * mu, 0, 2 * mu], rel=1e-3
    )
    assert not partial_slip_impulse(slip, 0.0, 1.2, 1000, 100).any()


def test_partial_slip_converges_and_keeps_energy() -> None:
    """Half the step moves it half as far; no impact gains energy along the tangent."""
    slip = 0.3 * np.array([0.3, 1.0, 2.0, 4.0])
    found = [partial_slip_impulse(slip, 0.3, 1.2, n, 200) for n in (500, 1000, 2000)]
    moves = [np.abs(b - a).max() for a, b in pairwise(found)]
    assert moves[1] < 0.6 * moves[0]
    assert np.all(np.abs(slip - 3.5 * found[-1]) < slip)


def test_partial_slip_is_the_published_curve() -> None:
    """Finite elements and experiment, as read off the figures: within 4 % of their greatest."""
    assert [check.name for check in published_checks() if not check.holds] == []


def test_pull_is_what_eq_7_adds() -> None:
    """Nothing for e = 1; 6.7 % for e = 0.5, the integral of |F_n| over (1 + e) m* V."""
    assert pull_factor(1.0) == pytest.approx(1.0, abs=1e-9)
    assert pull_factor(0.5) == pytest.approx(1.0670, abs=1e-4)


def test_start_has_the_impact() -> None:
    """Relative velocity of the two grains, slip of the contact point, and gaps of a few steps."""
    for setting in (TEST_1, TEST_2, TEST_7, TEST_8):
        time_step = 1e-7
        start = start_of(setting, time_step)
        two = setting.partner_radius is not None
        upper = slice(1, None, 2) if two else slice(None)
        lower_z = start.position[::2, 2] + (setting.partner_radius or 0.0) if two else 0.0
        lower_v = start.velocity[::2] if two else 0.0
        gap = start.position[upper, 2] - start.radius[upper] - lower_z
        normal = np.array([impact.normal for impact in setting.impacts])
        assert np.all((gap > 2 * normal * time_step) & (gap < 4 * normal * time_step))
        assert (start.velocity[upper] - lower_v)[:, 2] == pytest.approx(-normal)


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
    found = rebound_of(setting, Motion(np.array([0.0, 1.0]), none, velocity, spin, none))
    assert found.restitution == pytest.approx([0.5])
    assert found.slip_before == pytest.approx([slip / 0.4])
    assert found.slip_after == pytest.approx([0.0], abs=1e-12)
    assert found.friction_impulse == pytest.approx([impulse / 0.4])
    assert found.spin_gained == pytest.approx([2.5 * impulse / 0.4])
    assert found.momentum_error == pytest.approx(0.0, abs=1e-15)


def test_grains_data_gets_densities_and_velocities() -> None:
    """The grains' densities are scaled, the piston's is not, and stands still."""
    text = "head\n\n3 atoms\n\nAtoms\n\n1 1 0.2 10 0 0 1\n2 1 0.2 10 0 0 2\n3 2 0.1 7 0 0 3\n"
    start = start_of(
        Setting(8, COPPER, 0.1, (Impact(1.0),), partner_radius=0.1, partner_mass_factor=1000.0),
        1e-6,
    )
    lines = grains_data_started(text, start).splitlines()
    assert lines[6:9] == ["1 1 0.2 10000 0 0 1", "2 1 0.2 10 0 0 2", "3 2 0.1 7 0 0 3"]
    moving = np.array([line.split() for line in lines[-3:]], dtype=float)
    assert moving.tolist() == [[1] + 6 * [0], [2, 0, 0, -1, 0, 0, 0], [3] + 6 * [0]]


def test_sliding_law_changes_what_it_says() -> None:
    """No pull and no tangential damping, in each engine's words; none under the scenes' law."""
    lammps = "pair_coeff * * hertz 1 0.5 tangential mindlin_rescale/force 2 0.9 0.5 damping x"
    assert law_text("lammps", "scene", lammps) == lammps
    assert "force 2 0.0 0.5" in law_text("lammps", "sliding", lammps)
    pair = "pair_style gran model ${contact_model}\n"
    assert "limitForce on" in law_text("liggghts", "sliding", pair)
    yade = '{"damping_tangential": 0.2, "friction": 1}'
    assert law_text("yade", "sliding", yade) == '{"damping_tangential": 0.0, "friction": 1}'
    assert "limitForce" not in law_text("liggghts", "undamped", pair)
    assert "tangential_damping" not in law_text("liggghts", "unpulled", pair)
    assert "limit_damping" not in law_text("lammps", "undamped", lammps)
    assert "force 2 0.9 0.5" in law_text("lammps", "unpulled", lammps)
    assert law_text("yade", "unpulled", yade) == yade
    assert restitution_given("yade", "sliding", 0.5) == 0.5
    assert restitution_given("lammps", "undamped", 0.5) == 0.5
    assert restitution_given("lammps", "scene", 0.5) == 0.5
    assert restitution_given("lammps", "sliding", 0.5) < 0.5


def test_both_materials_of_every_test() -> None:
    """Two settings of each of tests 4 to 8, some of whose impacts slide and some do not."""
    assert sorted(setting.test for setting in TANGENTIAL) == [4, 4, 5, 5, 6, 6, 7, 7, 8, 8]
    for setting in TANGENTIAL:
        begins = sliding_begins(setting.friction, setting.restitution)
        arm = setting.radius * (2 if setting.partner_spins else 1)
        slip = [(i.tangential + arm * i.spin) / i.normal for i in setting.impacts]
        assert min(slip) < begins < max(slip) / 1.4
