"""The geometry equations in space against finite differences of the gap function."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from rigid_lcp import HalfSpace, Sphere
from rigid_lcp.arrays import Floats
from rigid_lcp.contact import detect_3d, pack_shapes_3d
from rigid_lcp.contact.arrays import Contacts, build_frames
from rigid_lcp.contact.placed_solids import Shapes3D
from rigid_lcp.motion.equations import find_inertial_acceleration, find_relative_velocity
from rigid_lcp.motion.state import Motion, displace_motion
from rigid_lcp.shapes.rotations import make_quaternion, multiply_quaternions, rotate
from tests.rigid_solids import CUBE, UPRIGHT, contacts, near_pair


def gaps_at(arrays: Shapes3D, motion: Motion, t: float) -> dict[int, float]:
    """The gap of every contact after a time, by its key."""
    there = displace_motion(motion, t * np.hstack([motion.velocity, motion.spin]))
    found = detect_3d(arrays, there.position, there.angle, 0.05)
    return dict(zip(found.key.tolist(), found.gap.tolist(), strict=True))


@pytest.mark.long
@settings(max_examples=40)
@given(st.integers(0, 10_000))
def test_gap_rate_is_the_derivative_of_the_gap(seed: int) -> None:
    """Eq. 13: ``dg/dt = n . (v_a - v_b)`` at the contact point, for every kind of contact."""
    shapes, position, quaternion = near_pair(seed)
    shapes = [*shapes, Sphere(0.5), HalfSpace([0.1, 0.2, 1.0], -0.8)]
    generator = np.random.default_rng(seed)
    place = np.vstack([position, [0.0, 0.0, 1.0], np.zeros(3)])
    turns = np.vstack([quaternion, UPRIGHT, UPRIGHT])
    rates = np.vstack([generator.normal(size=(3, 6)), np.zeros(6)])
    motion = Motion(place, turns, rates[:, :3], rates[:, 3:])
    arrays = pack_shapes_3d(shapes, np.array([True, True, True, False]))
    h = 1e-7
    found = detect_3d(arrays, place, turns, 0.05)
    assert len(found) > 0
    speed = find_relative_velocity(found, motion)[:, 0]
    ahead, behind = gaps_at(arrays, motion, h), gaps_at(arrays, motion, -h)
    checked = 0
    for key, rate in zip(found.key.tolist(), speed, strict=True):
        if key in ahead and key in behind:
            # round-off 1e-16 / h = 1e-9; truncation h^2 |w|^3 is far below
            assert (ahead[key] - behind[key]) / (2 * h) == pytest.approx(rate, abs=2e-8)
            checked += 1
    assert checked > 0


@pytest.mark.long
@settings(max_examples=40)
@given(st.integers(0, 10_000))
@example(750)  # a sphere whose centre is 0.025 from an edge
def test_inertial_terms_are_the_second_derivative_of_the_gap(seed: int) -> None:
    """Eqs 14 and 24 in space: ``d2g/dt2`` of bodies with constant velocity and spin.

    Corners on faces, crossing edges, spheres on faces, edges, corners, spheres and planes.
    """
    shapes, position, quaternion = near_pair(seed)
    generator = np.random.default_rng(seed)
    shapes = [*shapes, Sphere(0.3), Sphere(0.5), HalfSpace([0.1, 0.2, 1.0], -0.8)]
    top = rotate(quaternion[0], shapes[0].vertices)  # type: ignore[attr-defined]
    corner = top[generator.integers(len(top))]
    above = corner * (1 + 0.3 / np.linalg.norm(corner))
    place = np.vstack([position, above, above + np.array([0.0, 0.8, 0.0]), np.zeros(3)])
    turns = np.vstack([quaternion, np.tile(UPRIGHT, (3, 1))])
    rates = np.vstack([generator.normal(size=(4, 6)), np.zeros(6)])
    motion = Motion(place, turns, rates[:, :3], rates[:, 3:])
    arrays = pack_shapes_3d(shapes, np.array([True, True, True, True, False]))
    h = 1e-4
    found = detect_3d(arrays, place, turns, 0.05)
    exact = find_inertial_acceleration(found, motion)[:, 0]
    moved = [gaps_at(arrays, motion, t) for t in (-h, -h / 2, h / 2, h)]
    checked = 0
    for k, key in enumerate(found.key.tolist()):
        if not all(key in there for there in moved):
            continue
        before, little_before, little_ahead, ahead = (there[key] for there in moved)
        coarse = (ahead - 2 * found.gap[k] + before) / h**2
        fine = (little_ahead - 2 * found.gap[k] + little_before) / (h / 2) ** 2
        # Richardson: h^2 / 12 times the fourth derivative, v^4 / R^3 where a centre passes an edge
        # at R, is as much as 0.004; of what is left, h^4 v^6 / (480 R^5), and of round-off,
        # 5 x 4e-16 / (h / 2)^2 = 8e-7, less than 1e-5.
        assert (4 * fine - coarse) / 3 == pytest.approx(exact[k], abs=1e-5, rel=1e-5)
        checked += 1
    assert checked > 0


@settings(max_examples=20)
@given(st.integers(0, 10_000), st.sampled_from(["crossing", "sphere"]))
def test_inertial_terms_at_edges(seed: int, form: str) -> None:
    """Normals across edges turn with both bodies: a cube's edge over another's, or under a sphere.

    Without `rigid_lcp.motion.equations` a sphere that rolls along an edge would seem to lift off it
    with v^2 / R.
    """
    generator = np.random.default_rng(seed)
    lower = make_quaternion([np.pi / 4, 0.0, 0.0])
    if form == "crossing":
        shapes: list[object] = [CUBE, CUBE]
        upper = multiply_quaternions(
            make_quaternion([0.0, 0.0, generator.uniform(0.5, 2.5)])[None], lower[None]
        )[0]
        place = np.array([[0.0, 0, 0], [*generator.uniform(-0.2, 0.2, 2), 2**0.5 + 1e-3]])
    else:
        shapes, upper = [CUBE, Sphere(0.4)], UPRIGHT
        place = np.array([[0.0, 0, 0], [*generator.uniform(-0.1, 0.1, 2), 0.5**0.5 + 0.401]])
    turns = np.array([lower, upper])
    rates = generator.normal(size=(2, 6))
    motion = Motion(place, turns, rates[:, :3], rates[:, 3:])
    h = 1e-4
    found = contacts(shapes, place, turns, margin=0.1)
    assert len(found) == 1
    assert found.edge_b.any()
    gaps = []
    for t in (-h, 0.0, h):
        there = displace_motion(motion, t * rates)
        gaps.append(contacts(shapes, there.position, there.angle, margin=0.1).gap[0])
    second = (gaps[0] - 2 * gaps[1] + gaps[2]) / h**2
    exact = find_inertial_acceleration(found, motion)[0, 0]
    assert second == pytest.approx(exact, abs=1e-5, rel=1e-5)
    rate = find_relative_velocity(found, motion)[0, 0]
    assert (gaps[2] - gaps[0]) / (2 * h) == pytest.approx(rate, abs=1e-5)


ON_EDGE = make_quaternion([np.pi / 4, 0.0, 0.0])
TOUCHING = {  # shapes of a and b, how they are turned, where a is; b is at the origin
    "ball on face": (Sphere(0.4), CUBE, UPRIGHT, UPRIGHT, [0.1, -0.2, 0.9]),
    "ball on ball": (Sphere(0.4), Sphere(0.7), UPRIGHT, UPRIGHT, [0.3, -0.4, 1.0]),
    "ball on edge": (Sphere(0.4), CUBE, UPRIGHT, ON_EDGE, [0.1, 0.1, 1.1]),
    "ball on corner": (Sphere(0.4), CUBE, UPRIGHT, UPRIGHT, [0.7, 0.8, 0.75]),
    "ball on plane": (Sphere(0.4), HalfSpace([0.1, 0.2, 1.0]), UPRIGHT, UPRIGHT, [0.0, 0, 0.42]),
    "corner on face": (
        CUBE, CUBE, make_quaternion([0.7, 0.4, 0.0]), UPRIGHT, [0.1, -0.2, 1.32],
    ),
    "edge on edge": (
        CUBE, CUBE, multiply_quaternions(make_quaternion([0, 0, 1.1])[None], ON_EDGE[None])[0],
        ON_EDGE, [0.1, -0.2, 2**0.5],
    ),
}  # fmt: skip


@pytest.mark.parametrize("form", TOUCHING)
@pytest.mark.parametrize("seed", range(3))
def test_tangential_inertial_terms(form: str, seed: int) -> None:
    """b^T of eq. 24 in space: how the velocity at a contact that sticks or rolls changes by itself.

    The contact point of a ball goes on over both surfaces, which themselves turn: with spin about
    the normal, or on a turning face, the material that touches next has another velocity.
    """
    upper, lower, turn, under, start = TOUCHING[form]
    shapes, turns = [upper, lower], np.array([turn, under])
    place = np.array([start, [0.0, 0, 0]])
    found = contacts(shapes, place, turns, margin=1.0)
    first = int(np.argmin(found.gap))
    key, side = found.key[first], int(found.body_a[first] == 1)
    place[0] += (2 * side - 1) * found.gap[first] * found.normal[first]
    rates = np.random.default_rng(seed).normal(size=(2, 6))
    if isinstance(lower, HalfSpace):
        rates[1] = 0.0

    def velocity(t: float) -> tuple[Contacts, Floats]:
        there = displace_motion(Motion(place, turns, rates[:, :3], rates[:, 3:]), t * rates)
        found = contacts(shapes, there.position, there.angle, margin=1.0)
        found = found[found.key == key]
        along = find_relative_velocity(found, there)
        return found, np.einsum("ci,cij->j", along, build_frames(found.normal))

    rates[0, :3] += (2 * side - 1) * velocity(0.0)[1]  # no slip
    touch, slip = velocity(0.0)
    np.testing.assert_allclose(slip, 0, atol=1e-14)
    h = 1e-5
    change = (velocity(h)[1] - velocity(-h)[1]) / (2 * h)
    exact = find_inertial_acceleration(touch, Motion(place, turns, rates[:, :3], rates[:, 3:]))[0]
    # truncation h^2 / 6 times third derivatives of up to 1e3; round-off 1e-16 / h
    np.testing.assert_allclose(exact[1:], build_frames(touch.normal)[0, 1:] @ change, atol=1e-6)
