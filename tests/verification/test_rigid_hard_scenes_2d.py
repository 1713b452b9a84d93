"""Hard cases in the plane with answers in closed form, by time stepping."""

from __future__ import annotations

from math import radians, tan

import numpy as np
import pytest

from rigid_lcp import Disc, HalfSpace, Polygon, Scene, Simulation
from tests.rigid_motions import stack_drop
from validation.bench.rigid.hard_scenes import (
    find_storeys_friction,
    jitter_grid,
    kick_tower,
    stack_cards,
    turn_scene,
)
from validation.bench.rigid.rest_limit import (
    BALANCED,
    balance_arch,
    bisect_rest,
    find_arch_limit,
    find_unbalance,
)
from validation.bench.rigid.scenes import (
    DENSITY,
    G,
    build_arch,
    build_wedge,
    find_card_friction,
    find_slide_distance,
    find_wedge_acceleration,
    lean_cards,
    stack,
    stack_unequal,
    tilt_block,
)

SLOPE = radians(20)
MILANKOVITCH = 0.10748
"""Least thickness over mean radius of a semicircular arch of very many stones."""


@pytest.mark.long
@pytest.mark.parametrize("share", [1.0, 1 + 1e-9, 1 - 1e-9, 0.98, 1.02])
def test_block_at_its_threshold(share: float) -> None:
    """It slides iff ``mu < tan(slope)``: ``g (sin - mu cos) t^2 / 2``, 1.7e-9 t^2 m at 1 - 1e-9."""
    mu, seconds = tan(SLOPE) * share, 0.2
    run = tilt_block(SLOPE, mu, step=2e-3)
    run.advance(seconds)
    way = find_slide_distance(SLOPE, mu, seconds)
    # A residual of 1e-12 is an acceleration of 1e-11 m/s^2.
    assert run.positions[0, 0] == pytest.approx(way, rel=1e-9, abs=1e-12)
    assert abs(run.angles[0]) < 1e-12


@pytest.mark.long
def test_block_does_not_creep() -> None:
    """At rest on 20 degrees with mu = 1: 1e-12 m in 1e5 steps is 1e-17 m a step; 2,000 of them."""
    run = tilt_block(SLOPE, 1.0)
    assert stack_drop(run, 2.0) < 2e-14


@pytest.mark.parametrize("top", [1.0, 1e4])
@pytest.mark.long
def test_stack(top: float) -> None:
    """Ten boxes, the top one up to 1e4 times heavier, stay within 1e-9 m in 2 s."""
    run = stack(10, top, step=2e-3)
    assert stack_drop(run, 2.0) < 1e-9
    load = run.world.mass[:10].sum() * G
    below = run.contacts.body_b == 10
    # The residual is of impulses and for all contacts: that of the lightest box over h.
    assert run.contacts.normal_force[below].sum() == pytest.approx(load, rel=1e-6)


@pytest.mark.long
def test_light_on_heavy_on_light() -> None:
    assert stack_drop(stack_unequal(1e6), 2.0) < 1e-9


def test_tower_of_200_boxes() -> None:
    assert stack_drop(stack(200), 0.05) < 1e-10


@pytest.mark.long
@pytest.mark.parametrize("phi", [0.2, 0.5])
def test_card_house(phi: float) -> None:
    """It stands iff ``mu >= tan(phi)/2``."""
    limit = find_card_friction(phi)
    assert stack_drop(lean_cards(phi, limit * (1 + 1e-6)), 0.05) < 1e-10
    fallen = stack_drop(lean_cards(phi, limit * 0.98), 0.05)
    assert fallen > 1e-5
    slow = stack_drop(lean_cards(phi, limit * (1 - 1e-6)), 0.05)
    assert 1e-10 < slow < 1e-8


def uneven_house(mu: float) -> Simulation:
    """Cards at 12 degrees to the vertical, one 1.7 times denser, with friction everywhere."""
    lean, scene = tan(radians(12)), Scene(dim=2)
    card = np.array([(-lean - 0.02, 0), (-lean, 0), (0, 0.95), (0, 1), (-0.02, 1)])
    scene.add(HalfSpace((0, 1)), friction=mu)
    scene.add(Polygon(card), density=1000, friction=mu)
    scene.add(Polygon((card * (-1, 1))[::-1]), density=1700, friction=mu)
    return Simulation(scene)


@pytest.mark.long
def test_uneven_card_house_stays_at_rest_where_a_motion_solves_its_steps_as_well() -> None:
    """Static theorem: forces at rest exist from a friction of 0.749045 on (linear programme).

    Just above it a slow slide is another exact solution of a step.  A house at rest, whose forces
    of the step before are those of rest, goes on resting: rounding leaves 1e-17 m/s a step, far
    below 1e-9 m in 0.3 s.  Below the limit the least acceleration is of the order of g times what
    is missing, 1e-3, and so the way g 1e-3 t^2 / 2 = 4e-4 m; a thousandth of it is a fall.
    """
    run = uneven_house(0.75)
    limit = bisect_rest(lambda mu: find_unbalance(run, mu) <= BALANCED, 0.7, 0.8, 1e-8)
    assert limit == pytest.approx(0.749045, abs=1e-6)
    for above in (7e-5, 1e-3, 1e-2):
        house = uneven_house(limit * (1 + above))
        assert stack_drop(house, 0.3) < 1e-9
        assert house.worst_residual <= house.tolerance
    assert stack_drop(uneven_house(limit * (1 - 1e-3)), 0.3) > 4e-7


@pytest.mark.parametrize("share", [1 + 1e-6, 1 - 1e-6, 0.5])
def test_wedge(share: float) -> None:
    """It jams iff ``mu >= tan(half angle)``; else it is squeezed out as fast as on paper."""
    angle = radians(15)
    mu = tan(angle) * share
    run = build_wedge(angle, mu, 1e4)
    expected = find_wedge_acceleration(run, angle, mu, 1e4)
    assert (expected > 0) == (share < 1)
    run.advance(0.02)
    scale = 1e4 / run.world.mass[0]
    assert run.velocities[0, 1] == pytest.approx(expected * 0.02, rel=1e-9, abs=1e-9 * scale * 0.02)


def test_arch() -> None:
    """A semicircular arch stands iff it is thicker than 0.1075 of its radius (Heyman)."""
    assert stack_drop(build_arch(16, 0.115), 0.02) < 1e-9
    assert stack_drop(build_arch(16, 0.10), 0.02) > 1e-6


@pytest.mark.long
def test_many_stones_reach_the_known_limit() -> None:
    """The difference is that of straight stones, of the order of the square of their angle."""
    few, many = (abs(find_arch_limit(stones) - MILANKOVITCH) for stones in (21, 61))
    assert many < 1.5e-4
    assert few / many == pytest.approx((61 / 21) ** 2, rel=0.3)


def test_balance_turns_at_the_limit() -> None:
    limit = find_arch_limit(9, tolerance=1e-6)
    assert balance_arch(9, limit + 1e-5) <= BALANCED
    assert balance_arch(9, limit - 1e-4) > 1e3 * BALANCED


def test_an_arch_without_friction_needs_help() -> None:
    """Its lowest stones would slide outwards on their joints: no thickness stands."""
    assert balance_arch(9, 0.2, mu=0.0) > 1e3 * BALANCED


def test_forces_at_rest_exist_iff_the_block_holds() -> None:
    """The linear programme on a block on a slope: balance turns at ``mu = tan(slope)``."""
    run = tilt_block(SLOPE, 1.0)
    limit = bisect_rest(lambda mu: find_unbalance(run, mu) <= BALANCED, 0.0, 2.0, 1e-9)
    assert limit == pytest.approx(tan(SLOPE), abs=2e-9)


@pytest.mark.parametrize("off", [-1e-2, 1e-2])
def test_card_house_of_storeys(off: float) -> None:
    """Two storeys fall where no forces at rest exist, and stand just above."""
    limit = find_storeys_friction(2, radians(20))
    move = stack_drop(stack_cards(2, radians(20), (1 + off) * limit), 0.05)
    assert move > 1e-5 if off < 0 else move < 1e-10


@pytest.mark.parametrize("angle", [radians(45), 2.0])
def test_a_turned_scene_rests_as_well(angle: float) -> None:
    """Gravity, floor and boxes turned together: the frame is no part of the answer."""
    assert stack_drop(turn_scene(stack(5, 1e4), angle), 0.02) < 1e-10


def test_offsets_of_round_off_do_not_matter() -> None:
    """Edges that coincide but for 1e-12 m: the boxes settle within their gaps."""
    assert stack_drop(jitter_grid(3, 3, 1e-12), 0.03) < 1e-11


def test_a_kicked_tower_gains_nothing() -> None:
    """The lowest of 200 boxes is kicked: friction takes the energy, the others hardly move."""
    run = kick_tower(200, 1.0)
    energy, mass = run.energy, run.world.mass[0]
    run.advance(0.02)
    assert run.energy < energy
    assert run.energy == pytest.approx(energy - 0.5 * mass, rel=1e-3)
    assert run.overlap < 1e-9


def test_no_friction_no_grip() -> None:
    """mu = 0 on a slope: free sliding; a huge mu: none, and the box tips over its corner."""
    run = tilt_block(SLOPE, 0.0)
    run.advance(0.05)
    assert run.positions[0, 0] == pytest.approx(find_slide_distance(SLOPE, 0.0, 0.05), rel=1e-9)
    steep = tilt_block(radians(50), 1e4)
    steep.advance(0.05)
    # J_A phi'' = m g (a/2) (sin - cos), J_A = 2/3 m a^2, to the first order in the angle
    tip = 0.75 * G * (np.sin(radians(50)) - np.cos(radians(50)))
    assert steep.angles[0] == pytest.approx(-tip * 0.05**2 / 2, rel=1e-2)
    assert steep.contacts.status[steep.contacts.normal_force > 0].tolist() == ["stick"]


def test_three_discs_jam_an_opening() -> None:
    """Three discs over an opening narrower than they are wide, between rough walls, hold."""
    scene = Scene(2)
    radius, opening = 0.5, 1.6
    scene.add(Disc(radius), density=DENSITY, position=(-0.5, 0.0), friction=0.9)
    scene.add(Disc(radius), density=DENSITY, position=(0.5, 0.0), friction=0.9)
    scene.add(Disc(radius), density=DENSITY, position=(0.0, np.sqrt(0.75)), friction=0.9)
    ledge = opening / 2
    depth = -np.sqrt(radius**2 - (ledge - 0.5) ** 2)
    for side in (-1.0, 1.0):
        scene.add(
            Polygon.rectangle(2.0, 1.0), fixed=True, position=(side * (ledge + 1.0), depth - 0.5)
        )
    run = Simulation(scene)
    assert stack_drop(run, 0.05) < 1e-10


@pytest.mark.long
def test_needles_gain_next_to_no_energy() -> None:
    """Without friction a step adds energy of the third order in h only, where the Jacobian turns:
    the pages tell 7.8e-8 J of 13 J for these (chaotic) needles; 1e-6 J is a part of 1e-7."""
    scene, rng = Scene(dim=2), np.random.default_rng(5)
    scene.add(HalfSpace((0, 1)), friction=0.0)
    for k in range(8):
        scene.add(
            Polygon.rectangle(1, 1 / 3000), density=1000, position=(0.05 * k, 0.15 + 0.1 * k),
            angle=rng.uniform(-0.3, 0.3), friction=0.0,
        )  # fmt: skip
    run, gained = Simulation(scene), 0.0
    for _ in range(500):
        before = run.energy
        run.advance(1e-3)
        gained += max(0.0, run.energy - before)
    assert gained < 1e-6
