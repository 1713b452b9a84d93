"""Wear of polyhedra in a run: V = k W exactly; volume, mass and energy in balance.

Reference: Archard 1953, Reye 1860 (V = k W); Schwager and Poeschel 2002, section 8 (end).
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigid_lcp.errors import ShapeError
from rigid_lcp.motion.state import Motion
from rigid_lcp.motion.world import Scene
from rigid_lcp.scene.simulation import Simulation
from rigid_lcp.shapes.half_space import HalfSpace
from rigid_lcp.shapes.polyhedron import Polyhedron, box
from rigid_lcp.shapes.rotations import quaternion_of_rotation, quaternion_product
from rigid_lcp.shapes.sphere import Sphere
from rigid_lcp.shapes.stones import ballast_stone
from rigid_lcp.wear.corners import Wear, contact_stiffness_worn, replace_worn, start_wear
from rigid_lcp.wear.polyhedra import cut_depth, rub_edges, unworn, wear_polyhedron
from rigid_lcp.wear.solids import energy_of, rub_solids
from tests.rigid_solids import CUBE, contacts

GRAVITY = 9.81
NEEDLE = Polyhedron([[0, 0, 0], [1, 0, 0], [0.5, 1e-3, 0], [0.5, 0, 1e-3], [0.5, 1e-3, 1e-3]])
SLIVER = Polyhedron([[0, 0, 0], [1, 0, 0], [0.3, 1e-3, 0], [0.4, 0.4, 0.2]])


def slope(angle=0.5, friction=0.3, length=1.0, mass=1.0, **options) -> Simulation:
    """A block of 0.2 by 0.1 by 0.1 m, in units of ``length`` and ``mass``, sliding down a slope."""
    g = GRAVITY * length
    scene = Scene(3, [g * np.sin(angle), 0.0, -g * np.cos(angle)])
    scene.add(HalfSpace([0, 0, 1]), friction=friction)
    block = box(0.2 * length, 0.1 * length, 0.1 * length)
    scene.add(block, density=2700.0 * mass / length**3, position=[0, 0, 0.05 * length])
    return Simulation(scene, **options)


def volumes(run: Simulation) -> float:
    return sum(body.shape.volume for body in run.world.scene.bodies if body.movable)


def test_block_that_slides_down_loses_k_times_work():
    """x = (sin a - mu cos a) g t^2 / 2, W = mu m g cos a x, V = k W; with so little wear that the
    mass stays what it was to 1e-9."""
    angle, friction, k, time = 0.5, 0.3, 1e-13, 0.4
    run = slope(angle, friction, step=1e-2, wear=Wear(k, every=10))
    run.advance(time)
    pull = GRAVITY * (np.sin(angle) - friction * np.cos(angle))
    work = friction * 5.4 * GRAVITY * np.cos(angle) * pull * time**2 / 2
    assert run.worn.work == pytest.approx(work, rel=1e-9)
    assert run.worn.volume == pytest.approx(k * work, rel=1e-9)
    gone = 0.002 - volumes(run) + run.worn.pending.sum()
    assert gone == pytest.approx(run.worn.volume, abs=1e-18)


def test_wear_that_is_seen_takes_mass_and_keeps_the_rest_moving():
    """A fiftieth of the block goes, off its four lower corners: mass and inertia are those of the
    worn shape, which slides on as a block of any mass does (v = a t); energy in balance."""
    run = slope(step=1e-2, wear=Wear(1e-5, every=5))
    start = run.energy
    run.advance(0.5)
    body = run.world.scene.bodies[1]
    shape = Polyhedron(body.shape.vertices)
    assert volumes(run) < 0.99 * 0.002
    assert len(body.shape.faces) == 10
    assert body.mass == pytest.approx(2700 * shape.volume, rel=1e-12)
    assert body.inertia == pytest.approx(2700 * shape.inertia, rel=1e-10, abs=1e-15)
    pull = GRAVITY * (np.sin(0.5) - 0.3 * np.cos(0.5))
    assert run.velocities[1] == pytest.approx([pull * 0.5, 0.0, 0.0], abs=1e-9)
    assert run.overlap < 1e-12
    gone = 0.002 - volumes(run)
    assert gone + run.worn.pending.sum() == pytest.approx(run.worn.volume, rel=1e-10)
    assert run.worn.mass == pytest.approx(2700 * gone, rel=1e-10)
    # what friction took, what the crumbs took with them, what is left
    assert run.energy == pytest.approx(start - run.worn.work - run.worn.energy, abs=1e-9)
    grain = run.worn.grains[1]
    front, back = (grain.lost[sign * grain.normal[:, 0] > 0] for sign in (1, -1))
    assert len(front) == len(back) == 2
    assert min(front.min(), back.min()) > 0
    # friction turns the block onto its front: N_f x_f - N_b x_b = mu h (N_f + N_b), mu h = 0.015.
    # Both sides bear at 0.1 until chamfers give each ends from 0.054 to 0.1; which of them bear,
    # and which of one side's corners, is the solver's choice (redundant contacts)
    assert 1.0 < front.sum() / back.sum() < (0.1 + 0.015) / (0.054 - 0.015)


def test_crossing_edges_share_the_wear_and_become_chamfers():
    """A cube's edge across another's: each loses half, along the whole edge, ``V = l t^2 2 / 2`` of
    a right-angled edge to the depth t of the chamfer."""
    lower = quaternion_of_rotation([np.pi / 4, 0.0, 0.0])
    turned = quaternion_of_rotation([0.0, 0.0, np.pi / 2])
    upper = quaternion_product(turned[None], lower[None])[0]
    scene = Scene(3, [0, 0, 0])
    for turn, high in ((lower, 0.0), (upper, 2**0.5)):
        scene.add(CUBE, density=1.0, position=[0, 0, high], angle=turn)
    found = contacts([CUBE, CUBE], [[0, 0, 0], [0, 0, 2**0.5]], [lower, upper])
    state = start_wear(scene)
    rub_solids(state, found, np.array([0.02]))
    for grain in state.grains:
        assert grain.pending == pytest.approx([0.01])
        made, _ = wear_polyhedron(grain)
        assert len(made.shape.faces) == 7
        depth = (0.5**0.5) - (made.shape.distances[np.argmax(made.shape.normals @ grain.normal[0])])
        moved = (made.shape.vertices @ grain.normal[0]).max()
        old = (CUBE.vertices @ grain.normal[0]).max()
        assert depth < 0.11
        assert old - moved == pytest.approx(0.1, abs=0.01)  # the centre moved back a little
        assert made.shape.volume == pytest.approx(0.99, rel=1e-13)


def test_chamfer_by_chamfer_is_one_chamfer_of_the_sum():
    """Wear in ten parts, at any corner or edge of the chamfer, is wear at once."""
    corner = np.array([int(np.argmax(CUBE.vertices.sum(axis=1)))])
    grain = rub_edges(unworn(CUBE), corner, 1e-3)
    for k in range(10):
        grain, _ = wear_polyhedron(grain)
        if k == 9:
            break
        on = np.flatnonzero(grain.shape.vertices @ grain.normal[0] > 0.2)
        height = grain.shape.vertices @ grain.normal[0]
        on = np.flatnonzero(height > height.max() - 1e-9)
        grain = rub_edges(grain, on[: 1 + k % 2], 1e-3)
    assert len(grain.normal) == 1
    once, _ = wear_polyhedron(rub_edges(unworn(CUBE), corner, 1e-2))
    assert grain.shape.volume == pytest.approx(0.99, rel=1e-13)
    assert np.sort(grain.shape.vertices, axis=0) == pytest.approx(
        np.sort(once.shape.vertices, axis=0), abs=1e-12
    )


@settings(max_examples=30, deadline=None)
@given(share=st.floats(1e-12, 0.999))
def test_depth_of_a_cut_in_closed_form(share):
    """A tetrahedron's tip: the volume goes with the cube of the depth, t = H share^(1/3)."""
    tip = Polyhedron([[0, 0, 2.0], [1, 0, 0], [-0.5, 0.9, 0], [-0.5, -0.9, 0]])
    depth = cut_depth(tip, np.array([0.0, 0.0, 1.0]), share * tip.volume)
    assert (depth / 2.0) ** 3 == pytest.approx(share, rel=1e-13, abs=1e-15)  # round-off


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 10**6), share=st.floats(1e-9, 0.03),
    form=st.sampled_from(["stone", "needle", "sliver", "tetrahedron", "plate"]),
)  # fmt: skip
@pytest.mark.long
def test_worn_polyhedra_lose_exactly_what_they_shall(seed, share, form):
    """Any polyhedron, worn at any features, repeatedly: volume to round-off, inside the first.

    Twelve shares are 0.36 of the grain at most, so that no cut takes half of what is left: what
    waits at one feature, y, and what went before, x, have y <= 0.36 - x < (1 - x) / 2.
    """
    rng = np.random.default_rng(seed)
    shape = {
        "stone": lambda: ballast_stone(rng, 1.0),
        "needle": lambda: NEEDLE,
        "sliver": lambda: SLIVER,
        "tetrahedron": lambda: Polyhedron(rng.normal(size=(4, 3))),
        "plate": lambda: box(1.0, 0.7, 1e-3),
    }[form]()
    grain, place, asked = unworn(shape), np.zeros(3), 0.0
    for _ in range(3):
        for _ in range(4):
            ends = grain.shape.edges[rng.integers(len(grain.shape.edges)), :2]
            volume = share * shape.volume * rng.random()
            grain, asked = rub_edges(grain, ends[: 1 + rng.integers(2)], volume), asked + volume
        made = wear_polyhedron(grain)
        if made is not None:
            grain, place = made[0], place + made[1]
    gone = shape.volume - grain.shape.volume
    assert gone + grain.pending.sum() == pytest.approx(asked, abs=1e-12 * shape.volume)
    assert grain.lost.sum() == pytest.approx(gone, abs=1e-12 * shape.volume)
    height = (grain.shape.vertices + place) @ shape.normals.T - shape.distances
    assert height.max() < 1e-9 * shape.reach
    assert len(grain.normal) <= len(shape.vertices) + len(shape.edges)


def test_wear_too_small_to_cut_waits_and_too_much_is_refused():
    corner = np.array([0])
    assert wear_polyhedron(rub_edges(unworn(CUBE), corner, 1e-18)) is None
    with pytest.raises(ShapeError, match="cut more often"):
        wear_polyhedron(rub_edges(unworn(CUBE), corner, 0.6))
    with pytest.raises(ShapeError, match=r"^wear of \S.* at 0\.\d+ s: .*\n.*cut more often"):
        slope(step=1e-2, wear=Wear(1.0, every=5)).advance(0.5)


def test_what_stays_keeps_every_points_velocity():
    """A spinning cube loses corners: what is left moves as a part of the whole did; mass, energy
    of what went are reported."""
    scene = Scene(3, [0.0, 0.0, -GRAVITY])
    turn = quaternion_of_rotation([0.3, -0.2, 0.4])
    scene.add(
        CUBE, density=2.0, position=[0, 0, 1], angle=turn, velocity=[0.3, -0.2, 0.1],
        spin=[1.0, 2.0, -1.0],
    )  # fmt: skip
    motion = Motion(
        np.array([[0.0, 0, 1]]), turn[None], np.array([[0.3, -0.2, 0.1]]),
        np.array([[1.0, 2.0, -1.0]]),
    )  # fmt: skip
    state = start_wear(scene)
    state.grains[0] = rub_edges(
        rub_edges(state.grains[0], np.array([0]), 0.03), np.array([5]), 0.01
    )
    worn, after = replace_worn(scene, motion, state)
    body = worn.bodies[0]
    arm = body.position - motion.position[0]
    assert np.linalg.norm(arm) > 1e-3
    turned = np.cross([1.0, 2.0, -1.0], arm)
    assert body.velocity - turned == pytest.approx([0.3, -0.2, 0.1], rel=1e-13)
    assert body.mass == pytest.approx(2 * 0.96, rel=1e-13)
    assert after.mass == pytest.approx(0.08, rel=1e-12)
    assert after.energy == pytest.approx(
        energy_of(scene.bodies[0], scene.gravity) - energy_of(body, scene.gravity)
    )
    assert after.energy > 0


def test_pile_of_stones_wears_without_overlap_or_a_burst():
    """Stones thrown on each other: energy never grows while they wear, all volume is accounted
    for, and no two overlap."""
    rng = np.random.default_rng(0)
    scene = Scene(3)
    scene.add(HalfSpace([0, 0, 1]), friction=0.5)
    for k in range(6):
        scene.add(
            ballast_stone(rng, 0.1), density=2700.0, friction=0.5, angle=rng.normal(size=4),
            position=[0.08 * (k % 2), 0.0, 0.1 + 0.12 * k], velocity=[2.0 * (-1) ** k, 0.0, -1.0],
        )  # fmt: skip
    run = Simulation(scene, step=2e-3, tolerance=1e-9, wear=Wear(2e-6, every=5))
    whole, energy = volumes(run), run.energy
    mass = sum(body.mass for body in scene.bodies if body.movable)
    for _ in range(20):
        run.advance(1e-2)
        # a body that comes to rest within a step may gain m (h g)^2 / 8 (time_stepping)
        assert run.energy <= energy + mass * (2e-3 * GRAVITY) ** 2 / 8
        energy = run.energy
    assert run.worn.volume > 5e-4 * whole
    gone = whole - volumes(run) + run.worn.pending.sum()
    assert gone == pytest.approx(run.worn.volume, rel=1e-9)
    assert run.overlap < 1e-9 * 0.1


def test_units_do_not_matter():
    """Millimetres and grams: volume in mm^3 is 1e9 times that in m^3, k is 1 as energy is 1e9."""
    metres = slope(step=1e-2, wear=Wear(1e-6, every=10))
    small = slope(length=1e3, mass=1e3, step=1e-2, wear=Wear(1e-6, every=10))
    metres.advance(0.2)
    small.advance(0.2)
    assert small.worn.volume == pytest.approx(1e9 * metres.worn.volume, rel=1e-9)
    assert volumes(small) == pytest.approx(1e9 * volumes(metres), rel=1e-12)


def test_stiffness_follows_wear_gradually():
    wear = Wear(1e-6, every=5, volume_scale=1e-7, stiffness_left=0.2)
    run = slope(step=1e-2, wear=wear)
    shares = []
    for _ in range(3):
        run.advance(0.1)
        shares.append(contact_stiffness_worn(run.worn, wear, run.contacts, 2.0).max())
    assert (np.diff(shares) < 0).all()
    assert 0.4 <= shares[-1] < shares[0] < 2.0
    assert (contact_stiffness_worn(run.worn, Wear(1e-6), run.contacts, 2.0) == 2.0).all()


def test_a_ball_wears_what_it_rubs_and_not_itself():
    """A ball slides on a face: none wears; pressed along an edge, the edge does."""
    scene = Scene(3, [0, 0, 0])
    scene.add(CUBE, density=1.0, position=[0, 0, 0])
    scene.add(Sphere(0.3), density=1.0, position=[0.1, 0.2, 0.8])
    for place, wears in (([0.1, 0.2, 0.8], 0), ([0.1, 0.6, 0.6], 2), ([0.6, 0.6, 0.6], 1)):
        state = start_wear(scene)
        found = contacts([CUBE, Sphere(0.3)], [[0, 0, 0], place], margin=0.5)
        rub_solids(state, found, np.array([0.01]))
        height = CUBE.vertices @ state.grains[0].normal.T
        on = 0 if wears == 0 else int((height[:, 0] > height[:, 0].max() - 1e-9).sum())
        assert on == wears
        assert state.volume == (0.01 if wears else 0.0)


def test_a_broken_stone_wears_on_as_its_parts():
    run = slope(step=1e-2, wear=Wear(1e-6, every=5))
    run.advance(0.2)
    worn = run.worn.volume
    run.fragment(1, (run.positions[1], [1.0, 0.0, 0.0]))
    run.advance(0.1)
    assert len(run.worn.grains) == 3
    assert run.worn.volume > worn
    assert run.overlap < 1e-9
