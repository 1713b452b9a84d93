"""Wear in a run: V = k W exactly, area and momentum in balance, shapes that only shrink.

Reference: Archard 1953, Reye 1860 (V = k W); Schwager and Poeschel 2002, section 8 (end).
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigid_lcp.errors import SceneError, ShapeError, UsageError
from rigid_lcp.motion.state import Motion
from rigid_lcp.motion.world import Scene
from rigid_lcp.scene.simulation import Simulation
from rigid_lcp.shapes.disc import Disc
from rigid_lcp.shapes.half_space import HalfSpace
from rigid_lcp.shapes.polygon import Polygon
from rigid_lcp.wear.corners import Wear, contact_stiffness_worn, replace_worn, start_wear
from rigid_lcp.wear.fragmentation import polygon_moments
from rigid_lcp.wear.polygons import chamfer_corners, cut_depth, take_corners, wear_polygon

GRAVITY = 9.81
SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


def slope(angle=0.5, friction=0.3, length=1.0, mass=1.0, **options) -> Simulation:
    """A block of 0.2 by 0.1 m, in units of ``length`` and ``mass``, sliding down a slope."""
    g = GRAVITY * length
    scene = Scene(2, [g * np.sin(angle), -g * np.cos(angle)])
    scene.add(HalfSpace([0, 1]), friction=friction)
    block = Polygon.rectangle(0.2 * length, 0.1 * length)
    scene.add(block, density=2700.0 * mass / length**2, position=[0, 0.05 * length])
    return Simulation(scene, **options)


def areas(run: Simulation) -> float:
    return sum(body.shape.area for body in run.world.scene.bodies if body.movable)


def test_block_that_slides_down_loses_k_times_work():
    """x = (sin a - mu cos a) g t^2 / 2, W = mu m g cos a x, V = k W; with so little wear that the
    mass stays what it was to 1e-9.  The area that is gone is V to round-off of the area."""
    angle, friction, k, time = 0.5, 0.3, 1e-12, 0.5
    run = slope(angle, friction, step=5e-3, wear=Wear(k, every=10))
    run.advance(time)
    pull = GRAVITY * (np.sin(angle) - friction * np.cos(angle))
    work = friction * 54.0 * GRAVITY * np.cos(angle) * pull * time**2 / 2
    assert run.worn is not None
    assert run.worn.work == pytest.approx(work, rel=1e-9)
    assert run.worn.volume == pytest.approx(k * work, rel=1e-9)
    gone = 0.02 - areas(run) + run.worn.pending.sum()
    assert gone == pytest.approx(run.worn.volume, abs=1e-17)
    assert run.worn.mass == pytest.approx(2700 * (0.02 - areas(run)), abs=1e-13)


def test_wear_that_is_seen_takes_mass_and_keeps_the_rest_moving():
    """A twentieth of the block goes: area, mass, inertia are those of the worn shape, it slides on
    as a block of any mass does (v = a t), and nothing overlaps."""
    run = slope(step=5e-3, wear=Wear(4e-5, every=5))
    run.advance(0.5)
    body = run.world.scene.bodies[1]
    assert areas(run) < 0.95 * 0.02
    assert body.mass == pytest.approx(2700 * body.shape.area, rel=1e-12)
    area, _, second = polygon_moments(body.shape.vertices)
    assert body.shape.area == pytest.approx(area, rel=1e-12)
    assert body.inertia == pytest.approx(2700 * second, rel=1e-12)
    pull = GRAVITY * (np.sin(0.5) - 0.3 * np.cos(0.5))
    assert run.velocities[1] == pytest.approx([pull * 0.5, 0.0], abs=1e-9)
    assert run.overlap < 1e-12
    assert 0.02 - areas(run) + run.worn.pending.sum() == pytest.approx(run.worn.volume, rel=1e-10)


def test_steps_and_cuts_do_not_matter_in_the_limit():
    """Worn volume against step and against the steps between cuts: differences shrink with both.

    The block's mass falls by 1 %, so that wear feeds back on the forces."""
    volume = {
        (h, every): (lambda run: (run.advance(0.4), run.worn.volume)[1])(
            slope(step=h, wear=Wear(2e-6, every=every))
        )
        for h, every in ((0.02, 1), (0.01, 1), (0.005, 1), (0.005, 8))
    }
    coarse = abs(volume[0.02, 1] - volume[0.005, 1])
    fine = abs(volume[0.01, 1] - volume[0.005, 1])
    assert fine < 0.5 * coarse
    assert volume[0.005, 8] == pytest.approx(volume[0.005, 1], rel=5e-3)


def test_units_do_not_matter():
    """Millimetres and grams: area in mm^2 is 1e6 times that in m^2."""
    metres = slope(step=5e-3, wear=Wear(1e-6, every=10))
    # energy [g mm^2 / s^2] = 1e9 [J], area 1e6: k is 1e-3 as large
    small = slope(length=1e3, mass=1e3, step=5e-3, wear=Wear(1e-9, every=10))
    metres.advance(0.2)
    small.advance(0.2)
    assert small.worn.volume == pytest.approx(1e6 * metres.worn.volume, rel=1e-9)
    assert areas(small) == pytest.approx(1e6 * areas(metres), rel=1e-12)


def test_what_stays_keeps_every_points_velocity():
    """A spinning square loses corners: each point of what is left moves as before, so kinetic
    energy is that of the rigid motion of the smaller body, and never more than before."""
    scene = Scene(2, [0, 0])
    scene.add(Polygon(SQUARE), density=1.0, velocity=[0.3, -0.2], spin=2.0, angle=0.4)
    motion = Motion(
        np.array([[1.0, 2.0]]), np.array([0.4]), np.array([[0.3, -0.2]]), np.array([2.0])
    )
    state = start_wear(scene)
    state.pending[:] = [0.01, 0.0, 0.03, 0.002]
    worn, after = replace_worn(scene, motion, state)
    body = worn.bodies[0]
    arm = body.position - motion.position[0]
    assert body.velocity == pytest.approx([0.3 - 2 * arm[1], -0.2 + 2 * arm[0]], rel=1e-14)
    assert body.shape.area == pytest.approx(1 - 0.042, rel=1e-14)
    assert body.mass == pytest.approx(1 - 0.042, rel=1e-14)
    assert after.pending.sum() == 0
    # every corner of the worn shape is a point of the sharp one, in the world
    turn = np.array([[np.cos(0.4), -np.sin(0.4)], [np.sin(0.4), np.cos(0.4)]])
    back = (body.shape.vertices @ turn.T + body.position - motion.position[0]) @ turn
    assert np.abs(back).max() <= 0.5 + 1e-15


def test_pile_wears_without_overlap_or_a_burst():
    """Blocks thrown on each other: energy never grows while they wear, and all area is accounted
    for; the order of the bodies is no matter for the sum to the accuracy of the run."""
    scene = Scene(2)
    scene.add(HalfSpace([0, 1]), friction=0.4)
    for k in range(6):
        scene.add(
            Polygon.regular(5, 0.1), density=2000.0, friction=0.4, angle=0.3 * k,
            position=[0.12 * (k % 2), 0.12 + 0.21 * k], velocity=[2.0 * (-1) ** k, 0.0],
        )  # fmt: skip
    run = Simulation(scene, step=2e-3, tolerance=1e-10, wear=Wear(1e-5, every=5))
    whole, energy = areas(run), run.energy
    for _ in range(60):
        run.advance(1e-2)
        # a body that comes to rest within a step may gain m (h g)^2 / 8 (time_stepping)
        assert run.energy <= energy + 6 * 50 * (2e-3 * GRAVITY) ** 2 / 8
        energy = run.energy
    assert run.worn.volume > 1e-3 * whole
    gone = whole - areas(run) + run.worn.pending.sum()
    assert gone == pytest.approx(run.worn.volume, rel=1e-9)
    assert run.overlap < 1e-4


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 10**6), corners=st.integers(3, 9), share=st.floats(1e-6, 0.3))
def test_worn_polygons_lose_exactly_what_they_shall(seed, corners, share):
    """Any convex polygon, worn at all corners, repeatedly: area to round-off, convex, inside."""
    rng = np.random.default_rng(seed)
    angle = np.sort(rng.uniform(0, 2 * np.pi, corners)) + np.linspace(0, 1e-2, corners)
    if np.ptp(np.diff(np.append(angle, angle[0] + 2 * np.pi))) > 3.0:
        angle = np.linspace(0, 2 * np.pi, corners, endpoint=False)
    shape = Polygon(np.column_stack([np.cos(angle), np.sin(angle)]))
    scene = Scene(2)
    scene.add(shape, density=1.0)
    grain, area = start_wear(scene).grains[0], shape.area
    for _ in range(4):
        pending = rng.uniform(0, 1, len(grain.vertices)) * (rng.random(len(grain.vertices)) < 0.7)
        pending *= share * area / 4 / max(pending.sum(), 1e-9)
        made, left = wear_polygon(grain, pending) or (None, None)
        if made is None:
            continue
        now = polygon_moments(made.vertices)[0]
        before = polygon_moments(grain.vertices)[0]
        assert now == pytest.approx(before - pending.sum() + left.sum(), abs=1e-11)
        worn = Polygon(made.vertices)  # convex, or it is refused
        outward, faces = shape.face_normals, shape.vertices
        height = (made.vertices[:, None] - faces[None]) @ outward.T
        assert np.diagonal(height, axis1=1, axis2=2).max() < 1e-12
        assert worn.area <= before + 1e-15
        grain = made


def test_chamfer_by_chamfer_is_one_chamfer_of_the_sum():
    """Wear in ten parts at any of a corner's ends is wear at once: the square's corner."""
    scene = Scene(2)
    scene.add(Polygon(SQUARE), density=1.0)
    grain = start_wear(scene).grains[0]
    for k in range(10):
        pending = np.zeros(len(grain.vertices))
        pending[np.flatnonzero(grain.owner == 2)[k % 2 if k else 0]] = 1e-3
        grain, _ = wear_polygon(grain, pending)
    once, _ = chamfer_corners(grain.sharp, np.array([0, 0, 1e-2, 0]))
    assert grain.vertices == pytest.approx(once, abs=1e-14)
    assert grain.total[grain.owner == 2] == pytest.approx(1e-2)


def test_corner_larger_than_its_edges():
    """A straight cut across the bisector takes neighbours with it: area to 1e-12."""
    left, nearest = take_corners(SQUARE, np.array([0.4, 0.0, 0.0, 0.0]))
    assert polygon_moments(left)[0] == pytest.approx(0.6, rel=1e-12)
    assert len(nearest) == len(left)
    with pytest.raises(ShapeError, match="cut more often"):
        take_corners(SQUARE, np.array([0.6, 0.0, 0.0, 0.0]))
    with pytest.raises(ShapeError, match=r"^wear of \S.* at 0\.\d+ s: .*\n.*cut more often"):
        slope(step=1e-2, wear=Wear(1.0, every=5)).advance(0.5)


def test_wear_too_small_to_cut_waits_at_its_corner():
    """One corner worn by 0.01, another by 1e-20 of the area: a chamfer of 1e-10 m is no edge."""
    scene = Scene(2)
    scene.add(Polygon(SQUARE), density=1.0)
    grain = start_wear(scene).grains[0]
    assert wear_polygon(grain, np.full(4, 1e-20)) is None
    made, left = wear_polygon(grain, np.array([0.01, 0.0, 1e-20, 0.0]))
    assert len(made.vertices) == 5
    assert left.sum() == 1e-20
    assert made.owner[np.argmax(left)] == 2
    assert polygon_moments(made.vertices)[0] == pytest.approx(0.99, rel=1e-14)


@settings(max_examples=50, deadline=None)
@given(share=st.floats(1e-12, 0.999), height=st.floats(0.1, 3.0))
def test_depth_of_a_cut_in_closed_form(share, height):
    """A triangle's tip: the area goes with the square of the depth, t = H sqrt(share)."""
    t = cut_depth(np.array([0.0, -height, -height]), np.array([0.3, -1.0, 1.0]), share * height)
    assert t == pytest.approx(height * np.sqrt(share), rel=1e-13)


def test_stiffness_follows_wear_gradually():
    """The more a corner has worn, the softer its contact; corners alike keep alike stiffness."""
    wear = Wear(1e-6, every=5, volume_scale=1e-7, stiffness_left=0.2)
    run = slope(step=5e-3, wear=wear)
    shares = []
    for _ in range(4):
        run.advance(0.05)
        shares.append(contact_stiffness_worn(run.worn, wear, run.contacts, 2.0).max())
    assert (np.diff(shares) < 0).all()
    assert 0.4 <= shares[-1] < shares[0] < 2.0
    plain = contact_stiffness_worn(run.worn, Wear(1e-6), run.contacts, 2.0)
    assert (plain == 2.0).all()


def test_discs_faces_and_what_does_not_slide_keep_their_shape():
    scene = Scene(2)
    scene.add(HalfSpace([0, 1]), friction=0.5)
    scene.add(Disc(0.1), density=1000.0, position=[0, 0.1], velocity=[1.0, 0.0])
    scene.add(Polygon.rectangle(0.2, 0.2), density=1000.0, position=[2.0, 0.1])
    run = Simulation(scene, step=5e-3, wear=Wear(1e-4, every=1))
    run.advance(0.2)
    assert run.worn.work > 0  # the disc slid
    assert run.worn.volume < 1e-15 * 1e-4 * run.worn.work
    assert run.world.scene.bodies[1].shape is scene.bodies[1].shape


def test_wear_that_is_refused():
    with pytest.raises(UsageError, match="acceleration level"):
        slope(method="acceleration", wear=Wear(1e-9))
    for coefficient in (-1.0, np.nan, np.inf, "a", None):
        with pytest.raises(SceneError, match="wear coefficient"):
            Wear(coefficient)
    for every in (0, 1.5, "a", True):
        with pytest.raises(SceneError, match="every"):
            Wear(1e-9, every=every)


def test_order_of_the_bodies_is_no_matter():
    """Two blocks on a slope, added in either order: each loses the same, to round-off."""
    lost = []
    for order in ((0, 1), (1, 0)):
        scene = Scene(2, [4.0, -8.0])
        for k in order:
            block = Polygon.rectangle(0.2 + 0.1 * k, 0.1)
            scene.add(block, density=2700.0 * (1 + k), position=[k, 0.05], friction=0.1 + 0.2 * k)
        scene.add(HalfSpace([0, 1]))
        run = Simulation(scene, step=1e-2, wear=Wear(1e-6, every=3))
        run.advance(0.2)
        lost.append([0.02 + 0.01 * k - run.world.scene.bodies[order[k]].shape.area for k in (0, 1)])
    assert lost[0] == pytest.approx(lost[1], rel=1e-10)
    assert min(lost[0]) > 0
