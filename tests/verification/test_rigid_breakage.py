"""Breakage in a run: the Brazilian test as a scene, momentum, and piles that stay where they are.

Reference: Brazilian tension 2 P / (pi D t), Schwager and Poeschel 2002, section 10 (fragmentation).
"""

from __future__ import annotations

import numpy as np
import pytest

from rigid_lcp import Breakage, HalfSpace, Polygon, Scene, Simulation, Wear
from rigid_lcp.errors import SceneError, ShapeError
from rigid_lcp.wear.breakage import find_breaks, find_tension

GRAVITY = 9.81


def press(load: float, strength: float, **options) -> Simulation:
    """A diamond of 0.2 m between a floor and a heavy plate pressed down with ``load`` [N]."""
    scene = Scene(2)
    scene.add(HalfSpace([0, 1]), friction=0.5)
    diamond = Polygon([(0, -0.1), (0.1, 0), (0, 0.1), (-0.1, 0)])
    scene.add(diamond, density=2700.0, position=[0, 0.1], friction=0.5)
    plate = scene.add(Polygon.rectangle(0.3, 0.05), density=1e2, position=[0, 0.225], friction=0.5)

    def loads(time, motion):
        forces = np.zeros((len(motion.position), 3))
        forces[plate, 1] = -load
        return forces

    return Simulation(
        scene, step=1e-3, loads=loads, breakage=Breakage(strength, every=1), **options
    )


def tension_of(load: float) -> float:
    """A force P down over a height H: s = diag(0, -P H / V), tension (3 s_1 - s_2) / 2."""
    push = load + 100 * 0.015 * GRAVITY
    stress = np.diag([0.0, -0.2 * (push + 54 * GRAVITY / 2) / 0.02])
    return find_tension(stress)


@pytest.mark.parametrize("share", [0.98, 1.02])
def test_a_pressed_diamond_breaks_at_its_strength(share):
    """The mean stress is that of the plate's force above and below, and of half the own weight
    (the mean of the forces at both ends): it breaks just above, not just below."""
    load = 5e3
    run = press(load, tension_of(load) / share)
    run.advance(1e-3)
    assert len(run.broken) == (1 if share > 1 else 0)
    if run.broken:
        assert run.broken[0].tension == pytest.approx(tension_of(load), rel=1e-6)


def test_grains_that_turn_to_dust_end_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    """Far above the strength every part breaks again: an error unless there is a least volume."""
    monkeypatch.setattr("rigid_lcp.wear.breakage.MOST_PARTS", 4)
    with pytest.raises(
        SceneError, match=r"2 grains have broken into .* parts, which go on to break"
    ):
        press(5e3, 10.0).advance(0.02)
    run = press(5e3, 10.0)
    run.breakage = Breakage(10.0, every=1, smallest=4e-3)
    run.advance(5e-3)
    assert len(run.broken) > 1


def test_parts_are_the_whole_and_do_not_burst():
    """Split through both contacts: halves of the mass, at the whole's velocity, touching and not
    overlapping; the next steps bring in no energy but the work of plate and weight."""
    run = press(5e3, tension_of(5e3) / 2)
    before = run.energy
    run.advance(1e-3)
    bodies = run.world.scene.bodies
    assert len(bodies) == 4
    part = run.broken[0].part
    assert bodies[1].mass + bodies[part].mass == pytest.approx(54.0, rel=1e-13)
    assert bodies[1].mass == pytest.approx(27.0, rel=1e-9)
    assert run.overlap < 1e-12
    assert run.energy == pytest.approx(before, abs=1e-9)
    falls = run.positions[2, 1]
    run.breakage = None
    run.advance(0.02)
    work = 5e3 * (falls - run.positions[2, 1])
    assert run.energy <= before + work + 1e-6
    assert run.overlap < 1e-6


def test_parts_below_the_smallest_and_stronger_small_ones_hold():
    """Weibull: halves of the area are 2^(1/m) stronger; below ``smallest`` nothing breaks."""
    rule = Breakage(1e5, modulus=3.0, reference_volume=0.02)
    assert rule.draw_strength(0.02) == pytest.approx(1e5, rel=1e-15)
    assert rule.draw_strength(0.01) == pytest.approx(1e5 * 2 ** (1 / 3), rel=1e-12)
    run = press(5e3, 1.0)
    run.breakage = None
    run.advance(1e-3)
    assert find_breaks(run.world.scene, run.motion, run.contacts, Breakage(1.0)) != []
    assert (
        find_breaks(run.world.scene, run.motion, run.contacts, Breakage(1.0, smallest=0.03)) == []
    )


def test_a_wall_of_boxes_breaks_and_stands():
    """Three boxes on one another, the lowest overloaded: it splits between its corners, and no
    body moves (section 10: the system remains always stable).  By unique forces: the solver's may
    hold friction that squeezes the boxes sideways, and then they do not break."""
    scene = Scene(2)
    scene.add(HalfSpace([0, 1]), friction=0.6)
    for k, density in enumerate((1000.0, 1000.0, 1e5)):
        box = Polygon.rectangle(0.1, 0.1)
        scene.add(box, density=density, position=[0, 0.05 + 0.1 * k], friction=0.6)
    # mean stress diag(0, -N / 0.1), N the mean of the loads above and below: tension half of that
    tension = 0.5 * (1000 * GRAVITY + 1.5 * 10 * GRAVITY) / 0.1
    rule = Breakage(0.9999 * tension, every=5, unique=True)
    run = Simulation(scene, step=1e-3, breakage=rule)
    run.advance(5e-3)
    assert {event.body for event in run.broken} == {1}
    assert run.broken[0].tension == pytest.approx(tension, rel=1e-6)
    places = run.positions.copy()
    run.breakage = None
    run.advance(0.1)
    assert np.abs(run.positions - places).max() < 1e-9


def test_broken_grains_wear_on():
    """Wear before, through and after a break: the parts begin with none, the sum goes on."""
    run = press(5e3, tension_of(5e3) / 2, wear=Wear(1e-9, every=1))
    run.advance(3e-3)
    assert run.broken
    assert len(run.worn.grains) == len(run.world.scene.bodies)


def test_breakage_that_is_refused():
    for bad in (
        {"strength": 0.0},
        {"strength": "a"},
        {"strength": 1.0, "every": 0},
        {"strength": 1.0, "every": 2.5},
        {"strength": 1.0, "smallest": np.nan},
        {"strength": 1.0, "modulus": 0.0, "reference_volume": 1.0},
        {"strength": 1.0, "modulus": 1.0, "reference_volume": 0.0},
    ):
        with pytest.raises(SceneError):
            Breakage(**bad)
    with pytest.raises(ShapeError, match="both modulus"):
        Breakage(1.0, modulus=2.0)


def test_a_pressed_cube_breaks_in_space():
    """Point load F / d^2 of the greatest pair: a cube between floor and plate in 3D splits in two
    halves along the force, with its mass, and the pile stays."""
    from rigid_lcp.shapes.polyhedron import make_box

    scene = Scene(3)
    scene.add(HalfSpace([0, 0, 1]), friction=0.5)
    scene.add(make_box(0.1, 0.1, 0.1), density=2700.0, position=[0, 0, 0.05], friction=0.5)
    scene.add(make_box(0.1, 0.1, 0.02), density=5e5, position=[0, 0, 0.11], friction=0.5)
    run = Simulation(scene, step=1e-3, breakage=Breakage(1e4, every=1))
    run.advance(1e-3)
    assert [event.body for event in run.broken] == [1]
    # four corners carry a quarter of the plate each, over the edge of 0.1 m
    assert run.broken[0].tension == pytest.approx(100 * GRAVITY / 4 / 0.1**2, rel=0.05)
    masses = run.world.scene.bodies[1].mass + run.world.scene.bodies[3].mass
    assert masses == pytest.approx(2.7, rel=1e-12)
    assert run.overlap < 1e-9
