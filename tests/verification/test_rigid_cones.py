"""Projection on Coulomb's cones and the natural map, against their definitions."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigid_lcp.arrays import Floats
from rigid_lcp.friction.problem.cones import find_natural_map, find_natural_residual
from rigid_lcp.friction.problem.definition import make_problem

ROUND_OFF = 1e-12
"""Ten times 2e-16 (mu + 1) (push + rho speed) / push at the ends of the ranges below."""
NUMBER = st.floats(-1e3, 1e3, allow_nan=False).map(lambda x: 0.0 if abs(x) < 1e-9 else x)
FRICTION = st.one_of(st.sampled_from([0.0, 1.0, 1e6]), st.floats(0, 2))


def projected(points: Floats, mu: Floats) -> Floats:
    """``P_K(r) = r - F(r)``: at rest the natural map F takes the nearest point of K away."""
    return points - find_natural_map(points, np.zeros_like(points), mu, 1.0)


@given(NUMBER, NUMBER, NUMBER, FRICTION)
def test_projection_is_the_nearest_point(n: float, s: float, t: float, mu: float) -> None:
    """Moreau: ``x = P_K(x) + P_K°(x)``, the two orthogonal, the second in the polar cone -K*."""
    point = np.array([[n, s, t]])
    nearest = projected(point, np.array([mu]))[0]
    rest = point[0] - nearest
    size = 1e-9 * (1 + np.abs(point).max()) * (1 + mu)
    assert nearest[0] >= 0
    assert np.hypot(*nearest[1:]) <= mu * nearest[0] + size
    assert abs(nearest @ rest) <= size * (1 + np.abs(point).max())
    assert -rest[0] >= mu * np.hypot(*rest[1:]) - size


@pytest.mark.parametrize("mu", [0.0, 0.5])
def test_a_contact_that_parts_needs_no_force(mu: float) -> None:
    """``u_N >= 0``, r = 0: the natural map is zero, with mu = 0 as well."""
    force, velocity = np.zeros((1, 2)), np.array([[0.09, 0.0]])
    assert find_natural_residual(force, velocity, np.array([mu]), 1.0) == 0.0


@given(st.floats(0.01, 10), st.floats(0, 2), st.floats(0.01, 5), st.floats(0, 6.28), NUMBER)
def test_coulombs_three_cases_have_no_residual(push, mu, speed, angle, share):
    """Open, stick and slide as eq. 27 has them are zeros of the map; the wrong sign is none."""
    along = np.array([np.cos(angle), np.sin(angle)])
    share = abs(share) / 1e3

    def residual(force: list[float], velocity: list[float]) -> float:
        return find_natural_residual(np.array([force]), np.array([velocity]), np.array([mu]), 1.0)

    assert residual([0, 0, 0], [speed, *(speed * along)]) == 0.0
    assert residual([push, *(share * mu * push * along)], [0, 0, 0]) <= ROUND_OFF
    assert residual([push, *(-mu * push * along)], [0, *(speed * along)]) <= ROUND_OFF
    if mu > 0.01:
        assert residual([push, *(mu * push * along)], [0, *(speed * along)]) > 1e-4


@given(st.floats(1e-6, 1e6), st.floats(1e-6, 1e6))
def test_the_residual_has_no_units(mass: float, length: float) -> None:
    """Scaling forces and velocities changes it by round-off only."""
    rng = np.random.default_rng(1)
    force, velocity = rng.normal(size=(2, 5, 3))
    mu = rng.uniform(0, 1, 5)
    once = find_natural_residual(force, velocity, mu, 0.7)
    scaled = find_natural_residual(force * mass, velocity * length, mu, 0.7 * mass / length)
    assert scaled == pytest.approx(once, rel=1e-12)


def twin(points: Floats, mu: Floats) -> Floats:
    """The projection in plain NumPy."""
    n, t = points[:, 0], np.linalg.norm(points[:, 1:], axis=1)
    nearest = np.maximum((n + mu * t) / (1 + mu**2), 0)
    inside = (t <= mu * n) & (n >= 0)
    normal = np.where(inside, n, nearest)
    allowed = np.where(inside, t, mu * nearest)
    direction = points[:, 1:] / np.where(t > 0, t, 1)[:, None]
    return np.column_stack([normal, allowed[:, None] * direction])


@pytest.mark.parametrize("greatest", [0.0, 0.3, 1.0, 10.0])
@pytest.mark.parametrize("dim", [2, 3])
def test_the_natural_map_is_its_definition(greatest: float, dim: int) -> None:
    """``r - P_K(r - rho (u + mu |u_T| n))``; terms of ``mu`` cancel to round-off of the largest."""
    rng = np.random.default_rng(4)
    force, velocity = rng.normal(size=(2, 500, dim))
    force[:50], velocity[40:90] = 0.0, 0.0
    mu = greatest * rng.uniform(0.0, 1.0, 500)
    dual = velocity.copy()
    dual[:, 0] += mu * np.linalg.norm(velocity[:, 1:], axis=1)
    found = find_natural_map(force, velocity, mu, 0.7)
    definition = force - twin(force - 0.7 * dual, mu)
    np.testing.assert_allclose(found, definition, atol=1e-14 * (1 + greatest))


@pytest.mark.parametrize("unit", [1.0, 2.0**-40, 2.0**40])
def test_the_scale_of_a_contact_is_the_force_that_stops_it_alone(unit: float) -> None:
    """Bodies that share no contact, ``W_cc = w I``: ``r_N = -rho u_N`` brings each to rest,
    whatever the others weigh, and in other units of mass the force is as many times as great."""
    inverse_mass = unit * np.array([0.5, 4.0, 1e3])
    approach = np.array([-1.0, -2.0, -0.3])
    q = np.zeros(6)
    q[::2] = approach
    problem = make_problem(np.diag(np.repeat(inverse_mass, 2)), q, 0.5, 2)
    stopping = -problem.contact_rho * approach
    np.testing.assert_allclose(stopping, -approach / inverse_mass, rtol=1e-15)
    force = np.zeros(6)
    force[::2] = stopping
    assert problem.residual(force) <= 1e-15
    assert problem.reduces_error(force, 0.0)
