"""The rivals of the speed report solve the linear problem, and the limits are ones of physics.

Reference: the step v_{k+1/2} = v_{k-1/2} + dt M^-1 (f - K u_k), u_{k+1} = u_k + dt v_{k+1/2},
written with dense matrices; its modes oscillate with sin(omega dt/2) = dt sqrt(lambda)/2.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from math import isnan
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numba import njit
from numpy.typing import NDArray

from qdem_fem.errors import LibraryMissing, UsageError
from qdem_fem.mesh_generation import box_mesh
from validation.machine_limits import (
    CHAINS,
    Interval,
    best_rate,
    busy_seconds,
    fma_one,
    last_level_cache_bytes,
    measure,
    triad,
)
from validation.matrix_rivals import (
    ENVIRONMENT,
    SAFETY,
    LinearProblem,
    MklRival,
    Rival,
    ScipyRival,
    linear_problem,
    mkl_load,
    problem_load,
    problem_save,
)
from validation.qdem_judge import lumped_mass, stiffness

MATERIAL = (45e9, 0.167, 2350.0)
STEPS = 60

FloatArray = NDArray[np.float64]


def mkl_missing() -> bool:
    """True without the Intel MKL, an extra of the benchmarks."""
    try:
        mkl_load()
    except LibraryMissing:
        return True
    return False


needs_mkl = pytest.mark.skipif(mkl_missing(), reason="needs the Intel MKL (extra: bench)")


def cantilever() -> tuple[LinearProblem, FloatArray]:
    """A small beam, numbered at random, and its dense-matrix answer after `STEPS` steps (n, 3)."""
    mesh = box_mesh((0.4, 0.1, 0.1), (4, 2, 2), "five")
    shuffle = np.random.default_rng(5).permutation(len(mesh.nodes))
    nodes, elements = mesh.nodes[np.argsort(shuffle)], shuffle[mesh.elements]
    fixed = nodes[:, 0] == 0
    force = np.zeros_like(nodes)
    force[np.isclose(nodes[:, 0], 0.4)] = [30.0, 20.0, -100.0]
    problem = linear_problem(nodes, elements, MATERIAL, fixed, force)
    matrix = stiffness(nodes, elements, *MATERIAL[:2]).toarray()
    mass = np.repeat(lumped_mass(nodes, elements, MATERIAL[2]), 3)
    free = np.repeat(~fixed, 3)
    u, v = np.zeros((2, 3 * len(nodes)))
    for _ in range(STEPS):
        v += problem.step * free * (force.ravel() - matrix @ u) / mass
        u += problem.step * v
    return problem, u.reshape(-1, 3)


PROBLEM, EXPECTED = cantilever()


def assert_same_answer(rival: Rival, precision: str) -> None:
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


@needs_mkl
def test_blocks_read_fewer_bytes_on_a_mesh_without_zeros() -> None:
    """An irregular mesh fills its 3 x 3 blocks: 9 x 8 + 4 bytes against 9 x (8 + 4)."""
    rng = np.random.default_rng(1)
    mesh = box_mesh((1, 1, 1), (6, 6, 6))
    nodes = mesh.nodes + 0.01 * rng.uniform(-1, 1, mesh.nodes.shape)
    nobody = np.zeros(len(nodes), bool)
    problem = linear_problem(nodes, mesh.elements, MATERIAL, nobody, np.ones_like(nodes))
    rows, blocks = (MklRival(problem, "float64", 1, s).bytes_per_step for s in ("rows", "blocks"))
    assert blocks / rows == pytest.approx(76 / 108, rel=0.1)


def test_the_step_is_stable_and_not_far_below_the_limit() -> None:
    """Gershgorin's bound is above the largest eigenvalue; for these meshes by less than 4."""
    free = np.diff(PROBLEM.starts) > 0
    rate = -PROBLEM.matrix.toarray()[np.ix_(free, free)] / PROBLEM.step  # M^-1 K
    courant = PROBLEM.step * np.sqrt(np.linalg.eigvals(rate).real.max())
    assert 2 * SAFETY / 4 <= courant <= 2 * SAFETY


def test_rows_of_fixed_nodes_are_empty_and_zeros_are_not_stored() -> None:
    assert np.all(PROBLEM.data != 0)
    empty = np.diff(PROBLEM.starts).reshape(-1, 3) == 0
    assert empty.all(axis=1).sum() == 9  # 3 x 3 nodes at x = 0


def test_a_problem_survives_its_file(tmp_path: Path) -> None:
    problem_save(tmp_path / "problem.npz", PROBLEM)
    again = ScipyRival(problem_load(tmp_path / "problem.npz"), "float64")
    once = ScipyRival(PROBLEM, "float64")
    again.advance(STEPS)
    once.advance(STEPS)
    np.testing.assert_array_equal(again.displacement(), once.displacement())


def test_an_unknown_storage_is_refused() -> None:
    with pytest.raises(UsageError, match="no storage diagonals"):
        MklRival(PROBLEM, "float64", 1, "diagonals")


def test_processor_time_of_others_leaves_out_idle_and_waiting() -> None:
    """user 100, nice 20, system 30, idle 999, iowait 999, irq 1, softirq 2, steal 7, guest 50."""
    ticks = os.sysconf("SC_CLK_TCK")
    assert busy_seconds("cpu  100 20 30 999 999 1 2 7 50 0\ncpu0 1") == pytest.approx(160 / ticks)


def test_own_work_is_not_counted_as_others() -> None:
    """All processors together are at least what we took and what others took.

    (MKL's threads, called before, still spin for 0.2 s: why it gets a process of its own.)
    """
    interval = measure(lambda: [sum(range(20_000)) for _ in range(600)])
    processors = os.cpu_count() or 1
    assert 0 < interval.cpu <= interval.wall * processors + 0.02
    if not isnan(interval.others):
        own = interval.cpu / interval.wall / processors
        assert own + interval.others <= 1 + 0.1


@pytest.mark.long
def test_another_process_makes_a_time_unquiet() -> None:
    if isnan(measure(lambda: None).others):
        pytest.skip("this system does not tell what others compute")
    spin = "import time\nend = time.time() + 1.5\nwhile time.time() < end: pass"
    with subprocess.Popen([sys.executable, "-S", "-c", spin]):
        time.sleep(0.3)
        assert not measure(lambda: time.sleep(0.6)).quiet


@pytest.mark.parametrize(
    ("others", "quiet"), [(0.0, True), (0.05, True), (0.06, False), (np.nan, False)]
)
def test_quiet_needs_to_be_known(others: float, quiet: bool) -> None:
    assert Interval(1.0, 1.0, others).quiet is quiet


@pytest.mark.parametrize("threads", [1, 2])
def test_triad_computes_what_it_says(threads: int) -> None:
    """The third round is a = b + (s + 2) c."""
    b, c = np.random.default_rng(2).normal(size=(2, 1001))
    a = np.zeros(1001)
    triad(a, b, c, 0.5, threads, 3)
    np.testing.assert_allclose(a, b + 2.5 * c, rtol=1e-13, atol=1e-15)


@pytest.mark.parametrize("kind", [np.float64, np.float32])
def test_every_chain_of_fma_is_computed(kind: type) -> None:
    """x <- x/2 + 1 from 1 gives 2 - 2^-n; `CHAINS` of them are summed."""
    for rounds in (0, 1, 3, 10):
        assert float(fma_one(kind(0.5), kind(1), rounds)) == CHAINS * (2 - 0.5**rounds)


@pytest.mark.parametrize("kind", [np.float64, np.float32])
def test_fma_is_compiled_to_vectors(kind: type) -> None:
    fresh: Any = njit(fma_one.py_func)  # what comes from numba's cache has no listing
    fresh(kind(0.5), kind(1), 1)
    (text,) = fresh.inspect_asm().values()
    code = [line.split() for line in text.splitlines()]
    fused = [words for words in code if words and words[0].startswith(("vfmadd", "fmla"))]
    if not fused:
        pytest.skip("this processor has no fused multiply-add")
    assert len(fused) >= CHAINS
    suffix = "pd" if kind is np.float64 else "ps"
    assert all(words[0].endswith(suffix) or words[0] == "fmla" for words in fused)


def test_best_rate_finds_a_known_rate() -> None:
    """A millisecond a round is a thousand rounds a second, less what sleeping takes longer."""
    rate, _ = best_rate(lambda rounds: time.sleep(1e-3 * rounds), 1.0)
    assert 800 < rate <= 1000


def test_cache_size_is_plausible() -> None:
    assert 2**18 <= last_level_cache_bytes() <= 2**31


def test_environment_keeps_mkl_from_choosing_its_threads() -> None:
    assert ENVIRONMENT["MKL_DYNAMIC"] == "FALSE"
