"""The smoothed path: its map against plain NumPy, its points, and beds that it solves."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pytest

from rigid_lcp.arrays import Floats
from rigid_lcp.friction.attempts.smoothed_path import (
    SMOOTHED,
    begin_path,
    choose_other_path,
    find_smoothed_map,
    find_smoothed_point,
    follow_smoothed,
)
from rigid_lcp.friction.linear.factorisation import choose_factorisation
from rigid_lcp.friction.methods.interior_point import Path, solve_interior_point
from rigid_lcp.friction.problem.definition import FrictionProblem, make_problem
from validation.bench.rigid.packings import build_packing, build_tower


def jordan_root(vector: Floats) -> Floats:
    """Square root in the Jordan algebra of the Lorentz cone, by eigenvalues ``v_0 +- |v_T|``."""
    across = np.linalg.norm(vector[1:])
    direction = vector[1:] / across if across > 0.0 else vector[1:]
    high, low = np.sqrt(vector[0] + across), np.sqrt(vector[0] - across)
    return np.concatenate([[0.5 * (high + low)], 0.5 * (high - low) * direction])


def jordan_square(vector: Floats) -> Floats:
    return np.concatenate([[vector @ vector], 2.0 * vector[0] * vector[1:]])


def scaled(
    force: Floats, velocity: Floats, mu: float, rho: float, eps: float
) -> tuple[Floats, Floats]:
    """x and s of one contact."""
    squares = velocity[1:] @ velocity[1:]
    x = np.concatenate([[mu * force[0]], force[1:]])
    normal = velocity[0] / mu + squares / np.sqrt(squares + eps**2)
    return x, rho * np.concatenate([[normal], velocity[1:]])


def plain_map(
    force: Floats, velocity: Floats, mu: Floats, rho: Floats, sigma: float, eps: float
) -> Floats:
    """The twin: F contact by contact."""
    found = np.zeros_like(force)
    for c in range(len(mu)):
        if mu[c] == 0.0:
            normal, speed = force[c, 0], rho[c] * velocity[c, 0]
            found[c] = force[c]
            found[c, 0] = normal + speed - np.sqrt((normal - speed) ** 2 + 4.0 * sigma)
            continue
        x, s = scaled(force[c], velocity[c], mu[c], rho[c], eps)
        inside = jordan_square(x - s)
        inside[0] += 4.0 * sigma
        found[c] = x + s - jordan_root(inside)
    return found


def hostile(dim: int, seed: int) -> tuple[Floats, Floats, Floats, Floats]:
    """Forces and velocities of 40 contacts, some without friction, some at rest, some loose."""
    generator = np.random.default_rng(seed)
    force, velocity = generator.standard_normal((2, 40, dim))
    force[:4, 1:] = velocity[:4, 1:] = 0.0
    force[4], velocity[5] = 0.0, 0.0
    mu = generator.uniform(0.01, 3.0, 40)
    mu[::7] = 0.0
    return force, velocity, mu, generator.uniform(0.1, 10.0, 40)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("sigma", [1.0, 1e-6])
def test_the_map_is_its_numpy_twin_and_its_derivatives_are_differences(dim, sigma):
    force, velocity, mu, rho = hostile(dim, 3)
    law = mu, rho, sigma, 0.3
    found, by_force, by_velocity = find_smoothed_map(force, velocity, *law)
    plain = plain_map(force, velocity, *law)
    assert np.abs(found - plain).max() < 1e-12 * np.abs(plain).max()
    step = 1e-6  # central differences: error step^2 / sigma^(1/2)^2 of curvature, and 1e-16 / step
    for k in range(dim):
        ahead = np.zeros_like(force)
        ahead[:, k] = step
        across = [plain_map(force + sign * ahead, velocity, *law) for sign in (1, -1)]
        assert np.allclose(by_force[:, :, k], (across[0] - across[1]) / (2 * step), atol=1e-4)
        across = [plain_map(force, velocity + sign * ahead, *law) for sign in (1, -1)]
        difference = (across[0] - across[1]) / (2 * step)
        assert np.allclose(by_velocity[:, :, k], difference, atol=1e-4, rtol=1e-4)


@pytest.fixture(scope="module")
def kicked() -> FrictionProblem:
    """A settled bed of 150 spheres, friction 0.1, whose bodies were hit."""
    still = build_packing(150, 3, seed=3, friction=0.1)
    assert still.bodies is not None
    hit = np.random.default_rng(3).standard_normal(still.bodies.jacobian.shape[1])
    push = still.bodies.jacobian @ hit
    push *= 0.3 * np.linalg.norm(still.offset) / np.linalg.norm(push)
    made: FrictionProblem = make_problem(still.bodies, still.offset + push, still.friction, 3)
    return made


@pytest.mark.long
def test_a_point_lies_inside_the_cones_and_has_sigma_for_its_product(kicked, monkeypatch):
    """``x o s = sigma e``: the product is sigma, and what is beside the axis nothing."""
    module = sys.modules[follow_smoothed.__module__]
    monkeypatch.setattr(module, "SMOOTHED", replace(SMOOTHED, found=1e-9))
    linear = choose_factorisation(kicked)
    force, sigma = begin_path(kicked, linear)
    force, found, _ = find_smoothed_point(kicked, force, sigma, linear, 60)
    assert found
    rho = kicked.contact_rho
    eps = SMOOTHED.roundings[0] * np.sqrt(sigma) / rho.mean()
    r, u = force.reshape(-1, 3), kicked.velocity(force).reshape(-1, 3)
    for c in range(kicked.contacts):
        x, s = scaled(r[c], u[c], kicked.friction[c], rho[c], eps)
        assert x[0] > np.linalg.norm(x[1:])
        assert s[0] > np.linalg.norm(s[1:])
        assert x @ s == pytest.approx(sigma, rel=1e-6)
        size = np.sqrt(sigma) * max(np.linalg.norm(x), np.linalg.norm(s))
        assert np.linalg.norm(x[0] * s[1:] + s[0] * x[1:]) < 1e-6 * size


def test_it_solves_a_bed_on_which_the_interior_point_stops(kicked: FrictionProblem) -> None:
    """Without any other method but Newton's at its end; the residual is the judge."""
    found = follow_smoothed(kicked)
    assert found.solved
    assert kicked.residual(found.r) <= 1e-12
    jammed = solve_interior_point(kicked, None, 1e-10, Path(compliance=1e-4))
    assert jammed.residual > 1e-9


def test_a_tower_and_contacts_without_friction_are_solved() -> None:
    boxes = build_tower(10, 3)
    smooth = boxes.friction.copy()
    smooth[::2] = 0.0
    assert boxes.bodies is not None
    for friction in (boxes.friction, smooth, np.zeros_like(smooth)):
        problem = make_problem(boxes.bodies, boxes.offset, friction, 3)
        assert follow_smoothed(problem).residual < 1e-10


def test_what_has_no_solution_ends_and_says_so() -> None:
    """One contact that nothing can keep from approaching."""
    problem = make_problem(np.zeros((3, 3)), [-1.0, 0.0, 0.0], 0.5, 3)
    assert not follow_smoothed(problem).solved


def test_other_paths_differ() -> None:
    """Every rounding in turn, and with those that come again another sigma."""
    paths = [choose_other_path(hop) for hop in range(1, SMOOTHED.hops + 1)]
    assert len(set(paths)) == SMOOTHED.hops
    assert {rounding for rounding, _ in paths} == set(SMOOTHED.roundings)
