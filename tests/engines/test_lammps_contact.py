"""LAMMPS under the project's decks against eqs 5 to 7: one contact at a time."""

from __future__ import annotations

from math import sqrt

import numpy as np
import pytest

from adapters.bed import contact_law as law
from adapters.engines.lammps_decks import TANGENTIAL_RULES
from tests.tangential_rules import LOOPS, force_incremental, force_rescaled, force_secant, work
from validation.bench.few_grains import (
    PLACE,
    RADIUS,
    Track,
    driven_contact,
    grain_mass,
    head_on,
    mirror_slide,
    shear_modulus,
    table_1,
)
from validation.bench.few_grains_lammps import track_run, track_run_under

pytestmark = pytest.mark.engine("lammps")

ALPHA = 0.44
PAIR_MASS = grain_mass(table_1()) / 2
"""Effective mass of two grains of Table 1 [kg]."""
ELASTIC = "material.grain.restitution=1.0"


@pytest.mark.parametrize("speed", [0.01, 1.0])
@pytest.mark.long
def test_rebound_has_the_papers_restitution(speed: float) -> None:
    """alpha = 0.44 rebounds with e = exp(-pi alpha/sqrt(1 - alpha^2)) = 0.2145 at any speed.

    Overlap and contact time too are those of m* delta'' = -F_n - c delta', c = 2 (5/6)^(1/2) alpha
    (m* S_n)^(1/2).  With 1,000 steps in the contact the first-order error is 8e-4: bar 2e-3.
    """
    scene = table_1(f"material.grain.viscous_alpha={ALPHA}")
    hit, _ = head_on(scene, speed, run=track_run)
    expected = law.collision(
        speed, scene.stiffness.grain, RADIUS / 2, PAIR_MASS, law.DAMPING_FACTOR * ALPHA
    )
    assert hit.restitution == pytest.approx(law.restitution_of_alpha(ALPHA), rel=2e-3)
    assert hit.overlap_max == pytest.approx(expected.overlap_max, rel=2e-3)
    assert hit.contact_time == pytest.approx(expected.contact_time, rel=2e-3)


def test_elastic_rebound_is_hertz() -> None:
    """e = 1: overlap (15 m* v^2/(16 E* sqrt(R*)))^(2/5), contact time 2.943 overlap/v, e = 1."""
    scene = table_1(ELASTIC)
    hit, _ = head_on(scene, 0.1, run=track_run)
    expected = law.hertz_collision(0.1, scene.stiffness.grain, RADIUS / 2, PAIR_MASS)
    assert hit.restitution == pytest.approx(1, abs=1e-6)
    assert hit.overlap_max == pytest.approx(expected.overlap_max, rel=1e-5)
    assert hit.contact_time == pytest.approx(expected.contact_time, rel=1e-4)


def test_rebound_converges_at_first_order() -> None:
    """Half the time step, half the error of the restitution: damping lags by half a step."""
    scene = table_1(f"material.grain.viscous_alpha={ALPHA}")
    exact = law.restitution_of_alpha(ALPHA)
    errors = [
        head_on(scene, 0.1, steps=n, run=track_run)[0].restitution / exact - 1
        for n in (200, 400, 800)
    ]
    assert np.divide(errors[1:], errors[:-1]) == pytest.approx([0.5, 0.5], abs=0.1)


FORCE_OF_RULE = {
    "mindlin_rescale/force": force_rescaled,
    "mindlin/force": force_incremental,
    "mindlin": force_secant,
}
"""LAMMPS' rule, and the same on paper; ``mindlin_rescale`` scales down twice, see below."""


def loop_driven(rule: str, loop: str) -> tuple[np.ndarray, np.ndarray, np.ndarray, float, float]:
    """A closed path under a rule: force and moves along the tangent, stiffness; energy lost.

    Elastic, between 0.25 N and 1 N, below sliding.  The energy is that of the whole contact, in
    the unit (k_t1 - k_t0) delta_t^2/2.
    """
    scene = table_1(ELASTIC)
    shear, radius = shear_modulus(scene), RADIUS / 2
    forces = np.array([0.25, 1.0])
    low, high = law.overlap_under_force(forces, scene.stiffness.grain, radius)
    k0, k1 = law.tangential_stiffness(np.array([low, high]), shear, radius)
    displacement = 0.5 * scene.material.grain.friction * forces[0] / k0
    unit = (k1 - k0) * displacement**2 / 2
    corners = [low, 0.0] + LOOPS[loop] * [high - low, displacement]
    track, overlap, moved = driven_contact(scene, *corners.T, run=track_run_under(rule))
    tangential = -np.array([c.tangential_force[0] for c in track.contacts])[:, 1]
    moves = np.diff(track.position[:, 0], axis=0)
    mean_force = (track.force[1:, 0] + track.force[:-1, 0]) / 2
    lost = -float(np.sum(mean_force * moves)) / unit
    return tangential, moved, law.tangential_stiffness(overlap, shear, radius), lost, unit


@pytest.mark.parametrize("rule", FORCE_OF_RULE)
@pytest.mark.parametrize("loop", LOOPS)
@pytest.mark.long
def test_tangential_force_follows_its_rule_on_closed_loops(rule: str, loop: str) -> None:
    """Force at every point, and energy lost or created around the loop, are those of the rule.

    100 points a loop: the rule's own quadrature is off by 2e-3 where both forces change at once.
    """
    force, moved, stiffness, lost, unit = loop_driven(rule, loop)
    expected = FORCE_OF_RULE[rule](stiffness, moved)
    assert force == pytest.approx(expected, abs=3e-3 * expected.max())
    assert lost == pytest.approx(work(expected, moved) / unit, abs=0.01)


def test_the_papers_rule_never_creates_energy() -> None:
    """The default is the paper's rule: no loop gains; LIGGGHTS' ``mindlin`` gains 1 unit in one."""
    assert TANGENTIAL_RULES[0] == "mindlin_rescale/force"
    losses = [loop_driven(TANGENTIAL_RULES[0], loop)[3] for loop in LOOPS]
    assert losses[:2] == pytest.approx([1, 1], abs=0.01)
    assert losses[2] > 0
    assert loop_driven("mindlin", list(LOOPS)[1])[3] == pytest.approx(-1, abs=0.01)


def test_mindlin_rescale_scales_down_twice() -> None:
    """``mindlin_rescale`` scales the displacement by k_t/k_t1, and k_t multiplies it once more.

    At the end of "load n, load t, unload n" it carries (k_t0/k_t1)^2 of its force, not k_t0/k_t1:
    why the rule for a force, not that for a displacement, is the paper's.
    """
    loop = next(iter(LOOPS))
    force, _, stiffness, _, _ = loop_driven("mindlin_rescale", loop)
    corners = np.linspace(0, len(force) - 1, len(LOOPS[loop])).astype(int)
    loaded, unloaded = corners[2], corners[3]
    ratio = stiffness[unloaded] / stiffness[loaded]
    assert ratio < 0.7
    assert force[unloaded] / force[loaded] == pytest.approx(ratio**2, rel=1e-3)


def test_sliding_carries_mu_fn_and_sticking_is_damped() -> None:
    """A contact that sticks has F_t = k_t delta_t + c_t v, one that slides mu F_n and no more.

    c_t = 2 (5/6)^(1/2) alpha (m* k_t)^(1/2), as along the normal.  LAMMPS tests the whole F_t, as
    eq. 7 does, but drops the viscous term of a sliding contact.
    """
    scene, speed = table_1(f"material.grain.viscous_alpha={ALPHA}"), 0.01
    friction = scene.material.grain.friction
    overlap = float(law.overlap_under_force(1.0, scene.stiffness.grain, RADIUS / 2))
    stiffness = float(law.tangential_stiffness(overlap, shear_modulus(scene), RADIUS / 2))
    damping = 2 * law.DAMPING_FACTOR * ALPHA * sqrt(PAIR_MASS * stiffness)
    slip = friction / stiffness
    track, _, moved = driven_contact(
        scene,
        np.array([overlap, overlap]),
        np.array([0.0, 4 * slip]),
        speed=speed,
        run=track_run,
    )
    force = -track.force[:, 0, 1]
    sticks = (moved > 0.1 * slip) & (moved < 0.7 * slip)
    assert force[sticks] == pytest.approx(stiffness * moved[sticks] + damping * speed, rel=2e-3)
    assert force[moved > 1.5 * slip] == pytest.approx(friction, rel=2e-3)
    # what the dump calls the spring is the elastic part alone
    springs = np.array([c.tangential_spring[0] for c in track.contacts])[:, 1]
    assert springs[sticks] == pytest.approx(moved[sticks], rel=5e-3)


def placed(scene_overrides: str, position: list[float], velocity: list[float], steps: int) -> Track:
    """One grain that moves freely from a place, at a step of 1e-7 s."""
    scene = table_1(scene_overrides)
    motion = ["fix motion grains nve/sphere", f"run {steps}"]
    return track_run(scene, np.array([position]), np.array([velocity]), motion, time_step=1e-7)


def test_wall_force_is_that_of_a_plane_of_steel() -> None:
    """F = 4/3 E* R^(1/2) delta^(3/2) on the floor; the cylinder is curved, 1/R* = 1/R - 1/(2 R_c).

    LIGGGHTS takes the cylinder for a plane: 1.1 % less force on the paper's bed.
    """
    scene, overlap = table_1(ELASTIC), 1e-6
    floor = placed(ELASTIC, [0.02, 0.02, RADIUS - overlap], [0.0, 0.0, 0.0], 0)
    modulus = scene.stiffness.wall
    flat = law.normal_force(overlap, modulus, RADIUS)
    assert floor.force[0, 0, 2] == pytest.approx(flat, rel=1e-9)
    cylinder_radius = scene.container.radius
    away = (cylinder_radius - RADIUS + overlap) / sqrt(2)
    side = placed(ELASTIC, [away, away, 0.02], [0.0, 0.0, 0.0], 0)
    curved = law.normal_force(overlap, modulus, 1 / (1 / RADIUS - 1 / (2 * cylinder_radius)))
    assert np.linalg.norm(side.force[0, 0]) == pytest.approx(curved, rel=1e-9)
    assert curved / flat == pytest.approx(1.011, abs=1e-3)


def test_a_grain_slides_along_a_wall_as_coulomb_says() -> None:
    """A hit at 5 times the normal speed slides throughout: the tangent loses mu (1 + e) v_n.

    Spin gained is 5/2 of that over the radius (Walton; Chung and Ooi 2011, test 4).  With e = 1 the
    step, 320 in the contact, is all the error.
    """
    speed = 0.1
    friction = table_1(ELASTIC).material.wall.friction
    track = placed(ELASTIC, [0.02, 0.02, RADIUS + 1e-8], [5 * speed, 0.0, -speed], 800)
    velocity, spin = track.velocity[-1, 0], track.spin[-1, 0]
    assert velocity[2] == pytest.approx(speed, rel=1e-4)
    change = 2 * friction * speed
    assert 5 * speed - velocity[0] == pytest.approx(change, rel=1e-4)
    assert spin[1] == pytest.approx(2.5 * change / RADIUS, rel=1e-4)


def test_wall_rebound_has_the_papers_restitution() -> None:
    """Against a wall m* is the grain's mass, and e is the same."""
    override = f"material.grain.viscous_alpha={ALPHA}"
    speed = 0.1
    track = placed(override, [0.02, 0.02, RADIUS + 1e-8], [0.0, 0.0, -speed], 800)
    rebound = track.velocity[-1, 0, 2] / speed
    assert rebound == pytest.approx(law.restitution_of_alpha(ALPHA), rel=1e-2)


@pytest.mark.long
def test_mirror_plane_is_a_mirrored_pair() -> None:
    """A grain that hits the mirror plane rebounds as two that mirror each other, to round-off.

    What slides along the plane keeps its speed and gets no spin, exactly.
    """
    scene = table_1(f"material.grain.viscous_alpha={ALPHA}")
    pair, _ = head_on(scene, 0.1, run=track_run)
    mirrored, track = head_on(scene, 0.1, mirror=True, slide=0.2, run=track_run)
    assert mirrored.restitution == pytest.approx(pair.restitution, rel=1e-8)
    assert mirrored.contact_time == pytest.approx(pair.contact_time, rel=1e-8)
    assert mirrored.overlap_max == pytest.approx(pair.overlap_max, rel=1e-8)
    assert np.all(track.velocity[:, 0, 1:] == [0.0, 0.2])
    assert np.all(track.spin == 0)
    kept = mirror_slide(scene, 0.1, runs=3, run=track_run)
    assert np.all(kept.velocity[:, 0, 2] == 0.1)
    assert np.all(kept.spin == 0)


@pytest.mark.parametrize(("grain", "wall"), [(0.0, 0.0), (0.0, 0.5), (0.5, 0.0)])
def test_no_friction_no_tangential_force(grain: float, wall: float) -> None:
    """Where the scene names no friction, neither grains nor floor turn or brake what slides."""
    overrides = (f"material.grain.friction={grain}", f"material.wall.friction={wall}")
    scene = table_1(*overrides)
    motion = ["fix motion grains nve/sphere", "run 300"]
    apart = np.array([[RADIUS + 1e-8, 0, 0], [-RADIUS - 1e-8, 0, 0], [0, 0.01, 0]])
    position = PLACE + apart
    position[2, 2] = RADIUS + 1e-8
    velocity = np.array([[-0.1, 0.1, 0], [0.1, -0.1, 0], [0.2, 0, -0.1]])
    track = track_run(scene, position, velocity, motion, time_step=1e-7)
    spins = np.linalg.norm(track.spin[-1], axis=1) > 0
    assert spins.tolist() == [grain > 0, grain > 0, wall > 0]
    lines = [bool(c.tangential_force.any()) for c in track.contacts if len(c)]
    assert lines
    assert any(lines) == (grain > 0)
