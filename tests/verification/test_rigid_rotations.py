"""Rotations and free motion: group laws, SciPy's rotations, Euler's equations by an ODE solver."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from rigid_lcp.errors import SceneError
from rigid_lcp.motion.gyroscopic import (
    Floats,
    find_principal_axes,
    find_spin_acceleration,
    rotate_freely,
    turn_inertia,
)
from rigid_lcp.motion.state import Motion, displace_motion
from rigid_lcp.shapes.polyhedron import make_box
from rigid_lcp.shapes.rotations import (
    extract_quaternion,
    find_quaternion_rate,
    make_quaternion,
    make_rotation,
    multiply_quaternions,
    normalise,
    rotate,
    rotate_back,
)
from tests.rigid_solids import angular_momentum

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
ROUND_OFF = 1e-15
vectors = st.tuples(*[st.floats(-10.0, 10.0)] * 3).map(np.array)


def random_rotations(count: int, seed: int = 0) -> Floats:
    return normalise(np.random.default_rng(seed).normal(size=(count, 4)))


def turn_quaternion(quaternion: Floats, phi: Floats) -> Floats:
    """As a state is turned by a rotation vector."""
    here = Motion(np.zeros((1, 3)), quaternion[None], np.zeros((1, 3)), np.zeros((1, 3)))
    return displace_motion(here, np.concatenate([np.zeros(3), phi])[None]).angle[0]


def as_scipy(quaternion: Floats) -> Rotation:
    return Rotation.from_quat(np.roll(quaternion, -1, axis=-1))  # SciPy's order is x, y, z, w


# --- algebra ---


def test_matrix_and_product_agree_with_scipy() -> None:
    left, right = random_rotations(50), random_rotations(50, 1)
    assert np.allclose(make_rotation(left), as_scipy(left).as_matrix(), atol=4 * ROUND_OFF)
    both = as_scipy(left) * as_scipy(right)
    found = make_rotation(multiply_quaternions(left, right))
    assert np.allclose(found, both.as_matrix(), atol=8 * ROUND_OFF)


@settings(max_examples=50)
@given(vectors)
def test_turn_by_rotation_vector_agrees_with_scipy(phi):
    found = make_rotation(make_quaternion(phi))
    assert np.allclose(found, Rotation.from_rotvec(phi).as_matrix(), atol=4e-14)


@pytest.mark.parametrize("angle", [0.0, 1e-300, 1e-12, 1.0, np.pi, np.pi + 1e-9, 6.0])
def test_matrix_to_quaternion_and_back(angle: float) -> None:
    axes = np.random.default_rng(2).normal(size=(30, 3))
    axes = np.vstack([axes / np.linalg.norm(axes, axis=1)[:, None], np.eye(3)])
    matrix = make_rotation(make_quaternion(angle * axes))
    assert np.allclose(make_rotation(extract_quaternion(matrix)), matrix, atol=4 * ROUND_OFF)


def test_rotate_and_back_keep_length() -> None:
    q, v = random_rotations(20), np.random.default_rng(3).normal(size=(20, 3))
    turned = rotate(q, v)
    assert np.allclose(rotate_back(q, turned), v, atol=8 * ROUND_OFF)
    assert np.allclose(np.linalg.norm(turned, axis=1), np.linalg.norm(v, axis=1), rtol=1e-14)


def test_constant_spin_is_integrated_exactly() -> None:
    """Many steps and one step of a constant spin end in the same place (exp is a group)."""
    spin = np.array([3.0, -2.0, 5.0])
    q = IDENTITY
    for _ in range(1000):
        q = turn_quaternion(q, 1e-3 * spin)
    # each of 1000 products may lose 2 ulp, at random
    assert np.abs(q - turn_quaternion(IDENTITY, spin)).max() < 1000**0.5 * 10 * ROUND_OFF


def test_rate_is_the_derivative_of_the_turn() -> None:
    q, spin, h = random_rotations(1)[0], np.array([1.0, 2.0, -0.5]), 1e-6
    ahead, behind = turn_quaternion(q, h * spin), turn_quaternion(q, -h * spin)
    # central difference: h^2 |w|^3 / 24 = 2e-12 of truncation, 1e-16 / h = 1e-10 of round-off
    assert np.allclose((ahead - behind) / (2 * h), find_quaternion_rate(q, spin), atol=5e-10)


@pytest.mark.parametrize("bad", [[0, 0, 0, 0], [1, np.nan, 0, 0], [1, 0, 0]])
def test_no_rotation_is_refused(bad: list[float]) -> None:
    with pytest.raises(SceneError, match="quaternion"):
        normalise(bad)


# --- free bodies ---

INERTIA = np.array([[2.0, 0.3, -0.1], [0.3, 3.0, 0.2], [-0.1, 0.2, 4.0]])


def euler_by_ode(inertia: Floats, q: Floats, spin: Floats, seconds: float) -> tuple[Floats, Floats]:
    """Euler's equations in the world frame by an eighth-order solver at 1e-13."""

    def rates(_: float, state: Floats) -> Floats:
        turn, w = state[:4] / np.linalg.norm(state[:4]), state[4:]
        return np.concatenate(
            [find_quaternion_rate(turn, w), find_spin_acceleration(inertia, turn, w)]
        )

    end = solve_ivp(
        rates, (0, seconds), np.concatenate([q, spin]), method="DOP853", rtol=1e-13, atol=1e-13
    ).y[:, -1]
    return normalise(end[:4]), end[4:]


def march(inertia: Floats, q: Floats, spin: Floats, h: float, steps: int) -> tuple[Floats, Floats]:
    principal = find_principal_axes(inertia)
    for _ in range(steps):
        q, spin = rotate_freely(principal, q, spin, h)
    return q, spin


def energy_of(inertia: Floats, q: Floats, spin: Floats) -> float:
    return float(0.5 * spin @ angular_momentum(inertia, q, spin))


def test_free_rotation_is_of_second_order() -> None:
    q, spin = random_rotations(1)[0], np.array([1.0, 2.0, -1.5])
    exact, exact_spin = euler_by_ode(INERTIA, q, spin, 2.0)
    errors = []
    for steps in (50, 100, 200):
        found, found_spin = march(INERTIA, q, spin, 2.0 / steps, steps)
        errors.append(
            np.linalg.norm(make_rotation(found) - make_rotation(exact))
            + np.linalg.norm(found_spin - exact_spin)
        )
    order = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(np.abs(order - 2) < 0.05)


@pytest.mark.parametrize("axis", [None, 0, 1, 2])
@pytest.mark.long
def test_free_rotation_keeps_momentum_and_energy(axis: int | None) -> None:
    """Both to round-off of every step, at any spin and next to a principal axis."""
    q, spin = random_rotations(1)[0], np.array([1.0, 2.0, -1.5])
    principal = find_principal_axes(INERTIA)
    if axis is not None:
        spin = rotate(multiply_quaternions(q, principal[1]), 3.0 * np.eye(3)[axis] + 1e-9)
    momentum = angular_momentum(INERTIA, q, spin)
    energy, lost = energy_of(INERTIA, q, spin), 0.0
    for _ in range(1000):
        q, spin = rotate_freely(principal, q, spin, 0.05)
        lost = max(lost, float(np.abs(angular_momentum(INERTIA, q, spin) - momentum).max()))
    # a few roundings of |L| = 10 in each step, which need not cancel
    assert lost < 1000 * 10 * 2 * ROUND_OFF
    assert energy_of(INERTIA, q, spin) == pytest.approx(energy, rel=1000 * 4 * ROUND_OFF)


@pytest.mark.parametrize("speed", [0.0, 1e-170, 1e-14, 1e-10])
def test_free_rotation_leaves_a_body_at_rest_alone(speed: float) -> None:
    """A body turns by what its spin says: round-off of the energy has no direction of its own."""
    q, h = random_rotations(1)[0], 1e-3
    for way in np.random.default_rng(2).normal(size=(20, 3)):
        turned, spin = rotate_freely(find_principal_axes(INERTIA), q, speed * way, h)
        assert np.abs(turned - q).max() < 2 * speed * np.linalg.norm(way) * h + 4 * ROUND_OFF
        assert np.allclose(spin, speed * way, rtol=1e-9, atol=0)


@pytest.mark.parametrize("moments", [[2.0, 2.0, 2.0], [1.0, 1.0, 1.9], [0.2, 2.0, 2.0]])
def test_bodies_with_equal_moments_move_exactly(moments: list[float]) -> None:
    """Precession about L at |L| / I_1 and spin about the axis, in closed form by the ODE solver."""
    q, spin = random_rotations(1)[0], np.array([1.0, 2.0, -1.5])
    inertia = np.diag(moments)
    exact, exact_spin = euler_by_ode(inertia, q, spin, 3.0)
    found, found_spin = march(inertia, q, spin, 3.0, 1)
    # the ODE solver's tolerance 1e-13 over a few radians
    assert np.allclose(make_rotation(found), make_rotation(exact), atol=2e-11)
    assert np.allclose(found_spin, exact_spin, atol=2e-11)


@pytest.mark.long
def test_intermediate_axis_flips_when_the_ode_says_so() -> None:
    """A box thrown about its middle axis turns over (Dzhanibekov); time of the flip and path."""
    inertia = make_box(1.0, 2.0, 3.0).mass_properties(1.0)[1]
    spin = np.array([1e-3, 5.0, 0.0])  # middle moment about y
    q, seconds = IDENTITY, 6.0
    exact, exact_spin = euler_by_ode(inertia, q, spin, seconds)
    assert rotate_back(exact, exact_spin)[1] < -4.0  # it has turned over
    errors = []
    for steps in (500, 1000):
        found_spin = march(inertia, q, spin, seconds / steps, steps)[1]
        errors.append(float(np.linalg.norm(found_spin - exact_spin)))
    assert errors[1] < 1e-5
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.1)


def test_stack_of_bodies_is_each_body() -> None:
    inertia = np.array([INERTIA, np.eye(3), np.diag([1.0, 2.0, 2.5])])
    q, spin = random_rotations(3), np.random.default_rng(5).normal(size=(3, 3))
    many = rotate_freely(find_principal_axes(inertia), q, spin, 0.1)
    for k in range(3):
        one = rotate_freely(find_principal_axes(inertia[k]), q[k], spin[k], 0.1)
        assert np.allclose(many[0][k], one[0], atol=4 * ROUND_OFF)
        assert np.allclose(many[1][k], one[1], atol=8 * ROUND_OFF)


def test_world_inertia_turns_with_the_body() -> None:
    q = random_rotations(1)[0]
    placed = turn_inertia(INERTIA, q)
    assert np.allclose(np.linalg.eigvalsh(placed), np.linalg.eigvalsh(INERTIA), atol=1e-14)
    axis = np.linalg.eigh(INERTIA)[1][:, 0]
    assert np.allclose(placed @ rotate(q, axis), np.linalg.eigvalsh(INERTIA)[0] * rotate(q, axis))
