"""Slivers and sizes that differ a thousandfold: static answer, critical step, mass scaling."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import eigsh

from qdem_fem import Material
from qdem_fem.critical_step import CriticalStep
from qdem_fem.errors import StepWarning
from qdem_fem.mass_scaling import element_step
from qdem_fem.mesh import altitudes, mesh_read
from validation.case import Check
from validation.qdem_hard_meshes import (
    SLIVER_STEP,
    box_graded,
    box_with_sliver,
    longest_edges,
)
from validation.qdem_judge import FloatArray, free_dof, lame
from validation.qdem_judge_modes import modes
from validation.qdem_motion import error_norm, exact_motion
from validation.qdem_problem import Problem, below, between, clamped, near, reported, tip_node
from validation.qdem_static import StaticAnswer, relaxed
from validation.qdem_vibration import let_go

CONCRETE = Material(45e9, 0.167, 2350.0)
FORCE = (0.0, 0.0, -0.2)
"""So small [N] that QDEM's strain measure differs from the judge's by less than is compared."""
STEP_BELOW, STEP_ABOVE = 2e-3, 1e-6
"""Share by which a critical step may be below the true one (its margin) and above (rounding)."""
SIZES_RATIO = 2000.0
"""Outer over inner edge of the graded box; its longest edges then differ 1000-fold."""


def critical_judge(problem: Problem, mass: FloatArray | None = None) -> float:
    """2/omega [s] of the highest mode of scikit-fem's matrices, by ARPACK; without viscosity."""
    dof = free_dof(problem.free, problem.stiffness.shape[0])
    root = np.sqrt(np.repeat(problem.mass if mass is None else mass, 3)[dof])
    scaled = sparse.diags(1 / root) @ problem.stiffness[dof][:, dof] @ sparse.diags(1 / root)
    start = np.random.default_rng(1).normal(size=len(dof))
    value = eigsh(scaled, k=1, which="LA", tol=1e-10, v0=start, return_eigenvectors=False)
    return float(2 / np.sqrt(value[0]))


def energy_share(problem: Problem, element: int, mode: FloatArray) -> float:
    """Elastic energy of an element in a motion (n, 3), over that of the element with most."""
    corner = problem.mesh.nodes[problem.mesh.elements]
    edges = corner[:, 1:] - corner[:, :1]
    moved = mode[problem.mesh.elements]
    gradient = np.linalg.solve(edges, moved[:, 1:] - moved[:, :1])
    strain = (gradient + gradient.transpose(0, 2, 1)) / 2
    first, second = lame(problem.material.young, problem.material.poisson)
    density = first / 2 * np.trace(strain, axis1=1, axis2=2) ** 2
    energy = np.linalg.det(edges) * (density + second * (strain**2).sum(axis=(1, 2)))
    return float(energy[element] / energy.max())


def critical_checks(name: str, problem: Problem, found: CriticalStep) -> list[Check]:
    """The critical step by QDEM, its mode and the element it names, by the judge's matrices.

    Of modes of one frequency any mixture may be found, so the judge looks at QDEM's own.
    """
    mode = found.mode.ravel()
    stiffness = mode @ (problem.stiffness @ mode) / (mode**2 @ np.repeat(problem.mass, 3))
    expected = critical_judge(problem)
    return [
        critical_check(name, found.value, expected),
        between(f"{name}: 2/omega of QDEM's highest mode over the judge's",
                2 / np.sqrt(stiffness) / expected, 1 - STEP_ABOVE, 1 + STEP_BELOW),
        between(f"{name}: energy of the element named in that mode, over the most",
                energy_share(problem, found.element, found.mode), 1 - 1e-6, 1 + 1e-9),
    ]  # fmt: skip


def critical_check(name: str, found: float, expected: float) -> Check:
    """A critical step [s] by QDEM against that of the judge: never above it."""
    share = found / expected
    return between(f"{name}: critical step over the judge's", share, 1 - STEP_BELOW, 1 + STEP_ABOVE)


def field_difference(answer: StaticAnswer) -> float:
    """Greatest difference of a node's displacement over the greatest displacement."""
    expected = answer.problem.static
    return float(np.abs(answer.displacement - expected).max() / np.abs(expected).max())


def static_checks(name: str, problem: Problem, tolerance: float = 1e-8) -> list[Check]:
    """QDEM relaxed against scikit-fem's linear tetrahedra on the same mesh."""
    answer = relaxed(problem, tolerance)
    return [
        below(f"{name}: static field to same mesh, worst node", field_difference(answer), 1e-5),
        below(f"{name}: von Mises to same mesh, worst element",
              answer.von_mises_differences().max(), 1e-3),
        reported(f"{name}: static answer, evaluations of the forces", answer.steps),
    ]  # fmt: skip


# --- slivers ----------------------------------------------------------------------------------


def sliver_problem(altitude: float) -> Problem:
    """The cube with a sliver, clamped at x = 0 and pulled down at x = 1."""
    return replace(clamped(mesh_read(box_with_sliver(altitude)), CONCRETE), force=FORCE)


def sliver_checks(altitude: float = 0.01) -> list[Check]:
    """What a sliver changes (nothing but the step), and what it costs."""
    name, problem, even = f"sliver {altitude:g}", sliver_problem(altitude), sliver_problem(1.0)
    body, run = problem.simulation()
    _, run_even = even.simulation()
    flat = altitudes(body.gradients[0]) / longest_edges(body.nodes, body.elements)
    critical = run.critical_step
    loss = run_even.critical_step.value / critical.value
    free = [sliver_problem(each) for each in (altitude, 1.0)]
    loose = [replace(each, free=np.ones_like(each.free)).simulation()[1] for each in free]
    share = loose[0].critical_step.value / loose[1].critical_step.value
    return [
        below(f"{name}: smallest altitude over longest edge", flat.min(), 0.01),
        *static_checks(name, problem),
        *critical_checks(name, problem, critical),
        near(f"{name}: step over that of the even mesh, free", share, SLIVER_STEP[altitude], 0.04),
        reported(f"{name}: steps, times those of the even mesh", loss),
        below(f"{name}: flatness of the element named, over the flattest",
              flat[critical.element] / flat.min(), 1.01),
        below(f"{name}: warnings that name it, more or less than one",
              abs(1 - warnings_naming(problem, critical.element)), 0.5),
        reported(f"{name}: critical step over that of the fastest element alone",
                 critical.value / element_step(body).min()),
        motion_check(name, problem),
        *mass_scaling_checks(name, problem, (0.25, 0.5)),
    ]  # fmt: skip


def warnings_naming(problem: Problem, element: int) -> int:
    """How many warnings of the first two steps name an element as the one that governs."""
    body, run = problem.simulation()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        run.advance(run.step)
        run.advance(run.step)
    name = f"element {element} of {body.name}"
    return sum(name in str(one.message) for one in caught if one.category is StepWarning)


def motion_check(name: str, problem: Problem) -> Check:
    """Two first periods from the static shape at 0.9 of the step, to the sum over all modes."""
    node = tip_node(problem.mesh)
    exact = exact_motion(problem, problem.static, node)
    period = 2 * np.pi / exact.omega[0]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", StepWarning)  # that the step is short is why we are here
        record = let_go(problem, 2 * period, problem.static, node, sampling=period / 100)
    error = error_norm(record.value, exact.at(record.time))
    return below(f"{name}: motion over two periods, to the exact one", error, 2e-3)


def mass_scaling_checks(name: str, problem: Problem, shares: tuple[float, ...]) -> list[Check]:
    """Steps saved by mass scaling to shares of the median element's own step, and its price."""
    body, run = problem.simulation()
    median = float(np.median(element_step(body)))
    before = run.critical_step.value
    lowest = problem.modes().frequency[0]
    rows = []
    for share in shares:
        _, scaled = problem.simulation(mass_scaling=share * median)
        mass, step = scaled.assembly.mass, scaled.critical_step.value
        changed = modes(
            problem.stiffness, mass, problem.free, 1, problem.method, problem.mesh.nodes
        ).frequency[0]
        what = f"{name}, mass scaled to {share:g} of the median element's step"
        rows += [
            critical_check(what, step, critical_judge(problem, mass)),
            between(f"{what}: fewer steps by", step / before, 1.0, 1e4),
            reported(f"{what}: mass added", 100 * (mass.sum() / problem.mass.sum() - 1), "%"),
            between(f"{what}: change of the first frequency", 100 * (changed / lowest - 1),
                    -20.0, 1e-6, "%"),
        ]  # fmt: skip
    return rows


# --- sizes ------------------------------------------------------------------------------------


def graded_problem(cells: int = 12) -> Problem:
    """The graded cube, held where x = 1 and pulled at the small cells."""
    mesh = mesh_read(box_graded(SIZES_RATIO, cells))
    inner = np.flatnonzero(mesh.nodes.max(axis=1) < 1.5 / SIZES_RATIO)
    held = np.repeat(mesh.nodes[:, :1] > 1 - 1e-9, 3, axis=1)
    return Problem(mesh, CONCRETE, ~held, inner, (0.0, 0.0, -1e-4))


def graded_checks(cells: int = 12) -> list[Check]:
    """Longest edges from 1 to 1000: same answer, exact step, and mass scaling nearly for nothing.

    Small elements have little mass, so much can be added to them.
    """
    name, problem = "sizes 1 to 1000", graded_problem(cells)
    body, run = problem.simulation()
    edges = longest_edges(body.nodes, body.elements)
    critical = run.critical_step
    return [
        between(f"{name}: longest edge, greatest over smallest", edges.max() / edges.min(),
                1e3, 2e3),
        below(f"{name}: elements turned over", len(problem.mesh.flipped), 0.5),
        *static_checks(name, problem),
        *critical_checks(name, problem, critical),
        below(f"{name}: edge of the element named, over the smallest",
              edges[critical.element] / edges.min(), 3),
        *mass_scaling_checks(name, problem, (0.05, 0.2)),
    ]  # fmt: skip
