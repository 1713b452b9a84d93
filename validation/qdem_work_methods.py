"""Methods of the work-precision report, each as a user would run it, with what each part costs.

Costs are processor time of one thread.  Making the mesh is left out, as all need one; compiling
is left out, as it is done once on a machine (`validation.cases.qdem_speed` states it).
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import scipy.sparse as sparse
from numpy.typing import NDArray
from scipy.sparse.linalg import eigsh

import qdem_fem as q
from qdem_fem.mass_scaling import element_step
from qdem_fem.ordering import order_for_locality
from validation.qdem_judge import factorised, lame, lumped_mass, stiffness
from validation.qdem_judge_dynamics import newmark
from validation.qdem_work_problems import BEAM, LOAD, Question, bar_mesh, end_middle

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
    nodes: int
    steps: int
    step: float
    """[s]"""
    cost: dict[str, float]
    """Processor time of the parts [s]; ``stepping`` among them."""
    notes: dict[str, float] = field(default_factory=dict)


class Costs(dict[str, float]):
    """Processor time of named parts [s]."""

    @contextmanager
    def part(self, name: str) -> Iterator[None]:
        """Time a part."""
        started = time.process_time()
        yield
        self[name] = self.get(name, 0.0) + time.process_time() - started


def answer(question: Question, method: str, setting: dict[str, Any]) -> Answer:
    """Run a method with its settings on a question."""
    return METHODS[method](question, **setting)


# --- QDEM -------------------------------------------------------------------------------------


def qdem(
    question: Question,
    cells: list[int] | None = None,
    h: float | None = None,
    precision: Any = "float64",
    safety: float = SAFETY,
    slowest: float = 0.0,
) -> Answer:
    """This package.

    ``safety``: step over the critical one.  ``slowest``: share of the elements that mass scaling
    makes heavier, those whose own steps are the shortest.
    """
    mesh, cost, notes = bar_mesh(_triple(cells), h), Costs(), {}
    material = q.Material(young=BEAM.young, poisson=BEAM.poisson, density=BEAM.density)
    with cost.part("assembly"):
        body = q.Body(mesh, material)
        target = float(np.quantile(element_step(body), slowest)) if slowest else None
        run = q.Simulation(
            [body], precision=precision, threads=1, safety=safety, mass_scaling=target
        )
        held, loaded = question.held(mesh.nodes), question.loaded(mesh.nodes)
        times, factors = question.table()
        if held.any():
            run.fix(body, held)
            run.load(body, loaded, q.Series(times, LOAD * factors[:, None] * [0.0, 0.0, 1.0]))
        else:
            run.pressure(body, loaded, q.Series(times, question.amplitude * factors))
        total = run.assembly.mass.sum()
    with cost.part("critical step"):
        step = run.step
    if target is not None:
        notes["mass added"] = float(total / (BEAM.density * body.gradients[1].sum()) - 1)
    # every step is recorded where a wave passes in a few
    sampling = float(question.times[1]) if question.name == "bending" else step
    with cost.part("stepping"):
        history = run.advance(question.end, {"end": end_middle(mesh.nodes)}, sampling)
    moved = history["end"][:, question.component]
    return Answer(
        history.time, moved, len(mesh.elements), len(mesh.nodes), run.steps_done, step, cost, notes
    )


# --- linear tetrahedra with assembled matrices ------------------------------------------------


def central_difference_scipy(question: Question, cells: list[int]) -> Answer:
    """The same steps with an assembled matrix: what a user writes with scikit-fem and scipy.

    Given its best: nodes in reverse Cuthill-McKee order, -dt M^-1 K formed beforehand, the load
    added where it acts only (see `validation.matrix_rivals`).
    """
    mesh, cost = bar_mesh(_triple(cells)), Costs()
    with cost.part("assembly"):
        order, element_order = order_for_locality(mesh.elements, len(mesh.nodes))
        place = np.empty(len(order), np.int64)
        place[order] = np.arange(len(order))
        nodes, elements = mesh.nodes[order], place[mesh.elements[element_order]]
        free = np.repeat(~question.held(nodes), 3)
        inverse = np.repeat(1 / lumped_mass(nodes, elements, BEAM.density), 3)
        matrix = stiffness(nodes, elements, BEAM.young, BEAM.poisson)
        root = sparse.diags(np.where(free, np.sqrt(inverse), 0.0))
        scaled = sparse.csr_matrix(root @ matrix @ root)
        force = question.force(mesh)[order].ravel()
    with cost.part("critical step"):
        start = np.random.default_rng(0).normal(size=len(free))
        value = eigsh(scaled, k=1, which="LA", tol=1e-3, v0=start, return_eigenvectors=False)
        step = SAFETY * 2 / float(np.sqrt(value[0]))
    with cost.part("assembly"):
        scaling = sparse.diags(np.where(free, inverse, 0.0))
        rate = sparse.csr_matrix(-step * scaling @ matrix @ sparse.diags(free.astype(float)))
        rate.eliminate_zeros()
    steps = int(np.ceil(question.end / step))
    with cost.part("stepping"):
        loaded = np.flatnonzero(force * free)
        push = step * (force * inverse)[loaded]
        factor = question.factor(step * np.arange(steps, dtype=np.float64))
        probe = 3 * int(place[end_middle(mesh.nodes)]) + question.component
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
    return Answer(times, recorded, len(elements), len(nodes), steps, step, cost)


def newmark_linear(
    question: Question, cells: list[int], steps_per_unit: int, solver: Any = "direct"
) -> Answer:
    """Newmark's method, beta 1/4, on scikit-fem's linear tetrahedra, lumped mass."""
    mesh, cost = bar_mesh(_triple(cells)), Costs()
    with cost.part("assembly"):
        matrix = stiffness(mesh.nodes, mesh.elements, BEAM.young, BEAM.poisson)
        mass = lumped_mass(mesh.nodes, mesh.elements, BEAM.density)
        force = question.force(mesh)
    step = question.unit / steps_per_unit
    steps = int(np.ceil(question.end / step))
    probe = end_middle(mesh.nodes)
    motion = newmark(
        matrix, mass, None, lambda t: float(question.factor(np.array(t))) * force,
        ~question.held(mesh.nodes), step, steps, record=[probe], method=solver, nodes=mesh.nodes,
    )  # fmt: skip
    cost |= {"factorisation": motion.setup_s, "stepping": motion.stepping_s}
    moved = motion.recorded[:, 0, question.component]
    return Answer(motion.time, moved, len(mesh.elements), len(mesh.nodes), steps, step, cost)


# --- quadratic tetrahedra ---------------------------------------------------------------------


def newmark_quadratic(question: Question, cells: list[int], steps_per_unit: int) -> Answer:
    """Newmark's method on scikit-fem's quadratic tetrahedra, consistent mass, direct solution."""
    import skfem
    from skfem.models.elasticity import linear_elasticity

    sides = (
        np.linspace(0, side, n + 1)
        for side, n in zip((BEAM.length, BEAM.width, BEAM.height), cells, strict=True)
    )
    mesh, cost = skfem.MeshTet.init_tensor(*sides), Costs()
    with cost.part("assembly"):
        element = skfem.ElementVector(skfem.ElementTetP2())
        basis = skfem.Basis(mesh, element, intorder=4)
        moduli = (float(value) for value in lame(BEAM.young, BEAM.poisson))
        matrix = skfem.asm(linear_elasticity(*moduli), basis).tocsr()
        inertia = skfem.BilinearForm(
            lambda u, v, w: BEAM.density * sum(u[i] * v[i] for i in range(3))
        )
        mass = skfem.asm(inertia, basis).tocsr()
        facets = mesh.facets_satisfying(lambda x: question.loaded(x.T))
        traction = skfem.LinearForm(lambda v, w: v[question.component])
        area = 1.0 if question.name == "pulse" else BEAM.area
        boundary = skfem.FacetBasis(mesh, element, facets=facets)
        force = question.amplitude / area * skfem.asm(traction, boundary)
        # scikit-fem puts the edges' middles after the nodes, three numbers each
        places = basis.doflocs[:, ::3].T
        free = np.flatnonzero(np.repeat(~question.held(places), 3))
        probe = 3 * end_middle(places) + question.component
    step = question.unit / steps_per_unit
    steps = int(np.ceil(question.end / step))
    recorded = newmark_matrices(
        matrix[free][:, free], mass[free][:, free], force[free], question.factor,
        int(np.searchsorted(free, probe)), step, steps, cost,
    )  # fmt: skip
    times = step * np.arange(steps + 1, dtype=np.float64)
    return Answer(times, recorded, mesh.t.shape[1], len(places), steps, step, cost)


def newmark_matrices(
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
    with cost.part("factorisation"):
        solve = factorised(mass + step**2 / 4 * stiffness)
    with cost.part("stepping"):
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


def _triple(cells: list[int] | None) -> tuple[int, int, int] | None:
    return None if cells is None else (cells[0], cells[1], cells[2])


METHODS: dict[str, Callable[..., Answer]] = {
    "QDEM": qdem,
    "P1 central difference": central_difference_scipy,
    "P1 Newmark": newmark_linear,
    "P2 Newmark": newmark_quadratic,
}
