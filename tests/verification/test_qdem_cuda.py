"""The GPU kernel against the CPU kernel, in numba's simulator of a GPU; and what has no GPU."""

from __future__ import annotations

import ast
import inspect

import numpy as np
import pytest

import qdem_fem as q
from qdem_fem.element import stress
from qdem_fem.files.errors import ConditionError, LibraryMissing
from qdem_fem.kernel.cpu import step as kernel
from qdem_fem.kernel.cpu.arrays import Constraints, Loads, Probes
from validation.bench.qdem_gpu.contact import MARCHES
from validation.bench.qdem_gpu.search import CLOUDS
from validation.cases.qdem_gpu import STRAINS, compare_in_simulator

pytestmark = pytest.mark.peer("numba.cuda")

VARIANTS = [
    *(
        f"{strain}, {precision}{viscous}"
        for strain in STRAINS
        for precision in ("float64", "float32")
        for viscous in ("", ", viscous")
    ),
    "no condition at all",
    "in frames of its own",
    "periodic",
    "inversion: steps, count and state",
    "not a number: steps and count",
    *(f"contact: {name}" for name in (*MARCHES, "too deep")),
]
TETRAHEDRON = (np.vstack([np.zeros(3), np.eye(3)]), np.array([[0, 1, 2, 3]]))
CONCRETE = q.Material(young=45e9, poisson=0.167, density=2350.0)


@pytest.fixture(scope="module")
def apart() -> dict[str, float]:
    """Differences between the kernels over their bars, from a process of its own."""
    return compare_in_simulator()


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.long
def test_twins_agree(apart: dict[str, float], variant: str) -> None:
    """Displacement, velocity, samples and work are the CPU's to the round-off of their sums.

    So they are with empty lists, joined nodes, the energies for relaxation, and the stop at a bad
    element.  Of contact: places, forces, springs, losses and energies; lists made again and stops
    in the same step; there the processor's search and step raise, and no march copies arrays to
    the host.
    """
    assert apart[variant] <= 1


@pytest.mark.parametrize("name", CLOUDS)
@pytest.mark.long
def test_pairs_are_those_of_the_processor(apart: dict[str, float], name: str) -> None:
    """Lists of whole clouds, number by number; `test_qdem_cuda_search.py` has many small ones."""
    assert apart[f"pairs: {name}"] == 0


def test_surfaces_are_not_computed_on_a_gpu() -> None:
    """Before a GPU is asked for."""
    touch = q.SurfaceContact(1e12, 0.5)
    with pytest.raises(ConditionError, match="contact of surfaces is computed on the processor"):
        q.Simulation([q.Body(TETRAHEDRON, CONCRETE)], device="cuda", contact=touch)


def test_no_float_literal_in_single_precision_code() -> None:
    """A literal 0.5 is a double on a GPU, and would take the element's arithmetic with it."""
    from qdem_fem.kernel.cuda import step as cuda_step

    assert literals(inspect.getsource(stress)) == []
    for function in (cuda_step.find_edges, cuda_step.add_forces):
        assert literals(inspect.getsource(function.py_func)) == []
    assert literals(inspect.getsource(cuda_step.build_element_forces.__wrapped__)) == []
    assert literals(inspect.getsource(cuda_step.build_pulls_function)) == []


def literals(source: str) -> list[float]:
    """The floating-point literals of a source."""
    return [
        node.value
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.Constant) and isinstance(node.value, float)
    ]


def test_actions_of_a_node_keep_the_order_of_the_step() -> None:
    """Of one node: loads, rollers as given, held components, probes; the others have none."""
    from qdem_fem.kernel.cuda.assembly import sort_node_actions

    loads = Loads(np.array([0]), np.array([13]), np.array([2]), np.array([5.0]))
    held = Constraints(
        node_at=np.array([6, 14]), series=np.array([0, 1]), weight=np.array([0.0, 1.0]),
        previous=np.array([3.0, 4.0]), roller_at=np.array([12, 12]),
        roller_normal=np.array([[0.0, 0.6, 0.8], [1.0, 0.0, 0.0]]),
    )  # fmt: skip
    probes = Probes(np.array([12, 4]), np.zeros((1, 2, 3)), 1, 1)
    found = sort_node_actions(5, loads, held, probes)
    assert found.first.tolist() == [0, 0, 2, 2, 7, 7]
    assert found.actions[:7].tolist() == [
        [2, 2, 0, 0], [3, 0, -1, 1],
        [0, 1, 2, 0], [1, 0, -1, 0], [1, 0, -1, 1], [2, 2, 1, 1], [3, 0, -1, 0],
    ]  # fmt: skip
    assert found.weights[3].tolist() == [0.0, 0.6, 0.8]
    assert found.memory[:, 1].tolist() == [3, 0, 0, 0, 0, 4, 0, 0]


@pytest.mark.parametrize(("stride", "first", "rows"), [(1, 1, 9), (3, 2, 9), (4, 9, 1), (2, 1, 2)])
def test_samples_are_those_of_the_cpu_kernel(stride: int, first: int, rows: int) -> None:
    from qdem_fem.kernel.cuda.assembly import number_samples

    probes = Probes(np.array([4]), np.zeros((rows, 1, 3)), stride, first)
    numbers = number_samples(8, probes)
    for done in range(1, 9):
        probes.record[:] = np.nan
        kernel.record_probes.py_func(probes, done, np.ones(8))
        taken = np.flatnonzero(np.isfinite(probes.record[:, 0, 0]))
        assert numbers[done - 1] == (taken[0] if taken.size else -1)


def test_no_gpu_is_said_in_a_sentence() -> None:
    from numba import cuda

    if cuda.is_available():
        pytest.skip("a GPU is at hand")
    with pytest.raises(LibraryMissing, match="no GPU was found") as caught:
        q.Simulation([q.Body(TETRAHEDRON, CONCRETE)], device="cuda")
    assert caught.value.exit_code == 4
    assert 'device="cpu"' in caught.value.remedy


def test_unknown_device_is_refused() -> None:
    with pytest.raises(ConditionError, match="'gpu' is none of cpu, cuda"):
        q.Simulation([q.Body(TETRAHEDRON, CONCRETE)], device="gpu")  # type: ignore[arg-type]
