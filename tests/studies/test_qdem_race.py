"""The rivals of the race of kernels solve the linear problem.

Reference: the step v_{k+1/2} = v_{k-1/2} + dt M^-1 (f - K u_k), u_{k+1} = u_k + dt v_{k+1/2},
written with dense matrices; its modes oscillate with sin(omega dt/2) = dt sqrt(lambda)/2.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from qdem_fem.files.errors import LibraryMissing
from qdem_fem.mesh.generation import make_box_mesh
from validation.bench.qdem.judge import build_stiffness, lump_mass
from validation.studies.qdem_cost.matrices import (
    SAFETY,
    LinearProblem,
    MklRival,
    ScipyRival,
    build_problem,
    load_mkl,
)
from validation.studies.qdem_cost.race import Contestant, measure_speed

pytestmark = pytest.mark.studies
MATERIAL = (45e9, 0.167, 2350.0)
STEPS = 60

FloatArray = NDArray[np.float64]


def mkl_missing() -> bool:
    """True without the Intel MKL, an extra of the benchmarks."""
    try:
        load_mkl()
    except LibraryMissing:
        return True
    return False


needs_mkl = pytest.mark.skipif(mkl_missing(), reason="needs the Intel MKL (extra: bench)")


def cantilever() -> tuple[LinearProblem, FloatArray]:
    """A small beam, numbered at random, and its dense-matrix answer after `STEPS` steps (n, 3)."""
    mesh = make_box_mesh((0.4, 0.1, 0.1), (4, 2, 2), "five")
    shuffle = np.random.default_rng(5).permutation(len(mesh.nodes))
    nodes, elements = mesh.nodes[np.argsort(shuffle)], shuffle[mesh.elements]
    fixed = nodes[:, 0] == 0
    force = np.zeros_like(nodes)
    force[np.isclose(nodes[:, 0], 0.4)] = [30.0, 20.0, -100.0]
    problem = build_problem(nodes, elements, MATERIAL, fixed, force)
    matrix = build_stiffness(nodes, elements, *MATERIAL[:2]).toarray()
    mass = np.repeat(lump_mass(nodes, elements, MATERIAL[2]), 3)
    free = np.repeat(~fixed, 3)
    u, v = np.zeros((2, 3 * len(nodes)))
    for _ in range(STEPS):
        v += problem.step * free * (force.ravel() - matrix @ u) / mass
        u += problem.step * v
    return problem, u.reshape(-1, 3)


PROBLEM, EXPECTED = cantilever()


def assert_same_answer(rival: Any, precision: str) -> None:
    """Rounding of `STEPS` sums, with a factor of 10 for the sums inside a product."""
    rival.advance(STEPS // 3)
    rival.advance(STEPS - STEPS // 3)
    error = np.abs(rival.displacement() - EXPECTED).max() / np.abs(EXPECTED).max()
    assert error < 10 * STEPS * np.finfo(precision).eps
    assert rival.displacement().shape == EXPECTED.shape


@pytest.mark.parametrize("precision", ["float64", "float32"])
def test_scipy_solves_the_linear_problem(precision: str) -> None:
    assert_same_answer(ScipyRival(PROBLEM, precision), precision)


@needs_mkl
@pytest.mark.parametrize("storage", ["rows", "blocks"])
@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("precision", ["float64", "float32"])
def test_mkl_solves_the_linear_problem(precision: str, threads: int, storage: str) -> None:
    assert_same_answer(MklRival(PROBLEM, precision, threads, storage), precision)


def test_the_step_is_stable_and_not_far_below_the_limit() -> None:
    """Gershgorin's bound is above the largest eigenvalue; for these meshes by less than 4."""
    free = np.diff(PROBLEM.matrix.indptr) > 0
    rate = -PROBLEM.matrix.toarray()[np.ix_(free, free)] / PROBLEM.step  # M^-1 K
    courant = PROBLEM.step * np.sqrt(np.linalg.eigvals(rate).real.max())
    assert 2 * SAFETY / 4 <= courant <= 2 * SAFETY


@pytest.mark.parametrize("who", ["qdem", "scipy"])
def test_a_contestant_is_measured(who: Any) -> None:
    found = measure_speed(Contestant(who), (11, 1, 1))
    assert found["speed"] > 0
    assert found["tip"] < 0
