"""Gauss-Seidel: kernels against plain NumPy, both spaces agree, towers, real problems, misuse."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp

from rigid_lcp.arrays import Floats
from rigid_lcp.friction.methods.gauss_seidel import begin_sweeps, lay_out_sweeps, solve_gauss_seidel
from rigid_lcp.friction.problem.definition import BodySpace, FrictionProblem, make_problem
from rigid_lcp.friction.sweeps.contact_kernel import sweep_once
from tests.rigid_local import solve_contact
from tests.rigid_networks import random_bodies, random_pairs
from validation.bench.rigid.friction_problems import read_problem
from validation.bench.rigid.packings import build_tower


def random_problem(dim: int, seed: int, bodies: int = 6, contacts: int = 12) -> FrictionProblem:
    """Random contacts between random bodies with full inverse masses, and the ground."""
    generator = np.random.default_rng(seed)
    pairs = random_pairs(contacts, bodies, generator)
    space = random_bodies(pairs, bodies, dim, generator, full=True)
    offset = space.jacobian @ generator.normal(size=bodies * space.body_size)
    return make_problem(space, offset, 0.4, dim)


def as_matrix(problem: FrictionProblem) -> FrictionProblem:
    """The same problem with W only."""
    return FrictionProblem(problem.delassus, problem.offset, problem.friction, problem.dim)


def plain_sweep(problem: FrictionProblem, force: Floats, visit: list[int]) -> Floats:
    """The definition: every contact in turn, with all of W."""
    matrix, dim, force = problem.delassus.toarray(), problem.dim, force.copy()
    for c in visit:
        rows = slice(c * dim, (c + 1) * dim)
        block = matrix[rows, rows]
        others = matrix[rows] @ force + problem.offset[rows] - block @ force[rows]
        force[rows], status = solve_contact(block, others, problem.friction[c])
        assert status != "no solution"
    return force


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("factors", [True, False])
def test_sweeps_are_those_of_the_definition(dim: int, factors: bool) -> None:
    """Two sweeps, there and back, in body space and by rows, from a start, to round-off."""
    problem = random_problem(dim, 2)
    start = plain_sweep(problem, np.zeros(12 * dim), list(range(12)))
    order = list(range(12))
    expected = plain_sweep(problem, plain_sweep(problem, start, order), order[::-1])
    problem = problem if factors else as_matrix(problem)
    blocks, force = lay_out_sweeps(problem), start.reshape(-1, dim).copy()
    assert (blocks.bodies > 0) == factors
    for visit in (np.arange(12), np.arange(12)[::-1].copy()):  # the first sweep has no momentum
        sweep_once(blocks, begin_sweeps(blocks, force), force, visit)
    np.testing.assert_allclose(force.ravel(), expected, atol=1e-11 * np.abs(expected).max())


@pytest.mark.parametrize("dim", [2, 3])
def test_solves_both_forms(dim: int) -> None:
    for seed in range(5):
        problem = random_problem(dim, seed)
        for form in (problem, as_matrix(problem)):
            found = solve_gauss_seidel(form, tolerance=1e-11, sweeps=20_000)
            assert found.solved
            assert problem.residual(found.r) <= 1.1e-11
            np.testing.assert_allclose(found.u, problem.velocity(found.r), atol=1e-10)


@pytest.mark.parametrize("dim", [2, 3])
def test_momentum_pays(dim: int) -> None:
    """A tower of 20 boxes after 200 sweeps: plain ones fall as 1/k, Nesterov's as 1/k^2."""
    problem = build_tower(20, dim)
    blocks, force = lay_out_sweeps(problem), np.zeros((problem.contacts, dim))
    for _ in range(200):
        sweep_once(blocks, begin_sweeps(blocks, force), force, np.arange(problem.contacts))
    fast = solve_gauss_seidel(problem, tolerance=1e-14, sweeps=200)
    assert fast.residual < 0.2 * problem.residual(force.ravel())


def test_momentum_keeps_the_velocities_of_the_bodies() -> None:
    """They are carried along by the same momentum, ``w = B^T r`` to round-off after 300 sweeps."""
    problem = build_tower(20, 3)
    blocks, force = lay_out_sweeps(problem), np.zeros((problem.contacts, 3))
    state = begin_sweeps(blocks, force)
    for _ in range(300):
        sweep_once(blocks, state, force, np.arange(problem.contacts))
    exact = begin_sweeps(blocks, force).velocity
    np.testing.assert_allclose(state.velocity, exact, atol=1e-11 * np.abs(force).max())


@pytest.mark.parametrize("dim", [2, 3])
def test_tower_carries_its_weight(dim: int) -> None:
    """Three boxes: the impulses of each face sum to the weight above it times the step."""
    problem = build_tower(3, dim)
    found = solve_gauss_seidel(problem, tolerance=1e-11, sweeps=5000)
    assert found.solved
    face = found.r.reshape(3, -1, dim)[:, :, 0].sum(axis=1)
    np.testing.assert_allclose(face, np.array([3, 2, 1]) * 9.81e-3, rtol=1e-9)


def test_warm_start_at_the_answer_does_nothing() -> None:
    problem = random_problem(3, 1)
    first = solve_gauss_seidel(problem, tolerance=1e-10, sweeps=20_000)
    again = solve_gauss_seidel(problem, first.r, tolerance=1e-9)
    assert again.work["sweeps"] == 0
    np.testing.assert_array_equal(again.r, first.r)


def test_best_point_and_a_message_without_convergence() -> None:
    problem = build_tower(20, 2)
    short, long = (solve_gauss_seidel(problem, tolerance=1e-14, sweeps=n) for n in (5, 50))
    assert short.status == long.status == "not converged"
    assert long.residual < short.residual
    assert short.residual == problem.residual(short.r)
    assert "->" in short.message


def test_contacts_without_a_solution_are_counted() -> None:
    """Nothing moves and the contacts approach: W = 0, said in words, with finite forces."""
    problem = make_problem(np.zeros((4, 4)), [-1.0, 0.0, -1.0, 0.0], 0.3, 2)
    found = solve_gauss_seidel(problem)
    assert not found.solved
    assert "2 contacts" in found.message
    assert np.isfinite(found.r).all()


def test_factors_that_are_none_of_pairs_fall_back_to_the_matrix() -> None:
    """A joint of three bodies, a mass that couples bodies: solved by the rows of W."""
    jacobian = np.random.default_rng(1).normal(size=(4, 9))
    three = BodySpace(sp.csr_array(jacobian), sp.csr_array(sp.eye(9)), 3)
    coupled = sp.csr_array(np.eye(9) + np.diag(np.full(6, 0.2), 3) + np.diag(np.full(6, 0.2), -3))
    for space in (three, BodySpace(three.jacobian, coupled, 3)):
        problem = make_problem(space, jacobian @ np.ones(9), 0.3, 2)
        assert lay_out_sweeps(problem).bodies == 0
        assert solve_gauss_seidel(problem, tolerance=1e-10, sweeps=5000).solved


REAL = {"Confeti-ex13-Fc3D-SBM.dat": 1e-12, "FrictionContactProblem00237.dat": 1e-12,
        "LMGC_100_PR_PerioBox-i00361-60-03000.hdf5": 1e-8, "Rover1040.dat": 1e-12}  # fmt: skip


@pytest.mark.parametrize("name", REAL)
def test_real_problems(name: str) -> None:
    """Problems that Gauss-Seidel is good at, to what it reaches in a thousand sweeps."""
    folder = os.environ.get("TRACKBED_DATA")
    if not folder:
        pytest.skip("TRACKBED_DATA does not name the folder of the real problems")
    problem = read_problem(Path(folder) / "friction_problems" / f"{name}.npz")
    assert solve_gauss_seidel(problem, tolerance=REAL[name], sweeps=1000).solved
