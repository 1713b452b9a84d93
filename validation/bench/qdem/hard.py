"""Hard cases: a sliver, nearly incompressible bodies, steps close to the critical one.

Linear tetrahedra lock: a mesh has about five times as many elements as nodes, so that near nu = 0.5
there are more volumes to keep than motions to keep them with.

In a mode with s = omega dt/2 the leapfrog keeps H = 1/2 v-.M v+ + 1/2 u.K u, v- and v+ being the
velocities half a step before and after.  The energy with the velocity at the time of u is between
H and H/(1 - s^2); at s = 1 the amplitude may grow linearly; above, it grows by exp(2 arcosh s) each
step, 1.33 for s = 1.01.
"""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import scipy.sparse as sparse
from scipy.sparse.linalg import eigsh

from qdem_fem import Material
from qdem_fem.bodies.mass_scaling import find_element_step
from qdem_fem.files.errors import StepWarning
from qdem_fem.mesh.generation import Pattern, jitter, make_box_mesh
from qdem_fem.mesh.tetrahedra import read_mesh
from validation.bench.qdem.checks import below, between, reported
from validation.bench.qdem.closed_forms import CONCRETE_BEAM
from validation.bench.qdem.judge import FloatArray, cantilever_p2, free_dof
from validation.bench.qdem.meshes import box_with_sliver
from validation.bench.qdem.problem import Problem, cantilever, clamped, tip_node
from validation.bench.qdem.static import StaticAnswer, relaxed
from validation.bench.qdem.vibration import error_norm, exact_motion, let_go
from validation.case import Check

Cells = tuple[int, int, int]
CONCRETE = Material(45e9, 0.167, 2350.0)
FORCE = (0.0, 0.0, -0.2)
"""So small [N] that QDEM's strain measure differs from the judge's by less than is compared."""
STEP_BELOW, STEP_ABOVE = 2e-3, 1e-6
"""Share by which a critical step may be below the true one (its margin) and above (rounding)."""
RATIOS = (0.3, 0.49, 0.4999)


def critical_judge(problem: Problem) -> float:
    """2/omega [s] of the highest mode of scikit-fem's matrices, by ARPACK; without viscosity."""
    dof = free_dof(problem.free, problem.stiffness.shape[0])
    root = np.sqrt(np.repeat(problem.mass, 3)[dof])
    scaled = sparse.diags(1 / root) @ problem.stiffness[dof][:, dof] @ sparse.diags(1 / root)
    start = np.random.default_rng(1).normal(size=len(dof))
    value = eigsh(scaled, k=1, which="LA", tol=1e-10, v0=start, return_eigenvectors=False)
    return float(2 / np.sqrt(value[0]))


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


# --- a sliver ---------------------------------------------------------------------------------


def sliver_problem(altitude: float) -> Problem:
    """The cube with a sliver, clamped at x = 0 and pulled down at x = 1."""
    return replace(clamped(read_mesh(box_with_sliver(altitude)), CONCRETE), force=FORCE)


def sliver_checks(altitude: float = 0.01) -> list[Check]:
    """What a sliver changes (nothing but the step), and what it costs."""
    name, problem = f"sliver {altitude:g}", sliver_problem(altitude)
    body, run = problem.simulation()
    critical = run.critical_step.value
    even = sliver_problem(1.0).simulation()[1].critical_step.value
    return [
        *static_checks(name, problem),
        critical_check(name, critical, critical_judge(problem)),
        reported(f"{name}: steps, times those of the even mesh", even / critical),
        reported(f"{name}: critical step over that of the fastest element alone",
                 critical / find_element_step(body).min()),
        check_motion(name, problem),
    ]  # fmt: skip


def check_motion(name: str, problem: Problem) -> Check:
    """Two first periods from the static shape at 0.9 of the step, to the sum over all modes."""
    node = tip_node(problem.mesh)
    exact = exact_motion(problem, problem.static, node)
    period = 2 * np.pi / exact.omega[0]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", StepWarning)  # that the step is short is why we are here
        record = let_go(problem, 2 * period, problem.static, node, sampling=period / 100)
    error = error_norm(record.value, exact.at(record.time))
    return below(f"{name}: motion over two periods, to the exact one", error, 2e-3)


# --- nearly incompressible bodies ---------------------------------------------------------------


def cantilever_of(cells: Cells, pattern: Pattern, poisson: float) -> Problem:
    """The paper's beam with another Poisson's ratio."""
    problem = cantilever(cells, pattern)
    return replace(problem, material=replace(problem.material, poisson=poisson))


def locking_checks(meshes: tuple[Cells, ...], finest_p2: Cells) -> list[Check]:
    """Tip over that of quadratic tetrahedra, and over scikit-fem's on the same mesh.

    The tip at 0.4999 over that at 0.3, of the same mesh and relative to the quadratic one, is
    what the volumes lock; the bars only say that it is as bad as that.
    """
    rows = []
    tips: dict[tuple[Cells, Pattern, float], float] = {}
    for poisson in RATIOS:
        beam = replace(CONCRETE_BEAM, poisson=poisson)
        reference = -cantilever_p2(finest_p2, -200.0, beam, "direct")
        rows.append(reported(f"nu {poisson:g}: tip by quadratic tetrahedra, {finest_p2[0]} cells",
                             1e6 * reference, "um"))  # fmt: skip
        for cells in meshes:
            patterns: tuple[Pattern, ...] = ("kuhn", "five")
            for pattern in patterns:
                answer = relaxed(cantilever_of(cells, pattern, poisson), 1e-7)
                share = answer.tip / reference
                tips[cells, pattern, poisson] = share
                name = f"nu {poisson:g}, {pattern}, {cells[0]} x {cells[1]} x {cells[2]}"
                rows += [
                    below(f"{name}: tip to same mesh", answer.difference, 1e-5),
                    reported(f"{name}: tip over that of quadratic tetrahedra", share),
                ]
    for (cells, pattern, poisson), share in tips.items():
        if poisson == RATIOS[-1]:
            left = share / tips[cells, pattern, RATIOS[0]]
            bars = (0.0, 0.05) if pattern == "kuhn" else (0.5, 1.0)
            rows.append(between(
                f"locking at nu {poisson:g}, {pattern}, {cells[0]} cells: share of the tip left",
                left, *bars))  # fmt: skip
    return rows


# --- steps near the critical one ----------------------------------------------------------------


def near_critical_problem() -> Problem:
    """An irregular cube of 384 elements, clamped on one side."""
    return clamped(jitter(make_box_mesh((1.0, 1.0, 1.0), (4, 4, 4)), 0.2, seed=1), CONCRETE)


def near_critical_checks(steps: int) -> list[Check]:
    """0.99, 1 and 1.01 times the critical step."""
    problem = near_critical_problem()
    rows = long_run_checks("irregular cube", problem, 0.99, steps)
    energy = energies(problem, 1.0, steps)
    share = run_share(problem)
    rows += [
        # the reported step is short of the true one, so the bound of the stable motion holds
        below(f"irregular cube, 1 of the critical step, {steps:.0e} steps: greatest energy over "
              "the first", energy.max() / energy[0], 1 / max(1e-12, 1 - share**2)),
    ]  # fmt: skip
    return rows


def run_share(problem: Problem) -> float:
    """Critical step by QDEM over that of the judge."""
    return problem.simulation()[1].critical_step.value / critical_judge(problem)


def rough_velocity(problem: Problem) -> FloatArray:
    """Random velocities [m/s], (n, 3), zero where held: every mode has some."""
    rough = np.random.default_rng(0).normal(size=problem.mesh.nodes.shape)
    return np.asarray(1e-6 * rough * problem.free)


def long_run_checks(name: str, problem: Problem, safety: float, steps: int) -> list[Check]:
    """Free motion from random velocities close to the critical step: no energy from nowhere."""
    energy = energies(problem, safety, steps)
    half = len(energy) // 2
    return [
        below(f"{name}, {safety:g} of the critical step, {steps:.0e} steps: greatest energy over "
              "the first", energy.max() / energy[0], 1 / (1 - safety**2)),
        between(f"{name}, {safety:g} of the critical step: energy of the second half over the "
                "first", energy[half:].mean() / energy[:half].mean(), 0.9, 1.1),
    ]  # fmt: skip


def energies(problem: Problem, share: float, steps: int, samples: int = 200) -> FloatArray:
    """Kinetic and elastic energy [J] of a free motion, at ``samples`` times and the end.

    ``share``: step over the critical one.
    """
    step = share * problem.simulation()[1].critical_step.value
    body, run = problem.simulation(step=step)
    body.velocity = rough_velocity(problem)
    values = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", StepWarning)
        for _ in range(samples):
            energy = run.energy()
            values.append(energy.kinetic + energy.elastic)
            run.advance((steps // samples) * run.step)
    energy = run.energy()
    return np.array([*values, energy.kinetic + energy.elastic])
