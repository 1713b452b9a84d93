"""The engines under the project's decks against eqs 5 to 7: one contact at a time.

What YADE alone does, as no contact of it pulls, is in tests/engines/test_yade.py.
"""

from __future__ import annotations

from math import sqrt

import numpy as np
import pytest

from adapters.bed import contact_law as law
from tests.driven_contacts import (
    collide,
    drive_contact,
    find_grain_mass,
    find_shear_modulus,
    limit_force,
    mirror_tangential,
    slide_on_mirror,
)
from tests.tangential_rules import LOOPS, force_incremental, force_rescaled, force_secant, work
from validation.bench import few_grains, few_grains_lammps, few_grains_yade
from validation.bench.few_grains import PLACE, RADIUS, Track, TrackRun, load_table_1

LIGGGHTS = pytest.param(few_grains.run_grains, marks=pytest.mark.engine("liggghts"), id="liggghts")
LAMMPS = pytest.param(few_grains_lammps.run_grains, marks=pytest.mark.engine("lammps"), id="lammps")
YADE = pytest.param(
    few_grains_yade.run_grains, marks=[pytest.mark.engine("yade"), pytest.mark.long], id="yade"
)
every_engine = pytest.mark.parametrize("run", [LIGGGHTS, LAMMPS, YADE])
with_pull = pytest.mark.parametrize("run", [LIGGGHTS, LAMMPS])
only_liggghts = pytest.mark.engine("liggghts")
only_lammps = pytest.mark.engine("lammps")

ALPHA = 0.44
VISCOUS = f"material.grain.viscous_alpha={ALPHA}"
ELASTIC = "material.grain.restitution=1.0"
PAIR_MASS = find_grain_mass(load_table_1()) / 2  # effective mass of two grains of Table 1 [kg]


@with_pull
@pytest.mark.parametrize("speed", [0.01, 1.0])
@pytest.mark.long
def test_rebound_has_the_papers_restitution(run: TrackRun, speed: float) -> None:
    """alpha = 0.44 rebounds with e = exp(-pi alpha/sqrt(1 - alpha^2)) = 0.2145 at any speed.

    Overlap and contact time too are those of m* delta'' = -F_n - c delta', c = 2 (5/6)^(1/2) alpha
    (m* S_n)^(1/2).  With 1,000 steps in the contact the first-order error is 8e-4: bar 2e-3.
    """
    scene = load_table_1(VISCOUS)
    hit, _ = collide(scene, speed, run=run)
    expected = law.solve_collision(
        speed, scene.stiffness.grain, RADIUS / 2, PAIR_MASS, law.DAMPING_FACTOR * ALPHA
    )
    assert hit.restitution == pytest.approx(law.find_restitution(ALPHA), rel=2e-3)
    assert hit.overlap_max == pytest.approx(expected.overlap_max, rel=2e-3)
    assert hit.contact_time == pytest.approx(expected.contact_time, rel=2e-3)


@every_engine
def test_elastic_rebound_is_hertz(run: TrackRun) -> None:
    """e = 1: overlap (15 m* v^2/(16 E* sqrt(R*)))^(2/5), contact time 2.943 overlap/v, e = 1."""
    scene = load_table_1(ELASTIC)
    hit, _ = collide(scene, 0.1, run=run)
    expected = law.solve_hertz_collision(0.1, scene.stiffness.grain, RADIUS / 2, PAIR_MASS)
    assert hit.restitution == pytest.approx(1, abs=1e-6)
    assert hit.overlap_max == pytest.approx(expected.overlap_max, rel=1e-5)
    assert hit.contact_time == pytest.approx(expected.contact_time, rel=1e-4)


@only_liggghts
def test_literal_eq_7_needs_another_restitution() -> None:
    """e = 0.1776 handed over damps with c = 2 alpha sqrt(m* S_n), alpha = 0.44: eq. 7 as printed.

    The reference is the literal equation, integrated.
    """
    scene = load_table_1(f"material.grain.restitution={law.find_literal_restitution(ALPHA)!r}")
    hit, _ = collide(scene, 0.1)
    literal = law.solve_collision(0.1, scene.stiffness.grain, RADIUS / 2, PAIR_MASS, ALPHA)
    assert hit.restitution == pytest.approx(literal.restitution, rel=2e-3)


@only_liggghts
def test_contacts_may_pull() -> None:
    """limitForce on ends a contact at the first tension, e = 0.335; the decks leave it off."""
    scene, ratio = load_table_1(VISCOUS), law.DAMPING_FACTOR * ALPHA
    hit, _ = collide(scene, 0.1, materials=limit_force)
    ended = law.solve_collision(
        0.1, scene.stiffness.grain, RADIUS / 2, PAIR_MASS, ratio, may_pull=False
    )
    assert ended.restitution == pytest.approx(0.335, abs=5e-4)
    assert hit.restitution == pytest.approx(ended.restitution, rel=2e-3)


@every_engine
@pytest.mark.long
def test_rebound_converges_at_first_order(run: TrackRun) -> None:
    """Half the time step, half the error of the restitution: damping lags by half a step."""
    setting, exact = VISCOUS, law.find_restitution(ALPHA)
    if run is few_grains_yade.run_grains:
        setting, exact = "material.grain.restitution=0.5", 0.5
    errors = [
        collide(load_table_1(setting), 0.1, steps=n, run=run)[0].restitution / exact - 1
        for n in (200, 400, 800)
    ]
    assert np.divide(errors[1:], errors[:-1]) == pytest.approx([0.5, 0.5], abs=0.1)


@pytest.mark.parametrize(
    ("run", "rule", "lost"),
    [
        pytest.param(*LIGGGHTS.values, force_secant, (1, -1, 0), marks=LIGGGHTS.marks),
        pytest.param(*LAMMPS.values, force_rescaled, (1, 1, 0.436), marks=LAMMPS.marks),
        pytest.param(*YADE.values, force_incremental, (-1, 1, 0), marks=YADE.marks),
    ],
    ids=["liggghts", "lammps", "yade"],
)
@pytest.mark.parametrize("number", range(3))
def test_tangential_force_follows_its_rule_on_closed_loops(
    run: TrackRun, rule: object, lost: tuple[float, ...], number: int
) -> None:
    """The force at every point is that of the rule, and the loop loses or creates what the rule
    does, in the unit (k_t1 - k_t0) delta_t^2/2: LAMMPS has the paper's rule, which creates none.

    Elastic, between 0.25 N and 1 N, below sliding.  100 points a loop: the rule's own quadrature is
    off by 2e-3 where both forces change at once.
    """
    scene = load_table_1(ELASTIC)
    shear, radius = find_shear_modulus(scene), RADIUS / 2
    forces = np.array([0.25, 1.0])
    low, high = law.find_overlap_under_force(forces, scene.stiffness.grain, radius)
    k0, k1 = law.find_tangential_stiffness(np.array([low, high]), shear, radius)
    displacement = 0.5 * scene.material.grain.friction * forces[0] / k0
    unit = (k1 - k0) * displacement**2 / 2
    corners = [low, 0.0] + list(LOOPS.values())[number] * [high - low, displacement]
    track, overlap, moved = drive_contact(scene, *corners.T, run=run)
    expected = rule(law.find_tangential_stiffness(overlap, shear, radius), moved)  # type: ignore[operator]
    tangential = -np.array([c.tangential_force[0] for c in track.contacts])[:, 1]
    assert tangential == pytest.approx(expected, abs=3e-3 * expected.max())
    if run is few_grains_yade.run_grains:  # its dump's spring is the force over the stiffness
        spring = np.array([c.tangential_spring[0] for c in track.contacts])[:, 1]
        stiffness = law.find_tangential_stiffness(overlap, shear, radius)
        assert spring * stiffness == pytest.approx(expected, abs=1e-3 * expected.max())
    moves = np.diff(track.position[:, 0], axis=0)
    mean_force = (track.force[1:, 0] + track.force[:-1, 0]) / 2
    assert -np.sum(mean_force * moves) / unit == pytest.approx(lost[number], abs=0.01)
    assert work(expected, moved) / unit == pytest.approx(lost[number], abs=0.01)


@with_pull
def test_sliding_carries_mu_fn_and_sticking_is_damped(run: TrackRun) -> None:
    """A contact that sticks has F_t = k_t delta_t + c_t v, one that slides mu F_n and no more.

    c_t = 2 (5/6)^(1/2) alpha (m* k_t)^(1/2), as along the normal.  Eq. 7 keeps its viscous term
    while a contact slides, 27 % more here; both engines drop it.
    """
    scene, speed = load_table_1(VISCOUS), 0.01
    friction = scene.material.grain.friction
    overlap = float(law.find_overlap_under_force(1.0, scene.stiffness.grain, RADIUS / 2))
    stiffness = float(law.find_tangential_stiffness(overlap, find_shear_modulus(scene), RADIUS / 2))
    damping = 2 * law.DAMPING_FACTOR * ALPHA * sqrt(PAIR_MASS * stiffness)
    slip = friction / stiffness
    track, _, moved = drive_contact(
        scene, np.array([overlap, overlap]), np.array([0.0, 4 * slip]), speed=speed, run=run
    )
    force = -track.force[:, 0, 1]
    sticks = (moved > 0.1 * slip) & (moved < 0.7 * slip)
    assert force[sticks] == pytest.approx(stiffness * moved[sticks] + damping * speed, rel=2e-3)
    assert force[moved > 1.5 * slip] == pytest.approx(friction, rel=2e-3)
    if run is few_grains_lammps.run_grains:  # what its dump calls the spring is the elastic part
        springs = np.array([c.tangential_spring[0] for c in track.contacts])[:, 1]
        assert springs[sticks] == pytest.approx(moved[sticks], rel=5e-3)


@pytest.mark.parametrize(
    ("run", "bar"),
    [
        pytest.param(*LIGGGHTS.values, 1e-3, marks=LIGGGHTS.marks, id="liggghts"),
        pytest.param(*LAMMPS.values, 1e-8, marks=LAMMPS.marks, id="lammps"),
        pytest.param(*YADE.values, 1e-3, marks=YADE.marks, id="yade"),
    ],
)
@pytest.mark.long
def test_mirror_plane_is_a_mirrored_pair(run: TrackRun, bar: float) -> None:
    """A grain that hits the mirror plane rebounds as two that mirror each other; what slides along
    it keeps its speed and gets no spin, exactly.

    LIGGGHTS' Young's modulus of 1e15 Pa instead of infinity makes 5e-5 of E*.
    """
    scene = load_table_1(VISCOUS)
    pair, _ = collide(scene, 0.1, run=run)
    mirrored, track = collide(scene, 0.1, mirror=True, slide=0.2, run=run)
    assert mirrored.restitution == pytest.approx(pair.restitution, rel=bar)
    assert mirrored.contact_time == pytest.approx(pair.contact_time, rel=bar)
    assert mirrored.overlap_max == pytest.approx(pair.overlap_max, rel=bar)
    assert np.all(track.velocity[:, 0, 1:] == [0.0, 0.2])
    assert np.all(track.spin == 0)


@every_engine
def test_mirror_plane_does_not_brake(run: TrackRun) -> None:
    """A grain pressed on a mirror plane keeps its speed along it exactly, over several runs.

    With the grains' tangential law at friction 0 it would not in LIGGGHTS: the force computed at
    the start of a run finds a spring of length zero, which counts as sticking, and damps.
    """
    kept = slide_on_mirror(load_table_1(), 0.1, runs=3, run=run)
    assert np.all(kept.velocity[:, 0, 2] == 0.1)
    assert np.all(kept.spin == 0)
    if run is few_grains.run_grains:
        braked = slide_on_mirror(load_table_1(), 0.1, runs=3, materials=mirror_tangential)
        assert braked.velocity[-1, 0, 2] < 0.99 * 0.1


# --- walls of LAMMPS -------------------------------------------------------------------------


def placed(scene_overrides: str, position: list[float], velocity: list[float], steps: int) -> Track:
    """One grain that moves freely from a place, at a step of 1e-7 s."""
    motion = ["fix motion grains nve/sphere", f"run {steps}"]
    return few_grains_lammps.run_grains(
        load_table_1(scene_overrides),
        np.array([position]),
        np.array([velocity]),
        motion,
        time_step=1e-7,
    )


@only_lammps
def test_wall_force_is_that_of_a_plane_of_steel() -> None:
    """F = 4/3 E* R^(1/2) delta^(3/2) on the floor; the cylinder is curved, 1/R* = 1/R - 1/(2 R_c).

    LIGGGHTS takes the cylinder for a plane: 1.1 % less force on the paper's bed.
    """
    scene, overlap = load_table_1(ELASTIC), 1e-6
    floor = placed(ELASTIC, [0.02, 0.02, RADIUS - overlap], [0.0, 0.0, 0.0], 0)
    modulus = scene.stiffness.wall
    flat = law.find_normal_force(overlap, modulus, RADIUS)
    assert floor.force[0, 0, 2] == pytest.approx(flat, rel=1e-9)
    cylinder_radius = scene.container.radius
    away = (cylinder_radius - RADIUS + overlap) / sqrt(2)
    side = placed(ELASTIC, [away, away, 0.02], [0.0, 0.0, 0.0], 0)
    curved = law.find_normal_force(overlap, modulus, 1 / (1 / RADIUS - 1 / (2 * cylinder_radius)))
    assert np.linalg.norm(side.force[0, 0]) == pytest.approx(curved, rel=1e-9)
    assert curved / flat == pytest.approx(1.011, abs=1e-3)


@only_lammps
def test_a_grain_slides_along_a_wall_as_coulomb_says() -> None:
    """A hit at 5 times the normal speed slides throughout: the tangent loses mu (1 + e) v_n.

    Spin gained is 5/2 of that over the radius (Walton; Chung and Ooi 2011, test 4).  With e = 1 the
    step, 320 in the contact, is all the error.
    """
    speed = 0.1
    friction = load_table_1(ELASTIC).material.wall.friction
    track = placed(ELASTIC, [0.02, 0.02, RADIUS + 1e-8], [5 * speed, 0.0, -speed], 800)
    velocity, spin = track.velocity[-1, 0], track.spin[-1, 0]
    assert velocity[2] == pytest.approx(speed, rel=1e-4)
    change = 2 * friction * speed
    assert 5 * speed - velocity[0] == pytest.approx(change, rel=1e-4)
    assert spin[1] == pytest.approx(2.5 * change / RADIUS, rel=1e-4)


@only_lammps
def test_wall_rebound_has_the_papers_restitution() -> None:
    """Against a wall m* is the grain's mass, and e is the same."""
    speed = 0.1
    track = placed(VISCOUS, [0.02, 0.02, RADIUS + 1e-8], [0.0, 0.0, -speed], 800)
    rebound = track.velocity[-1, 0, 2] / speed
    assert rebound == pytest.approx(law.find_restitution(ALPHA), rel=1e-2)


@only_lammps
@pytest.mark.parametrize(("grain", "wall"), [(0.0, 0.0), (0.0, 0.5), (0.5, 0.0)])
def test_no_friction_no_tangential_force(grain: float, wall: float) -> None:
    """Where the scene names no friction, neither grains nor floor turn or brake what slides."""
    overrides = (f"material.grain.friction={grain}", f"material.wall.friction={wall}")
    scene = load_table_1(*overrides)
    motion = ["fix motion grains nve/sphere", "run 300"]
    apart = np.array([[RADIUS + 1e-8, 0, 0], [-RADIUS - 1e-8, 0, 0], [0, 0.01, 0]])
    position = PLACE + apart
    position[2, 2] = RADIUS + 1e-8
    velocity = np.array([[-0.1, 0.1, 0], [0.1, -0.1, 0], [0.2, 0, -0.1]])
    track = few_grains_lammps.run_grains(scene, position, velocity, motion, time_step=1e-7)
    spins = np.linalg.norm(track.spin[-1], axis=1) > 0
    assert spins.tolist() == [grain > 0, grain > 0, wall > 0]
    lines = [bool(c.tangential_force.any()) for c in track.contacts if len(c)]
    assert lines
    assert any(lines) == (grain > 0)
