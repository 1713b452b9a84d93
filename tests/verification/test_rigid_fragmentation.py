"""Fragmentation: what a break must conserve, shapes it must refuse, and a pile that stays.

Reference: Schwager and Poeschel 2002, section 10 ("the system remains always stable").
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigid_lcp.errors import ShapeError
from rigid_lcp.motion.world import Scene, make_world
from rigid_lcp.scene.simulation import Simulation
from rigid_lcp.shapes.disc import Disc
from rigid_lcp.shapes.half_space import HalfSpace
from rigid_lcp.shapes.polygon import Polygon
from rigid_lcp.wear.fragmentation import break_polygon, polygon_moments, split_body, split_polygon

SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


def grain(seed, far=0.0):
    """A convex polygon of 3 to 9 corners on an ellipse, turned, ``far`` metres from the origin."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 10))
    angle = 2 * np.pi * (np.arange(n) + rng.uniform(-0.3, 0.3, n)) / n
    flat = np.column_stack([np.cos(angle), rng.uniform(0.3, 1.0) * np.sin(angle)])
    a = rng.uniform(0, 2 * np.pi)
    return flat @ np.array([[np.cos(a), np.sin(a)], [-np.sin(a), np.cos(a)]]) + far


def invariants(bodies, about):
    """Mass, momentum, angular momentum about a point and kinetic energy of several bodies."""
    total = np.zeros(5)
    for m, inertia, x, v, w in bodies:
        arm = x - about
        turning = m * (arm[0] * v[1] - arm[1] * v[0]) + inertia * w
        total += [m, m * v[0], m * v[1], turning, m * v @ v / 2 + inertia * w**2 / 2]
    return total


def test_moments_of_a_rectangle_far_away():
    """Area b h, second moment b h (b^2 + h^2) / 12, to round-off at a kilometre."""
    area, centre, second = polygon_moments(SQUARE * [2.0, 1.0] + 1e3)
    assert area == pytest.approx(2.0, rel=1e-12)
    assert centre == pytest.approx([1001.0, 1000.5], rel=1e-15)
    assert second == pytest.approx(2 * 5 / 12, rel=1e-12)


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10**6), far=st.sampled_from([0.0, 10.0]))
def test_a_break_conserves_everything(seed, far):
    """The parts go on as parts of the rigid body: mass, momenta and energy to round-off."""
    rng = np.random.default_rng(seed)
    whole = grain(seed, far)
    area, centre, second = polygon_moments(whole)
    velocity, spin = rng.normal(size=2), 5 * rng.normal()
    line = centre + 0.05 * rng.normal(size=2), rng.normal(size=2)
    parts = break_polygon(whole, *line, 2700, velocity, spin)
    state = [(p.mass, p.inertia, p.position, p.velocity, p.spin) for p in parts]
    about = centre + rng.normal(size=2)
    before = invariants([(2700 * area, 2700 * second, centre, velocity, spin)], about)
    after = invariants(state, about)
    assert after == pytest.approx(before, rel=1e-12, abs=1e-12 * np.abs(before).max())
    # they share the ends of the cut, and neither approach nor part there
    ends = [p for p in parts[0].vertices if (p == parts[1].vertices).all(axis=1).any()]
    assert len(ends) == 2
    along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    for point in ends:
        rates = [
            p.velocity + p.spin * np.array([-1, 1]) * (point - p.position)[::-1] for p in parts
        ]
        apart = along[0] * (rates[0] - rates[1])[1] - along[1] * (rates[0] - rates[1])[0]
        assert apart == pytest.approx(0, abs=1e-13 * (1 + abs(spin)) * 10)


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_parts_are_polygons_on_either_side(seed):
    """Both parts are convex and anticlockwise, lie on their side, and share the ends of the cut."""
    whole = grain(seed)
    point = polygon_moments(whole)[1]
    along = np.array([np.cos(seed), np.sin(seed)])
    left, right = split_polygon(whole, point, along)
    normal = np.array([-along[1], along[0]])
    assert ((left - point) @ normal).min() > -1e-12
    assert ((right - point) @ normal).max() < 1e-12
    shared = {tuple(p) for p in left} & {tuple(p) for p in right}
    assert len(shared) == 2
    Polygon(left)
    Polygon(right)


def test_a_line_through_vertices():
    """The diagonal of a square: two triangles, no vertex twice."""
    left, right = split_polygon(SQUARE, (0, 0), (1, 1))
    assert len(left) == len(right) == 3


@pytest.mark.parametrize(
    ("vertices", "point", "direction", "words"),
    [
        (SQUARE, (0.5, 2.0), (1, 0), "misses"),
        (SQUARE, (0.5, 1.0), (1, 0), "misses"),
        (SQUARE, (0.5, 1 - 1e-5), (1, 0), "sliver"),
        (SQUARE, (0.5, 0.5), (0, 0), "zero"),
        (SQUARE, (0.5, np.nan), (1, 0), "not finite"),
        (SQUARE[:2], (0.5, 0.0), (0, 1), "shape"),
    ],
)
def test_what_can_not_be_split(vertices, point, direction, words):
    with pytest.raises(ShapeError, match=words):
        split_polygon(vertices, point, direction)


def pile():
    """Two blocks side by side on the ground, one across both, one on top of it."""
    scene = Scene(dim=2)
    scene.add(HalfSpace((0, 1)), friction=0.6)
    block = Polygon.rectangle(1.0, 0.6)
    for x, y in ((0.0, 0.3), (1.2, 0.3), (0.6, 0.9), (0.6, 1.5)):
        scene.add(block, density=2700, position=(x, y), friction=0.6)
    return scene


@pytest.mark.parametrize(
    ("body", "point", "direction"),
    [(1, (0.1, 0.3), (0.2, 1.0)), (3, (0.6, 0.9), (0.0, 1.0)), (4, (0.6, 1.5), (0.1, 1.0))],
)
def test_a_pile_stays_when_a_grain_of_it_breaks(body, point, direction):
    """A block at the bottom, the one that bridges two, or the one on top breaks along a steep
    line: every part stands, nothing moves but by round-off, and no energy appears."""
    run = Simulation(pile())
    run.advance(0.05)
    before = run.energy
    scene = split_body(run.world.scene, run.motion, body, point, direction)
    run = Simulation(scene)
    assert run.overlap < 1e-12
    assert run.energy == pytest.approx(before, rel=1e-12)
    start = run.positions.copy()
    run.advance(0.2)
    assert np.abs(run.positions - start).max() < 1e-12
    assert run.energy == pytest.approx(before, rel=1e-12)
    assert len(scene.bodies) == 6


@pytest.mark.parametrize("far", [0.0, 1e3])
def test_a_spinning_body_of_a_scene_keeps_its_motion(far):
    """To round-off also where a digit of its place [m] is 1e-13 of its size."""
    scene = Scene(dim=2, gravity=(0, 0))
    scene.add(
        Polygon(grain(4)), density=2000, angle=0.7, velocity=(1, 2), spin=3.0, position=(far, far)
    )
    world, motion = make_world(scene)
    broken = split_body(scene, motion, 0, motion.position[0], (1, 0.3))
    parts, state = make_world(broken)
    assert parts.energy(state) == pytest.approx(world.energy(motion), rel=1e-14)
    assert parts.mass.sum() == pytest.approx(world.mass.sum(), rel=1e-14)
    momentum = (parts.mass[:, None] * state.velocity).sum(axis=0)
    assert momentum == pytest.approx(world.mass[0] * motion.velocity[0], rel=1e-14)


def test_a_spinning_polyhedron_of_a_scene_keeps_its_motion():
    from rigid_lcp.shapes.polyhedron import box

    scene = Scene(dim=3, gravity=(0, 0, 0))
    turned = np.array([0.9, 0.1, 0.3, 0.3])
    scene.add(box(1, 0.7, 0.5), density=2000, angle=turned, velocity=(1, 2, 0), spin=(1, 3, 2))
    world, motion = make_world(scene)
    broken = split_body(scene, motion, 0, motion.position[0] + 0.05, (1, 0.3, 0.2))
    parts, state = make_world(broken)
    assert parts.energy(state) == pytest.approx(world.energy(motion), rel=1e-12)
    assert parts.mass.sum() == pytest.approx(world.mass.sum(), rel=1e-12)


def test_a_plane_that_leaves_no_sound_parts_is_refused():
    """2e-6 of the way below corners of a flat stone: parts without edges that could be kept apart.
    Once a run that broke worn stones ended there with a word about corners to be merged."""
    from rigid_lcp.contact.detection_space import shapes_3d
    from rigid_lcp.shapes.polyhedron import Polyhedron

    flat = Polyhedron(np.random.default_rng(2).normal(size=(8, 3)) * [1.0, 1.0, 0.02])
    scene = Scene(dim=3)
    scene.add(flat, density=2700, position=(0, 0, 0))
    _, motion = make_world(scene)
    with pytest.raises(ShapeError, match=r"kept apart\n.*move the plane"):
        split_body(scene, motion, 0, (1 - 2e-6) * flat.vertices[1], flat.vertices[1])
    made = split_body(scene, motion, 0, 0.99 * flat.vertices[1], flat.vertices[1])
    shapes_3d([each.shape for each in made.bodies], np.ones(2, dtype=bool))


def test_bodies_that_can_not_break():
    scene = pile()
    scene.add(Disc(0.2), density=2700, position=(5, 0.2))
    _, motion = make_world(scene)
    for body in (0, 5):
        with pytest.raises(ShapeError, match="can be split"):
            split_body(scene, motion, body, (0, 0), (1, 0))
