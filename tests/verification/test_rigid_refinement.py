"""Newton without its shift: exact to round-off where eigenvalues of W are less than the shift."""

from __future__ import annotations

from math import atan, cos, sin

import numpy as np
import pytest

import rigid_lcp as r
from rigid_lcp.arrays import Floats
from rigid_lcp.friction.attempts.sticking import refine_forces, solve_gmres, solve_sticking
from rigid_lcp.friction.linear.factorisation import choose_factorisation
from rigid_lcp.friction.problem.definition import FrictionProblem
from tests.rigid_networks import stack_on_slope
from validation.bench.rigid.scenes import stack, stack_unequal

G = 9.81


@pytest.mark.parametrize("ratio", [1e4, 1e8, 1e10])
@pytest.mark.parametrize("heavy_on_top", [True, False])
def test_great_mass_ratios_to_round_off(ratio: float, heavy_on_top: bool) -> None:
    """``|u| <= 1e-16 R / m_light`` times a few, R the greatest force; shifted steps stay far off.

    R is the weight of all above and on; each of the forces on a light block is known to 1e-16 R.
    """
    masses = [1.0] * 6 + [ratio] if heavy_on_top else [1.0, ratio, 1.0]
    problem = stack_on_slope(masses, step=1.0)
    exact = refine_forces(problem, shifted_steps(problem, 1), 0.0)
    stuck = solve_sticking(problem, 1e-15)
    floor = 1e-16 * G * sum(masses)
    assert np.abs(exact.u).max() < 30 * floor
    assert np.abs(stuck.u).max() < 100 * floor  # by the same products
    floor_forces = exact.r[::2][:2].sum()
    # a heavy block may still accelerate by what is round-off between light ones
    assert floor_forces == pytest.approx(G * sum(masses), rel=max(1e-13, 30 * floor / G))
    if ratio >= 1e8:  # why it is there: what the shift hides is not found by steps with it
        shifted = problem.velocity(shifted_steps(problem, 3))
        assert np.abs(shifted).max() > 1e3 * np.abs(exact.u).max()


def shifted_steps(problem: FrictionProblem, steps: int) -> Floats:
    """So many steps ``(W + 1e-9 / rho) dr = -(W r + q)`` from nothing."""
    identity = np.broadcast_to(np.eye(2), (problem.contacts, 2, 2)).copy()
    solve = choose_factorisation(problem).factor(identity * (1e-9 / problem.rho), identity)
    force = np.zeros(len(problem.offset))
    for _ in range(steps):
        force = force - solve(problem.velocity(force))
    return force


def test_gmres_solves_what_has_a_solution() -> None:
    """A singular ``A + B W`` and a right hand side in its range, against NumPy's least squares."""
    problem = stack_on_slope([1.0, 3.0, 1e7], step=1.0)
    size, contacts = len(problem.offset), problem.contacts
    identity = np.broadcast_to(np.eye(2), (contacts, 2, 2)).copy()
    a = np.zeros_like(identity)
    w = problem.delassus.toarray()
    loaded = np.zeros(size)
    loaded[::2] = 1.0  # all alike: what moves the heavy block alone
    right = w @ loaded
    solve = choose_factorisation(problem).factor(identity * (1e-9 / problem.rho), identity)
    found = solve_gmres(problem, a, identity, solve, right)
    assert np.linalg.norm(w @ found - right) < 1e-6 * np.linalg.norm(right)
    assert np.linalg.norm(w @ found - right) < 1e-2 * np.linalg.norm(w @ solve(right) - right)
    nothing = solve_gmres(problem, a, identity, solve, np.zeros(size))
    assert not nothing.any()


@pytest.mark.parametrize(("build", "bar"), [
    (lambda: stack(10, 1e8), 1e-10), (lambda: stack_unequal(1e8), 1e-11),
    (lambda: stack_unequal(1e10), 1e-9),
])  # fmt: skip
def test_great_mass_ratios_rest(build: object, bar: float) -> None:
    """Forces known to 1e-16 of the heavy weight leave speeds of ``1e-16 ratio g h`` (1e-8 m/s at
    1e10), and a way of that times h a step, both ways."""
    run = build()  # type: ignore[operator]
    place = run.positions.copy()
    run.advance(0.02)
    assert np.abs(run.positions - place).max() < bar


@pytest.mark.parametrize("off", [-1e-9, 0.0, 1e-9])
@pytest.mark.parametrize(
    "direction", [0.9273, *(pytest.param(angle, marks=pytest.mark.long) for angle in (0.0, 1.2))]
)
def test_a_block_in_space_at_the_threshold(off: float, direction: float) -> None:
    """Gravity along the slope by any angle to the tangents: it slides ``g (sin - mu cos) t^2 / 2``.

    The directions of friction at its four contacts count: where they differ by d the grip falls
    short by d^2 / 2, which the residual shows as d times the slip only.
    """
    slope, seconds = atan(0.364), 0.05
    mu = np.tan(slope) * (1 + off)
    down = G * sin(slope)
    scene = r.Scene(3, (down * cos(direction), down * sin(direction), -G * cos(slope)))
    scene.add(r.HalfSpace((0, 0, 1)), friction=mu)
    scene.add(r.make_box(0.3, 0.2, 0.1), density=2000, position=(0, 0, 0.05), friction=mu)
    run = r.Simulation(scene)
    run.advance(seconds)
    way = np.linalg.norm(run.positions[1, :2])
    expected = max(0.0, down - mu * G * cos(slope)) * seconds**2 / 2
    assert way == pytest.approx(expected, rel=1e-4, abs=1e-12 if off >= 0 else 0.0)
