"""Wear in a run: V = k W exactly; volume, mass and energy in balance, shapes that only shrink.

Reference: Archard 1953, Reye 1860 (V = k W); Schwager and Poeschel 2002, section 8 (end).
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from rigid_lcp import (
    Disc,
    HalfSpace,
    Polygon,
    Polyhedron,
    Scene,
    Simulation,
    Sphere,
    Wear,
    make_box,
)
from rigid_lcp.errors import SceneError, ShapeError, UsageError
from rigid_lcp.motion import make_world
from rigid_lcp.shapes import make_quaternion, multiply_quaternions
from rigid_lcp.wear.abrasion import find_energy, find_slip_work, rub_grains, start_wear, swap_worn
from rigid_lcp.wear.cuts import (
    find_cut_depth,
    find_volume,
    make_unworn,
    rub_corners,
    wear_shape,
)
from tests.rigid_solids import CUBE, contacts, make_stone

GRAVITY = 9.81
SQUARE = Polygon.rectangle(1.0, 1.0)
NEEDLE = Polyhedron([[0, 0, 0], [1, 0, 0], [0.5, 1e-3, 0], [0.5, 0, 1e-3], [0.5, 1e-3, 1e-3]])
SLIVER = Polyhedron([[0, 0, 0], [1, 0, 0], [0.3, 1e-3, 0], [0.4, 0.4, 0.2]])


def slope(dim, angle=0.5, friction=0.3, length=1.0, mass=1.0, **options) -> Simulation:
    """A block of 0.2 by 0.1 (by 0.1) m, in units of ``length`` and ``mass``, sliding down."""
    g = GRAVITY * length
    scene = Scene(dim, [g * np.sin(angle), *[0.0] * (dim - 2), -g * np.cos(angle)])
    scene.add(HalfSpace([0.0] * (dim - 1) + [1.0]), friction=friction)
    sides = [0.2 * length, *[0.1 * length] * (dim - 1)]
    block = Polygon.rectangle(*sides) if dim == 2 else make_box(*sides)
    place = [0.0] * (dim - 1) + [0.05 * length]
    scene.add(block, density=2700.0 * mass / length**dim, position=place)
    return Simulation(scene, **options)


def volumes(run: Simulation) -> float:
    return sum(find_volume(body.shape) for body in run.world.scene.bodies if body.movable)


@pytest.mark.parametrize("dim", [2, 3])
def test_block_that_slides_down_loses_k_times_work(dim):
    """x = (sin a - mu cos a) g t^2 / 2, W = mu m g cos a x, V = k W; with so little wear that the
    mass stays what it was to 1e-9.  The volume that is gone is V to round-off of the volume."""
    angle, friction, k, time = 0.5, 0.3, 1e-13, 0.4
    run = slope(dim, angle, friction, step=1e-2, wear=Wear(k, every=10))
    whole = volumes(run)
    run.advance(time)
    pull = GRAVITY * (np.sin(angle) - friction * np.cos(angle))
    work = friction * 2700 * whole * GRAVITY * np.cos(angle) * pull * time**2 / 2
    assert run.worn.work == pytest.approx(work, rel=1e-9)
    assert run.worn.volume == pytest.approx(k * work, rel=1e-9)
    gone = whole - volumes(run)
    assert gone + run.worn.pending.sum() == pytest.approx(run.worn.volume, abs=1e-15 * whole)
    assert run.worn.mass == pytest.approx(2700 * gone, abs=1e-12)


@pytest.mark.long
@pytest.mark.parametrize(("dim", "k"), [(2, 4e-5), (3, 1e-5)])
def test_wear_that_is_seen_takes_mass_and_keeps_the_rest_moving(dim, k):
    """A share of the block goes, off its lower corners: mass and inertia are those of the worn
    shape, which slides on as a block of any mass does (v = a t); energy in balance."""
    run = slope(dim, step=1e-2, wear=Wear(k, every=5))
    start, whole = run.energy, volumes(run)
    run.advance(0.5)
    body = run.world.scene.bodies[1]
    shape = type(body.shape)(body.shape.vertices)
    mass, inertia = shape.mass_properties(2700)
    assert volumes(run) < 0.99 * whole
    assert len(shape.faces) == (6 if dim == 2 else 10)
    assert body.mass == pytest.approx(mass, rel=1e-12)
    assert body.inertia == pytest.approx(inertia, rel=1e-10, abs=1e-15)
    pull = GRAVITY * (np.sin(0.5) - 0.3 * np.cos(0.5))
    assert run.velocities[1] == pytest.approx([pull * 0.5, *[0.0] * (dim - 1)], abs=1e-9)
    assert run.overlap < 1e-12
    gone = whole - volumes(run)
    assert gone + run.worn.pending.sum() == pytest.approx(run.worn.volume, rel=1e-10)
    assert run.worn.mass == pytest.approx(2700 * gone, rel=1e-10)
    # what friction took, what the crumbs took with them, what is left
    assert run.energy == pytest.approx(start - run.worn.work - run.worn.energy, rel=1e-11)
    grain = run.worn.grains[1]
    front, back = (grain.lost[sign * grain.normal[:, 0] > 0] for sign in (1, -1))
    assert len(front) == len(back) == dim - 1
    assert min(front.min(), back.min()) > 0
    # friction turns the block onto its front: N_f x_f - N_b x_b = mu h (N_f + N_b), mu h = 0.015.
    # Both sides bear at 0.1 until chamfers give each ends from 0.054 to 0.1; which of them bear,
    # and which of one side's corners, is the solver's choice (redundant contacts)
    assert 1.0 < front.sum() / back.sum() < (0.1 + 0.015) / (0.054 - 0.015)


@pytest.mark.long
def test_steps_and_cuts_do_not_matter_in_the_limit():
    """Worn volume against step and against the steps between cuts: differences shrink with both.

    The block's mass falls by 1 %, so that wear feeds back on the forces."""
    volume = {}
    for h, every in ((0.02, 1), (0.01, 1), (0.005, 1), (0.005, 8)):
        run = slope(2, step=h, wear=Wear(2e-6, every=every))
        run.advance(0.4)
        volume[h, every] = run.worn.volume
    coarse = abs(volume[0.02, 1] - volume[0.005, 1])
    fine = abs(volume[0.01, 1] - volume[0.005, 1])
    assert fine < 0.5 * coarse
    assert volume[0.005, 8] == pytest.approx(volume[0.005, 1], rel=5e-3)


@pytest.mark.parametrize("dim", [2, 3])
def test_units_do_not_matter(dim):
    """Millimetres and grams: energy [g mm^2 / s^2] is 1e9 times that in J, volume 1e3^dim."""
    metres = slope(dim, step=1e-2, wear=Wear(1e-6, every=10))
    small = slope(dim, length=1e3, mass=1e3, step=1e-2, wear=Wear(1e-15 * 1e3**dim, every=10))
    metres.advance(0.2)
    small.advance(0.2)
    assert small.worn.volume == pytest.approx(1e3**dim * metres.worn.volume, rel=1e-9)
    assert volumes(small) == pytest.approx(1e3**dim * volumes(metres), rel=1e-12)


@pytest.mark.parametrize("dim", [2, 3])
def test_what_stays_keeps_every_points_velocity(dim):
    """A spinning square (cube) loses corners: what is left moves as a part of the whole did; mass
    and energy of what went are reported; no corner lies outside of what there was."""
    shape, spin, turn = (SQUARE, 2.0, 0.4) if dim == 2 else (CUBE, [1.0, 2.0, -1.0], [3, 1, -1, 2])
    scene = Scene(dim)
    velocity = [0.3, -0.2, 0.1][:dim]
    scene.add(shape, density=2.0, position=[1.0] * dim, angle=turn, velocity=velocity, spin=spin)
    _, motion = make_world(scene)
    state = start_wear(scene)
    for corner, volume in ((0, 0.03), (2, 0.01)):
        state.grains[0] = rub_corners(state.grains[0], np.array([corner]), volume)
    worn, after = swap_worn(scene, motion, state)
    body = worn.bodies[0]
    arm = body.position - motion.position[0]
    assert np.linalg.norm(arm) > 1e-3
    turned = 2 * np.array([-arm[1], arm[0]]) if dim == 2 else np.cross(spin, arm)
    assert body.velocity - turned == pytest.approx(velocity, rel=1e-13)
    assert body.mass == pytest.approx(2 * 0.96, rel=1e-13)
    assert after.mass == pytest.approx(0.08, rel=1e-12)
    assert after.energy == pytest.approx(
        find_energy(scene.bodies[0], scene.gravity) - find_energy(body, scene.gravity)
    )
    assert after.energy > 0
    way = wear_shape(state.grains[0])[1]
    assert np.abs(body.shape.vertices + way).max() <= 0.5 + 1e-15


def test_crossing_edges_share_the_wear_and_become_chamfers():
    """A cube's edge across another's: each loses half, along the whole edge, ``V = l t^2 2 / 2`` of
    a right-angled edge to the depth t of the chamfer."""
    lower = make_quaternion([np.pi / 4, 0.0, 0.0])
    upper = multiply_quaternions(make_quaternion([0.0, 0.0, np.pi / 2]), lower)
    scene = Scene(3, [0, 0, 0])
    for turn, high in ((lower, 0.0), (upper, 2**0.5)):
        scene.add(CUBE, density=1.0, position=[0, 0, high], angle=turn)
    found = contacts([CUBE, CUBE], [[0, 0, 0], [0, 0, 2**0.5]], [lower, upper])
    state = start_wear(scene)
    rub_grains(state, found, np.array([0.02]))
    for grain in state.grains:
        assert grain.pending == pytest.approx([0.01])
        made, way = wear_shape(grain)
        assert len(made.shape.faces) == 7
        height = ((made.shape.vertices + way) @ grain.normal[0]).max()
        assert 0.5**0.5 - height == pytest.approx(0.1, rel=1e-12)
        assert made.shape.volume == pytest.approx(0.99, rel=1e-13)


def test_a_corner_on_a_corner_wears_as_much_as_the_other():
    """Two cubes on a diagonal, just apart: each loses half, at the corner next to the other."""
    tip = np.array([0.5, 0.5, 0.5])
    scene = Scene(3, [0, 0, 0])
    for _ in range(2):
        scene.add(CUBE, density=1.0)
    state, near = start_wear(scene), 1.0001 * tip
    rub_grains(state, contacts([CUBE, CUBE], [-near, near]), np.array([0.02]))
    for grain, touched in zip(state.grains, (tip, -tip), strict=True):
        assert grain.pending == pytest.approx([0.01])
        assert CUBE.vertices[np.argmax(CUBE.vertices @ grain.normal[0])] == pytest.approx(touched)


@pytest.mark.parametrize("shape", [SQUARE, CUBE])
def test_chamfer_by_chamfer_is_one_chamfer_of_the_sum(shape):
    """Wear in ten parts, at any corner (or edge) of the chamfer, is wear at once."""
    corner = np.array([int(np.argmax(shape.vertices.sum(axis=1)))])
    grain, where = make_unworn(shape), corner
    for k in range(10):
        grain, _ = wear_shape(rub_corners(grain, where, 1e-3))
        height = grain.shape.vertices @ grain.normal[0]
        on = np.flatnonzero(height > height.max() - 1e-9)
        where = on[: 1 + k % 2] if shape.dim == 3 else on[k % 2 :][:1]
    assert len(grain.normal) == 1
    once, _ = wear_shape(rub_corners(make_unworn(shape), corner, 1e-2))
    assert find_volume(grain.shape) == pytest.approx(0.99, rel=1e-13)
    assert np.sort(grain.shape.vertices, axis=0) == pytest.approx(
        np.sort(once.shape.vertices, axis=0), abs=1e-12
    )


@settings(max_examples=30)
@given(share=st.floats(1e-12, 0.999))
def test_depth_of_a_cut_in_closed_form(share):
    """The tip of a triangle (tetrahedron): its share goes with the square (cube) of the depth."""
    for tip in (
        Polygon([[-1, 0], [1, 0], [0.3, 2.0]]),
        Polyhedron([[0, 0, 2.0], [1, 0, 0], [-0.5, 0.9, 0], [-0.5, -0.9, 0]]),
    ):
        depth = find_cut_depth(tip, np.eye(tip.dim)[-1], share * find_volume(tip))
        assert (depth / 2.0) ** tip.dim == pytest.approx(share, rel=1e-13, abs=1e-15)  # round-off


def make_shape(form: str, rng: np.random.Generator):
    angle = 2 * np.pi * (np.arange(7) + rng.uniform(0, 0.9, 7)) / 7
    return {
        "polygon": lambda: Polygon(np.column_stack([np.cos(angle), np.sin(angle)])),
        "triangle": lambda: Polygon([[0, 0], [1, 0], [rng.random(), 0.3]]),
        "stone": lambda: make_stone(rng, 1.0),
        "needle": lambda: NEEDLE,
        "sliver": lambda: SLIVER,
        "tetrahedron": lambda: Polyhedron(rng.normal(size=(4, 3))),
        "plate": lambda: make_box(1.0, 0.7, 1e-3),
    }[form]()


SOLIDS = ("stone", "needle", "sliver", "tetrahedron", "plate")


@pytest.mark.parametrize(
    "form", ["polygon", "triangle", *(pytest.param(one, marks=pytest.mark.long) for one in SOLIDS)]
)
@settings(max_examples=10)
@given(seed=st.integers(0, 10**6), share=st.floats(1e-9, 0.03))
@example(seed=84489, share=1e-9)  # of the sliver: triangles 1 m long and 1e-8 m high
def test_worn_shapes_lose_exactly_what_they_shall(form, seed, share):
    """Any shape, worn at any features, repeatedly: volume to round-off, inside the first.

    Twelve shares are 0.36 of the grain at most, so that no cut takes half of what is left: what
    waits at one feature, y, and what went before, x, have y <= 0.36 - x < (1 - x) / 2.
    """
    rng = np.random.default_rng(seed)
    shape = make_shape(form, rng)
    whole = find_volume(shape)
    grain, place, asked = make_unworn(shape), np.zeros(shape.dim), 0.0
    for _ in range(3):
        for _ in range(4):
            ends = grain.shape.edges[rng.integers(len(grain.shape.edges)), :2]
            feature = ends[: 1 + rng.integers(shape.dim - 1)]
            volume = share * whole * rng.random()
            grain, asked = rub_corners(grain, feature, volume), asked + volume
        made = wear_shape(grain)
        if made is not None:
            grain, place = made[0], place + made[1]
    gone = whole - find_volume(grain.shape)
    assert gone + grain.pending.sum() == pytest.approx(asked, abs=1e-12 * whole)
    assert grain.lost.sum() == pytest.approx(gone, abs=1e-12 * whole)
    level = [
        shape.vertices[face[0]] @ n for face, n in zip(shape.faces, shape.normals, strict=True)
    ]
    height = (grain.shape.vertices + place) @ shape.normals.T - level
    assert height.max() < 1e-9 * shape.reach
    assert len(grain.normal) <= len(shape.vertices) + len(shape.edges)


@pytest.mark.parametrize("shape", [SQUARE, CUBE])
def test_wear_too_small_to_cut_waits_and_too_much_is_refused(shape):
    """One corner worn by 0.01, another by 1e-20 of the volume: such a chamfer is no edge."""
    first, other = np.array([0]), np.array([2])
    assert wear_shape(rub_corners(make_unworn(shape), first, 1e-18)) is None
    grain = rub_corners(rub_corners(make_unworn(shape), first, 0.01), other, 1e-20)
    made, _ = wear_shape(grain)
    assert len(made.shape.faces) == len(shape.faces) + 1
    assert made.pending[1] == 1e-20
    with pytest.raises(ShapeError, match="cut more often"):
        wear_shape(rub_corners(make_unworn(shape), first, 0.6))
    with pytest.raises(ShapeError, match=r"^wear of \S.* at 0\.\d+ s: .*\n.*cut more often"):
        slope(shape.dim, step=1e-2, wear=Wear(1.0, every=5)).advance(0.5)


@pytest.mark.long
@pytest.mark.parametrize("dim", [2, 3])
def test_pile_wears_without_overlap_or_a_burst(dim):
    """Stones thrown on each other: energy never grows while they wear, all volume is accounted
    for, and no two overlap."""
    rng = np.random.default_rng(0)
    scene = Scene(dim)
    scene.add(HalfSpace([0.0] * (dim - 1) + [1.0]), friction=0.5)
    for k in range(6):
        shape = Polygon.regular(5, 0.05) if dim == 2 else make_stone(rng, 0.1)
        side = (-1) ** k
        scene.add(
            shape, density=2700.0, friction=0.5, angle=0.3 * k if dim == 2 else rng.normal(size=4),
            position=[0.08 * (k % 2), *[0.0] * (dim - 2), 0.1 + 0.12 * k],
            velocity=[2.0 * side, *[0.0] * (dim - 2), -1.0],
        )  # fmt: skip
    run = Simulation(scene, step=2e-3, tolerance=1e-9, wear=Wear(2e-6, every=5))
    whole, energy = volumes(run), run.energy
    mass = sum(body.mass for body in scene.bodies if body.movable)
    for _ in range(20):
        run.advance(1e-2)
        # a body that comes to rest within a step may gain m (h g)^2 / 8 (time_stepping)
        assert run.energy <= energy + mass * (2e-3 * GRAVITY) ** 2 / 8
        energy = run.energy
    assert run.worn.volume > 2e-4 * whole
    gone = whole - volumes(run) + run.worn.pending.sum()
    assert gone == pytest.approx(run.worn.volume, rel=1e-9)
    assert run.overlap < 1e-9 * 0.1


def test_order_of_the_bodies_does_not_matter():
    """Two blocks that slide, added in either order: each loses the same, to round-off."""
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


def test_a_ball_wears_what_it_rubs_and_not_itself():
    """A ball slides on a face: none wears; pressed along an edge, the edge does."""
    scene = Scene(3, [0, 0, 0])
    scene.add(CUBE, density=1.0, position=[0, 0, 0])
    scene.add(Sphere(0.3), density=1.0, position=[0.1, 0.2, 0.8])
    for place, wears in (([0.1, 0.2, 0.8], 0), ([0.1, 0.6, 0.6], 2), ([0.6, 0.6, 0.6], 1)):
        state = start_wear(scene)
        found = contacts([CUBE, Sphere(0.3)], [[0, 0, 0], place], margin=0.5)
        rub_grains(state, found, np.array([0.01]))
        height = CUBE.vertices @ state.grains[0].normal.T
        on = 0 if wears == 0 else int((height[:, 0] > height[:, 0].max() - 1e-9).sum())
        assert on == wears
        assert state.volume == (0.01 if wears else 0.0)


def test_a_disc_wears_the_corner_it_rubs_and_not_itself():
    scene = Scene(2, [0, 0])
    scene.add(SQUARE, density=1.0)
    scene.add(Disc(0.3), density=1.0, position=[0.65, 0.7])
    world, motion = make_world(scene)
    for place, wears in (([0.65, 0.7], 1), ([0.1, 0.8], 0)):
        state = start_wear(scene)
        motion.position[1] = place
        rub_grains(state, world.contacts(motion, 0.1), np.array([0.01]))
        assert len(state.grains[0].normal) == wears
        assert state.volume == 0.01 * wears


def test_discs_faces_and_what_does_not_slide_keep_their_shape():
    """W = mu m g s of the disc that slides at first; no volume goes."""
    scene = Scene(2)
    scene.add(HalfSpace([0, 1]), friction=0.5)
    scene.add(Disc(0.1), density=1000.0, position=[0, 0.1], velocity=[1.0, 0.0])
    scene.add(Polygon.rectangle(0.2, 0.2), density=1000.0, position=[2.0, 0.1])
    run = Simulation(scene, step=5e-3, wear=Wear(1e-4, every=1))
    _, before = make_world(scene)
    run.advance(5e-3)
    work = find_slip_work(run.contacts, before, run.motion, 5e-3)
    assert work.min() >= 0
    assert run.worn.work == work.sum() > 0
    run.advance(0.2)
    assert run.worn.volume < 1e-15 * 1e-4 * run.worn.work
    assert run.world.scene.bodies[1].shape is scene.bodies[1].shape


def test_wear_that_is_refused():
    with pytest.raises(UsageError, match="acceleration level"):
        slope(2, method="acceleration", wear=Wear(1e-9))
    for coefficient in (-1.0, np.nan, np.inf, "a", None):
        with pytest.raises(SceneError, match="wear coefficient"):
            Wear(coefficient)
    for bad in ({"every": 0}, {"every": 1.5}, {"every": "a"}, {"every": True}):
        with pytest.raises(SceneError, match=next(iter(bad))):
            Wear(1e-9, **bad)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_broken_grain_wears_on_as_its_parts(dim):
    run = slope(dim, step=1e-2, wear=Wear(1e-6, every=5))
    run.advance(0.2)
    worn = run.worn.volume
    run.fragment(1, (run.positions[1], [0.0, 1.0] if dim == 2 else [1.0, 0.0, 0.0]))
    run.advance(0.1)
    assert len(run.worn.grains) == 3
    assert run.worn.volume > worn
    assert run.overlap < 1e-9
