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
from qdem_fem.mesh.generation import Pattern, make_box_mesh
from qdem_fem.mesh.tetrahedra import read_mesh
from validation.bench.qdem.checks import check_below, check_between, report
from validation.bench.qdem.closed_forms import CONCRETE_BEAM
from validation.bench.qdem.judge import FloatArray, find_tip_p2, list_free
from validation.bench.qdem.meshes import jitter_nodes, make_slivers
from validation.bench.qdem.problem import Problem, clamp_mesh, find_tip_node, make_cantilever
from validation.bench.qdem.static import StaticAnswer, relax
from validation.bench.qdem.vibration import find_error, find_exact_motion, release
from validation.case import Check

Cells = tuple[int, int, int]
CONCRETE = Material(45e9, 0.167, 2350.0)
FORCE = (0.0, 0.0, -0.2)
"""So small [N] that QDEM's strain measure differs from the judge's by less than is compared."""
STEP_BELOW, STEP_ABOVE = 2e-3, 1e-6
"""Share by which a critical step may be below the true one (its margin) and above (rounding)."""
RATIOS = (0.3, 0.49, 0.4999)


def find_critical_step(problem: Problem) -> float:
    """2/omega [s] of the highest mode of scikit-fem's matrices, by ARPACK; without viscosity."""
    dof = list_free(problem.free, problem.stiffness.shape[0])
    root = np.sqrt(np.repeat(problem.mass, 3)[dof])
    scaled = sparse.diags(1 / root) @ problem.stiffness[dof][:, dof] @ sparse.diags(1 / root)
    start = np.random.default_rng(1).normal(size=len(dof))
    value = eigsh(scaled, k=1, which="LA", tol=1e-10, v0=start, return_eigenvectors=False)
    return float(2 / np.sqrt(value[0]))


def check_critical_step(name: str, found: float, expected: float) -> Check:
    """A critical step [s] by QDEM against that of the judge: never above it."""
    share = found / expected
    return check_between(
        f"{name}: critical step over the judge's", share, 1 - STEP_BELOW, 1 + STEP_ABOVE
    )


def compare_fields(answer: StaticAnswer) -> float:
    """Greatest difference of a node's displacement over the greatest displacement."""
    expected = answer.problem.static
    return float(np.abs(answer.displacement - expected).max() / np.abs(expected).max())


def check_static(name: str, problem: Problem, tolerance: float = 1e-8) -> list[Check]:
    """QDEM relaxed against scikit-fem's linear tetrahedra on the same mesh."""
    answer = relax(problem, tolerance)
    return [
        check_below(f"{name}: static field to same mesh, worst node", compare_fields(answer), 1e-5),
        check_below(f"{name}: von Mises to same mesh, worst element",
              answer.von_mises_differences().max(), 1e-3),
        report(f"{name}: static answer, evaluations of the forces", answer.steps),
    ]  # fmt: skip


# --- a sliver ---------------------------------------------------------------------------------


def make_sliver(altitude: float) -> Problem:
    """The cube with a sliver, clamped at x = 0 and pulled down at x = 1."""
    return replace(clamp_mesh(read_mesh(make_slivers(altitude)), CONCRETE), force=FORCE)


def check_sliver(altitude: float = 0.01) -> list[Check]:
    """What a sliver changes (nothing but the step), and what it costs."""
    name, problem = f"sliver {altitude:g}", make_sliver(altitude)
    body, run = problem.simulation()
    critical = run.critical_step.value
    even = make_sliver(1.0).simulation()[1].critical_step.value
    return [
        *check_static(name, problem),
        check_critical_step(name, critical, find_critical_step(problem)),
        report(f"{name}: steps, times those of the even mesh", even / critical),
        report(f"{name}: critical step over that of the fastest element alone",
                 critical / find_element_step(body).min()),
        check_motion(name, problem),
    ]  # fmt: skip


def check_motion(name: str, problem: Problem) -> Check:
    """Two first periods from the static shape at 0.9 of the step, to the sum over all modes."""
    node = find_tip_node(problem.mesh)
    exact = find_exact_motion(problem, problem.static, node)
    period = 2 * np.pi / exact.omega[0]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", StepWarning)  # that the step is short is why we are here
        record = release(problem, 2 * period, problem.static, node, sampling=period / 100)
    error = find_error(record.value, exact.displacement(record.time))
    return check_below(f"{name}: motion over two periods, to the exact one", error, 2e-3)


# --- nearly incompressible bodies ---------------------------------------------------------------


def vary_poisson(cells: Cells, pattern: Pattern, poisson: float) -> Problem:
    """The paper's beam with another Poisson's ratio."""
    problem = make_cantilever(cells, pattern)
    return replace(problem, material=replace(problem.material, poisson=poisson))


def check_locking(meshes: tuple[Cells, ...], finest_p2: Cells) -> list[Check]:
    """Tip over that of quadratic tetrahedra, and over scikit-fem's on the same mesh.

    The tip at 0.4999 over that at 0.3, of the same mesh and relative to the quadratic one, is
    what the volumes lock; the bars only say that it is as bad as that.
    """
    rows = []
    tips: dict[tuple[Cells, Pattern, float], float] = {}
    for poisson in RATIOS:
        beam = replace(CONCRETE_BEAM, poisson=poisson)
        reference = -find_tip_p2(finest_p2, -200.0, beam, "direct")
        rows.append(report(f"nu {poisson:g}: tip by quadratic tetrahedra, {finest_p2[0]} cells",
                             1e6 * reference, "um"))  # fmt: skip
        for cells in meshes:
            patterns: tuple[Pattern, ...] = ("kuhn", "five")
            for pattern in patterns:
                answer = relax(vary_poisson(cells, pattern, poisson), 1e-7)
                share = answer.tip / reference
                tips[cells, pattern, poisson] = share
                name = f"nu {poisson:g}, {pattern}, {cells[0]} x {cells[1]} x {cells[2]}"
                rows += [
                    check_below(f"{name}: tip to same mesh", answer.difference, 1e-5),
                    report(f"{name}: tip over that of quadratic tetrahedra", share),
                ]
    for (cells, pattern, poisson), share in tips.items():
        if poisson == RATIOS[-1]:
            left = share / tips[cells, pattern, RATIOS[0]]
            bars = (0.0, 0.05) if pattern == "kuhn" else (0.5, 1.0)
            rows.append(check_between(
                f"locking at nu {poisson:g}, {pattern}, {cells[0]} cells: share of the tip left",
                left, *bars))  # fmt: skip
    return rows


# --- steps near the critical one ----------------------------------------------------------------


def make_irregular_cube() -> Problem:
    """An irregular cube of 384 elements, clamped on one side."""
    return clamp_mesh(jitter_nodes(make_box_mesh((1.0,) * 3, (4, 4, 4)), 0.2, seed=1), CONCRETE)


def check_near_critical(steps: int) -> list[Check]:
    """0.99, 1 and 1.01 times the critical step."""
    problem = make_irregular_cube()
    rows = check_long_run("irregular cube", problem, 0.99, steps)
    energy = sample_energy(problem, 1.0, steps)
    share = compare_steps(problem)
    rows += [
        # the reported step is short of the true one, so the bound of the stable motion holds
        check_below(f"irregular cube, 1 of the critical step, {steps:.0e} steps: greatest energy "
              "over the first", energy.max() / energy[0], 1 / max(1e-12, 1 - share**2)),
    ]  # fmt: skip
    return rows


def compare_steps(problem: Problem) -> float:
    """Critical step by QDEM over that of the judge."""
    return problem.simulation()[1].critical_step.value / find_critical_step(problem)


def draw_velocity(problem: Problem) -> FloatArray:
    """Random velocities [m/s], (n, 3), zero where held: every mode has some."""
    rough = np.random.default_rng(0).normal(size=problem.mesh.nodes.shape)
    return np.asarray(1e-6 * rough * problem.free)


def check_long_run(name: str, problem: Problem, safety: float, steps: int) -> list[Check]:
    """Free motion from random velocities close to the critical step: no energy from nowhere."""
    energy = sample_energy(problem, safety, steps)
    half = len(energy) // 2
    return [
        check_below(f"{name}, {safety:g} of the critical step, {steps:.0e} steps: greatest energy "
              "over the first", energy.max() / energy[0], 1 / (1 - safety**2)),
        check_between(f"{name}, {safety:g} of the critical step: energy of the second half over "
                "the first", energy[half:].mean() / energy[:half].mean(), 0.9, 1.1),
    ]  # fmt: skip


def sample_energy(problem: Problem, share: float, steps: int, samples: int = 200) -> FloatArray:
    """Kinetic and elastic energy [J] of a free motion, at ``samples`` times and the end.

    ``share``: step over the critical one.
    """
    step = share * problem.simulation()[1].critical_step.value
    body, run = problem.simulation(step=step)
    body.velocity = draw_velocity(problem)
    values = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", StepWarning)
        for _ in range(samples):
            energy = run.energy()
            values.append(energy.kinetic + energy.elastic)
            run.advance((steps // samples) * run.step)
    energy = run.energy()
    return np.array([*values, energy.kinetic + energy.elastic])
