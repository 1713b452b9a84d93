"""Energy of QDEM without viscosity: what velocity Verlet conserves, and how well.

For a linear law the leapfrog form conserves 1/2 v-.M v+ + 1/2 u.K u exactly, v- and v+ being the
velocities half a step before and after; with v the mean of the two and a = -M^-1 K u that is
1/2 v.M v - dt^2/8 a.M a + 1/2 u.K u.  K is the judge's.  For the other laws the energy itself
only wavers, with dt^2, and does not drift: for those that have a potential, which the paper's
Finger law has at nu = 0.25 alone, and steps well below the critical one.  At strains of some per
cent and 0.8 of the critical step Saint-Venant and Kirchhoff's law does drift.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from qdem_fem import Material
from qdem_fem.mesh_generation import box_mesh, jitter
from qdem_fem.reference_forces import Strain
from validation.case import Check
from validation.qdem_judge import FloatArray
from validation.qdem_problem import Problem, below, between, clamped, orders, reported
from validation.qdem_record import Outcome

SAMPLES = 100
STRAIN = 1e-2
"""Size of the strains of the motion of the laws that are not linear."""
SAFETIES = (0.8, 0.4, 0.2)
LAWS: tuple[Strain, ...] = ("finger", "svk", "corotational")
STEPS = 100_000
LONG_SAMPLES, TENTH = 400, 40
"""Samples of the energy over that many steps, and a tenth of them."""
POISSON_CONCRETE = 0.167
"""Of section 3.1, where the Finger law has no potential."""


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


def energies(
    problem: Problem, law: Strain, safety: float, samples: int, stride: int, strain: float = STRAIN
) -> FloatArray:
    """Kinetic and elastic energy [J] of a free motion, every ``stride`` steps."""
    body, run = problem.simulation(strain=law, safety=safety)
    body.displacement = smooth_start(problem, strain)
    values = []
    for _ in range(samples):
        energy = run.energy()
        values.append(energy.kinetic + energy.elastic)
        run.advance(stride * run.step)
    return np.array(values)


def smooth_start(problem: Problem, strain: float) -> FloatArray:
    """A bent, stretched and twisted block: displacements [m], (n, 3)."""
    x, y, z = problem.mesh.nodes.T
    field = np.stack([x + x * y, x * x - x * z, 0.5 * x * x + x * y], axis=1)
    return strain * field


def step_of(problem: Problem, law: Strain, safety: float) -> float:
    """Time step [s]."""
    return problem.simulation(strain=law, safety=safety)[1].step


def law_checks(law: Strain, duration: float = 0.5) -> list[Check]:
    """Wavering of the energy: second order in the step; drift far below it."""
    problem = block()
    wavering, drift = [], []
    for safety in SAFETIES:
        stride = max(1, round(duration / 200 / step_of(problem, law, safety)))
        value = energies(problem, law, safety, 200, stride)
        wavering.append(float(np.std(value) / value[0]))
        drift.append(abs(float(value[100:].mean() / value[:100].mean() - 1)))
    return [
        reported(f"energy, {law}: wavering at 0.8 of the critical step", wavering[0]),
        between(f"energy, {law}: order of the wavering", orders(SAFETIES, wavering), 1.7, 2.3),
        below(f"energy, {law}: drift over the wavering at 0.8", drift[0] / wavering[0], 0.5),
    ]


def long_checks(steps: int = STEPS) -> list[Check]:
    """Bounded: over so many steps the energy leaves the band of the first tenth by half at most.

    Strains are of some per cent, and grow as the motion folds into ever shorter waves.
    """
    rows = []
    for law in LAWS:
        near_critical, well_below = (
            energies(block(), law, safety, LONG_SAMPLES, steps // LONG_SAMPLES)
            for safety in (0.8, 0.4)
        )
        change = np.abs(well_below / well_below[0] - 1)
        name = f"energy, {law}: gained in {steps:.0e} steps at"
        rows += [
            below(f"energy, {law}: band over {steps:.0e} steps, to their first tenth",
                  float(change.max() / change[:TENTH].max()), 1.5),
            reported(f"{name} 0.4 of the critical step", gained(well_below)),
            reported(f"{name} 0.8 of the critical step", gained(near_critical)),
        ]  # fmt: skip
    return rows


def gained(value: FloatArray) -> float:
    """Relative change of the mean energy from the first tenth of a record to its last."""
    return float(value[-TENTH:].mean() / value[:TENTH].mean() - 1)


def without_potential_checks(steps: int = STEPS) -> list[Check]:
    """The law of the paper at its own nu = 0.167: it gains energy, in proportion to the strains."""
    problem = block()
    problem = replace(problem, material=replace(problem.material, poisson=POISSON_CONCRETE))
    rows = []
    for strain in (1e-2, 1e-3, 1e-4):
        value = energies(problem, "finger", 0.4, LONG_SAMPLES, steps // LONG_SAMPLES, strain)
        name = f"energy, finger at nu = 0.167, strains of {strain:.0e}: gained in {steps:.0e} steps"
        rows.append(reported(name, gained(value)))
    return rows


def quick_checks(steps: int = STEPS) -> list[Check]:
    """The invariant of the linear law; three laws with a potential, and one without."""
    rows = [below(f"energy, small strain: drift of the invariant, {steps:.0e} steps",
                  invariant_drift(block(), steps), 1e-12)]  # fmt: skip
    for law in LAWS:
        rows += law_checks(law)
    return [*rows, *long_checks(), *without_potential_checks()]


def full() -> Outcome:
    """The invariant over ten times as many steps."""
    return Outcome(quick_checks(10 * STEPS))
