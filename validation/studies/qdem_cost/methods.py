"""Methods, each as a user would run it, with the processor time of each part."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sparse
from numpy.typing import NDArray
from scipy.sparse.linalg import eigsh

import qdem_fem as q
from qdem_fem.kernel.cpu.ordering import order_for_locality
from validation.bench.qdem.judge import build_stiffness, factorise, find_lame, lump_mass
from validation.studies.qdem_cost.questions import BEAM, LOAD, Question, find_end_middle, mesh_bar

FloatArray = NDArray[np.float64]
SAFETY = 0.9
"""Of the critical step, for both explicit methods."""


@dataclass
class Answer:
    """A history, and what it cost."""

    times: FloatArray
    """[s]"""
    displacement: FloatArray
    """Of the end's middle, the component that is asked for [m]."""
    elements: int
    steps: int
    step: float
    """[s]"""
    cost: dict[str, float]
    """Processor time of the parts [s]; ``stepping`` among them."""


class Costs(dict[str, float]):
    """Processor time of named parts [s]."""

    @contextmanager
    def time_part(self, name: str) -> Iterator[None]:
        """Time a part."""
        started = time.process_time()
        yield
        self[name] = self.get(name, 0.0) + time.process_time() - started


def answer_by(method: str, question: Question, setting: dict[str, Any]) -> Answer:
    """Run a method with its settings on a question."""
    return METHODS[method](question, **setting)


# --- QDEM -------------------------------------------------------------------------------------


def solve_by_qdem(
    question: Question, cells: list[int], precision: Any = "float64", kind: type[q.Body] = q.Body
) -> Answer:
    """This package, at 0.9 of the critical step."""
    mesh, cost = mesh_bar(cells), Costs()
    material = q.Material(young=BEAM.young, poisson=BEAM.poisson, density=BEAM.density)
    with cost.time_part("assembly"):
        body = kind(mesh, material)
        run = q.Simulation([body], precision=precision, threads=1, safety=SAFETY)
        held, loaded = question.find_held(body.nodes), question.find_loaded(body.nodes)
        times, factors = question.table()
        if held.any():
            run.fix(body, held)
            run.load(body, loaded, q.Series(times, LOAD * factors[:, None] * [0.0, 0.0, 1.0]))
        else:
            run.pressure(body, loaded, q.Series(times, question.amplitude * factors))
    with cost.time_part("critical step"):
        step = run.step
    # every step is recorded where a wave passes in a few
    sampling = float(question.times[1]) if question.bends else step
    with cost.time_part("stepping"):
        history = run.advance(question.end, {"end": find_end_middle(body.nodes)}, sampling)
    moved = history["end"][:, question.component]
    return Answer(history.time, moved, len(mesh.elements), run.steps_done, step, cost)


# --- linear tetrahedra with assembled matrices ------------------------------------------------


def solve_by_scipy(question: Question, cells: list[int]) -> Answer:
    """The same steps with an assembled matrix: what a user writes with scikit-fem and scipy.

    Given its best: nodes in reverse Cuthill-McKee order, -dt M^-1 K formed beforehand, the load
    added where it acts only (see `validation.studies.qdem_cost.matrices`).
    """
    mesh, cost = mesh_bar(cells), Costs()
    with cost.time_part("assembly"):
        order, element_order = order_for_locality(mesh.elements, len(mesh.nodes))
        place = np.empty(len(order), np.int64)
        place[order] = np.arange(len(order))
        nodes, elements = mesh.nodes[order], place[mesh.elements[element_order]]
        free = np.repeat(~question.find_held(nodes), 3)
        inverse = np.repeat(1 / lump_mass(nodes, elements, BEAM.density), 3)
        matrix = build_stiffness(nodes, elements, BEAM.young, BEAM.poisson)
        root = sparse.diags(np.where(free, np.sqrt(inverse), 0.0))
        scaled = sparse.csr_matrix(root @ matrix @ root)
        force = question.force(mesh)[order].ravel()
    with cost.time_part("critical step"):
        start = np.random.default_rng(0).normal(size=len(free))
        value = eigsh(scaled, k=1, which="LA", tol=1e-3, v0=start, return_eigenvectors=False)
        step = SAFETY * 2 / float(np.sqrt(value[0]))
    with cost.time_part("assembly"):
        scaling = sparse.diags(np.where(free, inverse, 0.0))
        rate = sparse.csr_matrix(-step * scaling @ matrix @ sparse.diags(free.astype(float)))
        rate.eliminate_zeros()
    steps = int(np.ceil(question.end / step))
    with cost.time_part("stepping"):
        loaded = np.flatnonzero(force * free)
        push = step * (force * inverse)[loaded]
        factor = question.factor(step * np.arange(steps, dtype=np.float64))
        probe = 3 * int(place[find_end_middle(mesh.nodes)]) + question.component
        u, v, moved = np.zeros(len(free)), np.zeros(len(free)), np.zeros(len(free))
        recorded = np.zeros(steps + 1)
        for k in range(steps):
            np.add(v, rate @ u, out=v)
            if factor[k]:
                v[loaded] += (factor[k] if k else factor[k] / 2) * push
            np.multiply(v, step, out=moved)
            np.add(u, moved, out=u)
            recorded[k + 1] = u[probe]
    times = step * np.arange(steps + 1, dtype=np.float64)
    return Answer(times, recorded, len(elements), steps, step, cost)


def solve_newmark_linear(question: Question, cells: list[int], steps_per_unit: int) -> Answer:
    """Newmark's method, beta 1/4, on scikit-fem's linear tetrahedra, lumped mass."""
    mesh, cost = mesh_bar(cells), Costs()
    with cost.time_part("assembly"):
        matrix = build_stiffness(mesh.nodes, mesh.elements, BEAM.young, BEAM.poisson)
        mass = lump_mass(mesh.nodes, mesh.elements, BEAM.density)
        force = question.force(mesh)
        free = np.flatnonzero(np.repeat(~question.find_held(mesh.nodes), 3))
        probe = 3 * find_end_middle(mesh.nodes) + question.component
    step = question.unit / steps_per_unit
    steps = int(np.ceil(question.end / step))
    recorded = march_newmark(
        matrix[free][:, free], sparse.diags(np.repeat(mass, 3)[free]), force.ravel()[free],
        question.factor, int(np.searchsorted(free, probe)), step, steps, cost,
    )  # fmt: skip
    times = step * np.arange(steps + 1, dtype=np.float64)
    return Answer(times, recorded, len(mesh.elements), steps, step, cost)


# --- quadratic tetrahedra ---------------------------------------------------------------------


def solve_newmark_quadratic(question: Question, cells: list[int], steps_per_unit: int) -> Answer:
    """Newmark's method on scikit-fem's quadratic tetrahedra, consistent mass, direct solution."""
    import skfem
    from skfem.models.elasticity import linear_elasticity

    sides = (
        np.linspace(0, side, n + 1)
        for side, n in zip((BEAM.length, BEAM.width, BEAM.height), cells, strict=True)
    )
    mesh, cost = skfem.MeshTet.init_tensor(*sides), Costs()
    with cost.time_part("assembly"):
        element = skfem.ElementVector(skfem.ElementTetP2())
        basis = skfem.Basis(mesh, element, intorder=4)
        moduli = (float(value) for value in find_lame(BEAM.young, BEAM.poisson))
        matrix = skfem.asm(linear_elasticity(*moduli), basis).tocsr()
        inertia = skfem.BilinearForm(
            lambda u, v, w: BEAM.density * sum(u[i] * v[i] for i in range(3))
        )
        mass = skfem.asm(inertia, basis).tocsr()
        facets = mesh.facets_satisfying(lambda x: question.find_loaded(x.T))
        traction = skfem.LinearForm(lambda v, w: v[question.component])
        area = BEAM.area if question.bends else 1.0
        boundary = skfem.FacetBasis(mesh, element, facets=facets)
        force = question.amplitude / area * skfem.asm(traction, boundary)
        # scikit-fem puts the edges' middles after the nodes, three numbers each
        places = basis.doflocs[:, ::3].T
        free = np.flatnonzero(np.repeat(~question.find_held(places), 3))
        probe = 3 * find_end_middle(places) + question.component
    step = question.unit / steps_per_unit
    steps = int(np.ceil(question.end / step))
    recorded = march_newmark(
        matrix[free][:, free], mass[free][:, free], force[free], question.factor,
        int(np.searchsorted(free, probe)), step, steps, cost,
    )  # fmt: skip
    times = step * np.arange(steps + 1, dtype=np.float64)
    return Answer(times, recorded, mesh.t.shape[1], steps, step, cost)


def march_newmark(
    stiffness: sparse.csr_matrix,
    mass: sparse.csr_matrix,
    force: FloatArray,
    factor: Callable[[FloatArray], FloatArray],
    probe: int,
    step: float,
    steps: int,
    cost: Costs,
) -> FloatArray:
    """u [m] of degree of freedom ``probe``, (steps + 1,): M a + K u = factor(t) f from rest.

    Average acceleration (beta 1/4, gamma 1/2); the load is zero at first.
    """
    with cost.time_part("factorisation"):
        solve = factorise(mass + step**2 / 4 * stiffness)
    with cost.time_part("stepping"):
        u, v, a = (np.zeros(len(force)) for _ in range(3))
        recorded = np.zeros(steps + 1)
        factors = factor(step * np.arange(steps + 1, dtype=np.float64))
        for k in range(1, steps + 1):
            ahead = u + step * v + step**2 / 4 * a
            v += step / 2 * a
            a = solve(factors[k] * force - stiffness @ ahead)
            u, v = ahead + step**2 / 4 * a, v + step / 2 * a
            recorded[k] = u[probe]
    return recorded


METHODS: dict[str, Callable[..., Answer]] = {
    "QDEM": solve_by_qdem,
    "P1 central difference": solve_by_scipy,
    "P1 Newmark": solve_newmark_linear,
    "P2 Newmark": solve_newmark_quadratic,
}
