"""Fragmentation: what a break must conserve, shapes it must refuse, and a pile that stays.

Reference: Schwager and Poeschel 2002, section 10 ("the system remains always stable").
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigid_lcp import Disc, HalfSpace, Polygon, Polyhedron, Scene, Simulation, make_box
from rigid_lcp.contact import pack_shapes_3d
from rigid_lcp.errors import ShapeError
from rigid_lcp.motion import make_world
from rigid_lcp.shapes import rotate, rotate_back
from rigid_lcp.wear.cuts import find_volume
from rigid_lcp.wear.fragmentation import split_body
from tests.rigid_solids import make_stone

SQUARE = Polygon([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


def grain(seed):
    """A convex polygon of 3 to 9 corners on an ellipse, turned."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 10))
    angle = 2 * np.pi * (np.arange(n) + rng.uniform(-0.3, 0.3, n)) / n
    flat = np.column_stack([np.cos(angle), rng.uniform(0.3, 1.0) * np.sin(angle)])
    a = rng.uniform(0, 2 * np.pi)
    return Polygon(flat @ np.array([[np.cos(a), np.sin(a)], [-np.sin(a), np.cos(a)]]))


def moments(scene):
    """Mass, first moment, momentum, angular momentum about the origin, energy of all bodies."""
    world, motion = make_world(scene)
    x, v = motion.position, motion.velocity
    mass = world.mass[:, None]
    if scene.dim == 2:
        own = (world.inertia * motion.spin)[:, None]
        turning = mass * (x[:, :1] * v[:, 1:] - x[:, 1:] * v[:, :1]) + own
    else:
        back = rotate_back(motion.angle, motion.spin)
        own = rotate(motion.angle, np.einsum("nij,nj->ni", world.inertia, back))
        turning = mass * np.cross(x, v) + own
    parts = [mass, mass * x, mass * v, turning]
    return np.concatenate([*(part.sum(axis=0) for part in parts), [world.energy(motion)]])


@pytest.mark.long
@settings(max_examples=60)
@given(seed=st.integers(0, 10**6), dim=st.sampled_from([2, 3]), far=st.sampled_from([0.0, 10.0]))
def test_a_break_conserves_everything(seed, dim, far):
    """The parts go on as parts of the rigid body: mass, momenta and energy to round-off; their
    corners stay where they were, those in the cut are in both, and neither approach nor part."""
    rng = np.random.default_rng(seed)
    shape = grain(seed) if dim == 2 else make_stone(rng, 1.0)
    scene = Scene(dim)
    place, velocity, direction = rng.normal(size=(3, dim))
    place = place + far
    angle, spin = rng.normal(size=(1, 4)[dim - 2]), rng.normal(size=(1, 3)[dim - 2])
    scene.add(shape, density=2700, position=place, angle=angle, velocity=velocity, spin=spin)
    _, motion = make_world(scene)
    point = place + 0.1 * shape.reach * rng.uniform(-1, 1, dim) / dim
    broken = split_body(scene, motion, 0, point, direction)
    before, after = moments(scene), moments(broken)
    assert after == pytest.approx(before, rel=1e-12, abs=1e-12 * np.abs(before).max())
    corners = [
        body.position + rotate(np.array(body.angle), body.shape.vertices) for body in broken.bodies
    ]
    for own in corners:
        back = rotate_back(broken.bodies[0].angle, own - motion.position[0])
        level = [shape.vertices[face[0]] @ n
                 for face, n in zip(shape.faces, shape.normals, strict=True)]  # fmt: skip
        assert (back @ shape.normals.T - level).max() < 1e-12 * (1 + far)
    apart = np.linalg.norm(corners[0][:, None] - corners[1][None], axis=2)
    shared = corners[0][apart.min(axis=1) < 1e-12 * (1 + far)]
    assert len(shared) == 2 if dim == 2 else len(shared) >= 3
    normal = direction if dim == 3 else np.array([-direction[1], direction[0]])
    normal /= np.linalg.norm(normal)
    _, motion = make_world(broken)
    arm = shared[:, None] - motion.position[None]
    spun = np.stack([-arm[..., 1], arm[..., 0]], axis=-1) * motion.spin[:, None] if dim == 2 else (
        np.cross(motion.spin, arm)
    )  # fmt: skip
    rates = (motion.velocity + spun) @ normal
    assert rates[:, 0] == pytest.approx(rates[:, 1], abs=1e-12 * (1 + far))
    sides = [(own - point) @ normal for own in corners]
    assert sides[0].min() > -1e-6 * shape.reach
    assert sides[1].max() < 1e-6 * shape.reach


def test_a_line_through_vertices():
    """The diagonal of a square, also where it misses the corners by round-off: two triangles."""
    scene = Scene(2)
    scene.add(SQUARE, density=1.0)
    _, motion = make_world(scene)
    for miss in (0.0, 1e-9):
        broken = split_body(scene, motion, 0, (miss, 0), (1, 1))
        assert [len(body.shape.vertices) for body in broken.bodies] == [3, 3]


def test_a_plane_through_corners_makes_no_slivers():
    """Through two edges of a cube: two prisms."""
    scene = Scene(3)
    scene.add(make_box(1.0, 1.0, 1.0), density=1.0)
    _, motion = make_world(scene)
    for offset in (0.0, 1e-9, -1e-8, 1e-7):
        broken = split_body(scene, motion, 0, (offset, 0, 0), (1.0, 1.0, 0.0))
        parts = [body.shape for body in broken.bodies]
        assert [len(part.faces) for part in parts] == [5, 5]
        assert parts[0].volume + parts[1].volume == pytest.approx(1.0, rel=1e-14)


@pytest.mark.long
def test_a_stone_can_be_cut_again_and_again():
    generator = np.random.default_rng(4)
    scene = Scene(3)
    scene.add(make_stone(generator, 0.05), density=1.0)
    whole = find_volume(scene.bodies[0].shape)
    for _ in range(6):
        for body in range(len(scene.bodies)):
            _, motion = make_world(scene)
            at = motion.position[body]
            scene = split_body(scene, motion, body, at, generator.normal(size=3))
    pieces = [body.shape for body in scene.bodies]
    assert len(pieces) == 64
    assert sum(piece.volume for piece in pieces) == pytest.approx(whole, rel=1e-12)
    assert all(len(p.vertices) - len(p.edges) + len(p.faces) == 2 for p in pieces)


@pytest.mark.parametrize(
    ("dim", "point", "direction", "words"),
    [
        (2, (0.5, 2.0), (1, 0), "misses"),
        (2, (0.5, 1.0), (1, 0), "misses"),
        (2, (0.5, 1 - 1e-5), (1, 0), "sliver"),
        (2, (0.5, 0.5), (0, 0), "zero"),
        (3, (0.4999999, 0.0, 0.0), (1, 0, 0), "misses"),
        (3, (0.0, 0.0, 0.0), (0, 0, 0), "zero"),
    ],
)
def test_what_can_not_be_split(dim, point, direction, words):
    scene = Scene(dim)
    scene.add(SQUARE if dim == 2 else make_box(1, 1, 1), density=1.0, name="a")
    _, motion = make_world(scene)
    with pytest.raises(ShapeError, match=f"^a: .*{words}"):
        split_body(scene, motion, 0, point, direction)


def pile():
    """Two blocks side by side on the ground, one across both, one on top of it."""
    scene = Scene(dim=2)
    scene.add(HalfSpace((0, 1)), friction=0.6)
    block = Polygon.rectangle(1.0, 0.6)
    for x, y in ((0.0, 0.3), (1.2, 0.3), (0.6, 0.9), (0.6, 1.5)):
        scene.add(block, density=2700, position=(x, y), friction=0.6)
    return scene


@pytest.mark.long
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


def test_a_plane_that_leaves_no_sound_parts_is_refused():
    """2e-6 of the way below corners of a flat stone: parts without edges that could be kept apart.
    Once a run that broke worn stones ended there with a word about corners to be merged."""
    flat = Polyhedron(np.random.default_rng(2).normal(size=(8, 3)) * [1.0, 1.0, 0.02])
    scene = Scene(dim=3)
    scene.add(flat, density=2700, position=(0, 0, 0))
    _, motion = make_world(scene)
    with pytest.raises(ShapeError, match=r"kept apart\n.*move the plane"):
        split_body(scene, motion, 0, (1 - 2e-6) * flat.vertices[1], flat.vertices[1])
    made = split_body(scene, motion, 0, 0.99 * flat.vertices[1], flat.vertices[1])
    pack_shapes_3d([each.shape for each in made.bodies], np.ones(2, dtype=bool))


def test_bodies_that_can_not_break():
    scene = pile()
    scene.add(Disc(0.2), density=2700, position=(5, 0.2))
    _, motion = make_world(scene)
    for body in (0, 5):
        with pytest.raises(ShapeError, match="can be split"):
            split_body(scene, motion, body, (0, 0), (1, 0))
