"""Corners on corners and on edges in space: contacts of solids that are apart, in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from rigid_lcp import Polyhedron, Scene, Simulation
from rigid_lcp.motion.equations import find_inertial_acceleration, find_relative_velocity
from rigid_lcp.motion.state import Motion, displace_motion
from rigid_lcp.shapes.rotations import (
    Floats,
    make_quaternion,
    multiply_quaternions,
    normalise,
    rotate,
)
from tests.rigid_solids import CUBE, coal_distance, contacts
from tests.verification.test_rigid_hard_geometry_3d import FAMILIES, Pair, family, placed_corners

FORMS = ["corner on corner", "corner on edge", "edge under corner"]


def nearest_corners(name: str, seed: int, form: str, gap: float) -> tuple[Pair, Floats]:
    """Two solids ``gap`` [m] apart at a corner and a corner, or a corner and an edge of the first
    or of the second; shapes, positions, turns, no axes; the normal from the first to the second.

    The corner (the edge's point) is the first's farthest along the normal, that of the second the
    farthest against it: so ``gap`` is their distance whatever else the solids look like.
    """
    generator = np.random.default_rng(seed)
    shapes = family(name, generator)
    turns = normalise(generator.normal(size=(2, 4)))
    if form == "edge under corner":
        (pair, normal) = nearest_corners(name, seed, "corner on edge", gap)
        shapes, position, turns, axes = pair
        return (shapes[::-1], position[::-1], turns[::-1], axes), -normal
    if form == "corner on corner":
        normal = generator.normal(size=3)
        normal /= np.linalg.norm(normal)
        there = rotate(turns[0], shapes[0].vertices)
        foot = there[np.argmax(there @ normal)]
    else:
        edge = shapes[0].edges[generator.integers(len(shapes[0].edges))]
        faces = rotate(turns[0], shapes[0].normals[edge[2:]])
        normal = generator.uniform(0.2, 0.8) * (faces[0] - faces[1]) + faces[1]
        normal /= np.linalg.norm(normal)
        ends = rotate(turns[0], shapes[0].vertices[edge[:2]])
        foot = ends[0] + generator.uniform(0.2, 0.8) * (ends[1] - ends[0])
    other = rotate(turns[1], shapes[1].vertices)
    tip = other[np.argmin(other @ normal)]
    position = np.array([np.zeros(3), foot - tip + gap * normal])
    return (shapes, position, turns, np.zeros((0, 3))), normal


@settings(max_examples=60)
@given(
    st.sampled_from(FAMILIES), st.integers(0, 10_000), st.sampled_from(FORMS),
    st.sampled_from([1e-6, 1e-3, 0.3]),
)  # fmt: skip
@example("needles", 3, "corner on edge", 1e-6)
@pytest.mark.long
def test_gap_and_normal_are_those_of_the_nearest_points(name, seed, form, share):
    """Gap = |x_a - x_b|, n along it (eq. 8 with radii zero), and no contact is nearer."""
    gap = share * min(shape.reach for shape in family(name, np.random.default_rng(seed)))
    (shapes, position, turns, _), normal = nearest_corners(name, seed, form, gap)
    found = contacts(shapes, position, turns, margin=gap)
    least = int(np.argmin(found.gap))
    size = max(shape.reach for shape in shapes)
    assert found.gap[least] == pytest.approx(gap, abs=2e-9 * size)
    away = 1.0 if found.body_a[least] == 1 else -1.0
    # features whose gaps differ by less than 1e-9 of the size are one: cos(angle) = 1 - 1e-9 s / g
    assert away * found.normal[least] @ normal > 1 - 1e-9 * size / gap - 1e-12


@pytest.mark.parametrize("form", FORMS)
def test_corners_carry_radii_zero_and_names_last(form: str) -> None:
    (shapes, position, turns, _), _ = nearest_corners("stones", 5, form, 1e-3)
    found = contacts(shapes, position, turns)
    assert len(found) == 1
    assert found.radius_a[0] == found.radius_b[0] == 0.0
    assert found.edge_b.any() == (form != "corner on corner")
    later = contacts(shapes, position + 1e-6, turns)
    assert later.key.tolist() == found.key.tolist()
    names = {int(contacts(*nearest_corners("stones", 5, one, 1e-3)[0][:3]).key[0]) for one in FORMS}
    assert len(names) == 3


@pytest.mark.long
@settings(max_examples=30)
@given(st.integers(0, 10_000), st.sampled_from(FORMS))
def test_rates_are_the_derivatives_of_the_gap(seed: int, form: str) -> None:
    """Eqs 13, 14 and 24: ``dg/dt`` and ``d2g/dt2`` of bodies with constant velocity and spin."""
    (shapes, position, turns, _), _ = nearest_corners("stones", seed, form, 0.05)
    rates = np.random.default_rng(seed).normal(size=(2, 6))
    motion = Motion(position, turns, rates[:, :3], rates[:, 3:])
    h, gaps, keys = 1e-4, [], []
    for t in (-h, 0.0, h):
        there = displace_motion(motion, t * rates)
        found = contacts(shapes, there.position, there.angle, margin=0.05)
        gaps.append(float(found.gap.min()))
        keys.append(int(found.key[np.argmin(found.gap)]))
    if len(set(keys)) > 1:
        return
    found = contacts(shapes, position, turns, margin=0.05)
    least = int(np.argmin(found.gap))
    # truncation h^2 times g''' = v^3 / g^2 = 1e4 here, and h^2 g'''' = v^4 / g^3 = 1e6
    rate = find_relative_velocity(found, motion)[least, 0]
    assert (gaps[2] - gaps[0]) / (2 * h) == pytest.approx(rate, abs=1e-3)
    second = (gaps[0] - 2 * gaps[1] + gaps[2]) / h**2
    exact = find_inertial_acceleration(found, motion)[least, 0]
    assert second == pytest.approx(exact, abs=2e-2, rel=1e-3)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("seed", range(6))
def test_at_touch_a_plane_parts_the_bodies(form: str, seed: int) -> None:
    """Points upon each other have no line between them: the normal still parts the bodies."""
    (shapes, position, turns, _), _ = nearest_corners("stones", seed, form, 0.0)
    found = contacts(shapes, position, turns)
    least = int(np.argmin(np.abs(found.gap)))
    assert found.gap[least] == pytest.approx(0.0, abs=1e-12)
    normal = found.normal[least] * (1.0 if found.body_a[least] == 1 else -1.0)
    first, second = placed_corners(shapes, position, turns)
    assert (second @ normal).min() - (first @ normal).max() > -1e-9


@settings(max_examples=30)
@given(st.sampled_from(["stones", "tetrahedra", "boxes"]), st.integers(0, 10_000))
@pytest.mark.long
def test_the_least_gap_is_continuous(name: str, seed: int) -> None:
    """Moved by s, two bodies change their distance, or depth, by at most s: on a straight way past
    a corner, into touch and out again, over faces, edges and corners."""
    (shapes, position, turns, _), normal = nearest_corners(name, seed, "corner on corner", 0.0)
    side = np.cross(normal, np.random.default_rng(seed).normal(size=3))
    gaps, step = [], 2e-4
    for along in np.arange(-0.01, 0.01, step):
        place = position + np.array([[0.0, 0, 0], along * side + 1e-3 * normal])
        gaps.append(float(contacts(shapes, place, turns, margin=0.05).gap.min()))
    assert np.isfinite(gaps).all()
    assert np.abs(np.diff(gaps)).max() <= step * np.linalg.norm(side) + 1e-8


@pytest.mark.parametrize("gap", [1e-12, 1e-6, 1e-3])
@pytest.mark.parametrize("shift", [0.0, 0.3])
def test_parallel_ridges_have_a_contact_at_either_end(gap: float, shift: float) -> None:
    """Roofs ridge along ridge, apart: contacts at the ends of what the ridges share."""
    turn = make_quaternion([np.pi / 4, 0.0, 0.0])
    found = contacts([CUBE, CUBE], [[0, 0, 0], [shift, 0, 2**0.5 + gap]], [turn, turn])
    assert len(found) == 2
    assert np.ptp(found.point[:, 0]) == pytest.approx(1 - shift)
    assert np.allclose(found.gap, gap, atol=2e-9)
    if gap > 1e-9:
        assert np.allclose(np.abs(found.normal), [0, 0, 1], atol=1e-9 / gap)


@pytest.mark.parametrize("margins", [[2e-2, 0.0], [0.0, 2e-2], [1e-2, 1e-2]])
def test_edges_are_found_whoever_has_the_margin(margins: list[float]) -> None:
    """A body that falls has all of the margin, one that stands none: crossing edges 1e-2 apart."""
    lower = make_quaternion([np.pi / 4, 0.0, 0.0])
    turned = make_quaternion([0.0, 0.0, 1.5])
    upper = multiply_quaternions(turned[None], lower[None])[0]
    place = [[0, 0, 0], [0.1, 0.05, 2**0.5 + 1e-2]]
    found = contacts([CUBE, CUBE], place, [lower, upper], np.array(margins))
    assert found.gap == pytest.approx([1e-2])


@settings(max_examples=40)
@given(
    st.sampled_from(FAMILIES), st.integers(0, 10_000), st.sampled_from(FORMS),
    st.sampled_from([1e-3, 0.3]),
)  # fmt: skip
@pytest.mark.long
@pytest.mark.peer("coal")
def test_gap_and_normal_are_those_of_coal(name: str, seed: int, form: str, share: float) -> None:
    gap = share * min(shape.reach for shape in family(name, np.random.default_rng(seed)))
    (shapes, position, turns, _), _ = nearest_corners(name, seed, form, gap)
    result = coal_distance(shapes, position, turns)
    found = contacts(shapes, position, turns, margin=gap)
    least = int(np.argmin(found.gap))
    assert found.gap[least] == pytest.approx(result.min_distance, abs=2e-6)  # GJK's tolerance
    if result.min_distance < 1e-4:
        return
    away = np.asarray(result.getNearestPoint2()) - np.asarray(result.getNearestPoint1())
    side = 1.0 if found.body_a[least] == 1 else -1.0
    cosine = side * found.normal[least] @ away / np.linalg.norm(away)
    # a gap good to 2e-6 of the distance d bends the line between the points by sqrt(4e-6 / d)
    assert cosine > 1 - 4e-6 / result.min_distance - 1e-9


# --- motion ---


def thrown(seed: int, form: str, gap: float, speed: float) -> Scene:
    """The second of two stones flies straight at the first, its corner at a corner or an edge."""
    (shapes, position, turns, _), normal = nearest_corners("stones", seed, form, gap)
    scene = Scene(dim=3, gravity=[0.0, 0.0, 0.0])
    for shape, x, turn, velocity in zip(
        shapes, position, turns, (0 * normal, -speed * normal), strict=True
    ):
        scene.add(shape, density=2700.0, position=x, angle=turn, velocity=velocity, friction=0.5)
    return scene


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("seed", range(4))
def test_a_step_stops_a_corner_before_it_gets_in(form: str, seed: int) -> None:
    """A corner 6 mm away at 1 m/s, a step of 8 ms: at its end they touch, and nothing had to be
    moved apart but what the turning after the impact brings in, (w h)^2 of the size."""
    h = 8e-3
    run = Simulation(thrown(seed, form, 6e-3, 1.0), step=h)
    place, velocity = run.positions.copy(), run.velocities.copy()
    run.advance(h)
    assert (run.contacts.normal_force > 0).any()
    moved = run.positions - place - 0.5 * h * (velocity + run.velocities)
    assert np.abs(moved).max() < 0.5 * (h * np.abs(run.spins).max()) ** 2 + 1e-9


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.long
def test_stones_that_meet_at_corners_never_overlap(form: str) -> None:
    """At the end of every step overlaps stay below 1e-9 of a stone, and no energy is made."""
    for seed in range(4):
        run = Simulation(thrown(seed, form, 5e-3, 1.0), step=2e-3, tolerance=1e-10)
        before = run.energy
        for _ in range(25):
            run.advance(2e-3)
            assert run.overlap < 1e-9
            assert run.energy <= before * (1 + 1e-12)
            before = run.energy
        assert np.linalg.norm(run.velocities[0]) > 0.05


@pytest.mark.long
def test_a_cube_on_its_corner_upon_another_s_comes_down() -> None:
    """A cube stands on its tip on the tip of a fixed one, a hair to the side: it falls off, and
    never into it."""
    up = np.array([1.0, 1.0, 1.0]) / 3**0.5
    axis = np.cross(up, [0.0, 0.0, 1.0])
    sine = np.linalg.norm(axis)
    tip = make_quaternion(axis / sine * np.arctan2(sine, up[2]))
    scene = Scene(dim=3)
    cube = Polyhedron(0.1 * CUBE.vertices)
    high = 0.1 * 3**0.5
    scene.add(cube, fixed=True, position=[0, 0, 0], angle=tip, friction=0.3)
    scene.add(
        cube, density=2700.0, position=[1e-3, 0, high + 5e-3], angle=tip, friction=0.3
    )  # fmt: skip
    run = Simulation(scene, step=4e-3, tolerance=1e-9)
    start = run.energy
    for _ in range(100):
        run.advance(4e-3)
        assert run.overlap < 1e-10
    assert run.energy < start
    assert run.positions[1, 2] < 0.9 * high
