"""Energy of QDEM without viscosity: what velocity Verlet conserves, and how well.

For a linear law the leapfrog form conserves 1/2 v-.M v+ + 1/2 u.K u exactly, v- and v+ being the
velocities half a step before and after; with v the mean of the two and a = -M^-1 K u that is
1/2 v.M v - dt^2/8 a.M a + 1/2 u.K u.  K is the judge's.  For the other laws the energy itself
only wavers, with dt^2, and does not drift: for those that have a potential, which the paper's
Finger law has at nu = 0.25 alone.
"""

from __future__ import annotations

import numpy as np

from qdem_fem import Body, Material, Simulation
from qdem_fem.mesh_generation import box_mesh, jitter
from qdem_fem.reference_forces import Strain
from validation.case import Check
from validation.qdem_judge import FloatArray
from validation.qdem_problem import Problem, below, between, clamped, orders, reported

SAMPLES = 100
STRAIN = 1e-2
"""Size of the strains of the motion of the laws that are not linear."""
SAFETIES = (0.8, 0.4, 0.2)


def block() -> Problem:
    """A soft irregular block of 96 elements, clamped on one side."""
    mesh = jitter(box_mesh((2.0, 1.0, 1.0), (4, 2, 2)), 0.2, seed=1)
    return clamped(mesh, Material(young=1e6, poisson=0.25, density=1000.0))


def rough_start(problem: Problem, strain: float, seed: int = 0) -> FloatArray:
    """Random displacements of the free nodes [m], (n, 3), of strains of this size."""
    noise = np.random.default_rng(seed).uniform(-1, 1, problem.mesh.nodes.shape)
    return strain * 0.5 * noise * problem.free


def invariant_drift(problem: Problem, steps: int) -> float:
    """Greatest relative change of the leapfrog invariant over so many steps, linear law."""
    body, run = problem.simulation(strain="small")
    body.displacement = rough_start(problem, 1e-3)
    mass = np.repeat(problem.mass, 3)
    values = []
    for _ in range(SAMPLES + 1):
        u, v = body.displacement.ravel(), body.velocity.ravel()
        force = problem.stiffness @ u
        a = -np.where(problem.free.ravel(), force, 0.0) / mass
        values.append(0.5 * v @ (mass * v) - run.step**2 / 8 * a @ (mass * a) + 0.5 * u @ force)
        run.advance(steps // SAMPLES * run.step)
    return float(np.abs(np.array(values) / values[0] - 1).max())


def energies(problem: Problem, strain: Strain, safety: float, duration: float) -> FloatArray:
    """Kinetic and elastic energy [J] at 200 times of a free motion of strains of `STRAIN`."""
    body = Body(problem.mesh, problem.material)
    run = Simulation([body], strain=strain, safety=safety, threads=1)
    run.fix(body, ~problem.free.all(axis=1))
    body.displacement = smooth_start(problem)
    stride = max(1, round(duration / 200 / run.step))
    values = []
    for _ in range(200):
        energy = run.energy()
        values.append(energy.kinetic + energy.elastic)
        run.advance(stride * run.step)
    return np.array(values)


def smooth_start(problem: Problem) -> FloatArray:
    """A bent, stretched and twisted block: displacements [m], (n, 3)."""
    x, y, z = problem.mesh.nodes.T
    field = np.stack([x + x * y, x * x - x * z, 0.5 * x * x + x * y], axis=1)
    return STRAIN * field


def law_checks(strain: Strain, duration: float = 0.5) -> list[Check]:
    """Wavering of the energy: second order in the step; drift far below it."""
    problem = block()
    wavering, drift = [], []
    for safety in SAFETIES:
        value = energies(problem, strain, safety, duration)
        wavering.append(float(np.std(value) / value[0]))
        drift.append(abs(float(value[100:].mean() / value[:100].mean() - 1)))
    return [
        reported(f"energy, {strain}: wavering at 0.8 of the critical step", wavering[0]),
        between(f"energy, {strain}: order of the wavering", orders(SAFETIES, wavering), 1.7, 2.3),
        below(f"energy, {strain}: drift over the wavering at 0.8", drift[0] / wavering[0], 0.5),
    ]


def quick_checks(steps: int = 100_000) -> list[Check]:
    """Three laws with a potential, and the invariant of the linear one."""
    rows = [below(f"energy, small strain: drift of the invariant, {steps:.0e} steps",
                  invariant_drift(block(), steps), 1e-12)]  # fmt: skip
    laws: tuple[Strain, ...] = ("finger", "svk", "corotational")
    for law in laws:
        rows += law_checks(law)
    return rows


def full_checks() -> list[Check]:
    """The invariant over ten times as many steps."""
    return quick_checks(1_000_000)
