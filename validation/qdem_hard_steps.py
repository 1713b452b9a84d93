"""Steps close to the critical one: stable below, at the edge, stopped above.

In a mode with s = omega dt/2 the leapfrog keeps H = 1/2 v-.M v+ + 1/2 u.K u, v- and v+ being the
velocities half a step before and after.  The energy with the velocity at the time of u is between
H and H/(1 - s^2); at s = 1 the amplitude may grow linearly; above, it grows by
exp(2 arcosh s) each step, 1.33 for s = 1.01.
"""

from __future__ import annotations

import warnings

import numpy as np

from qdem_fem.errors import QdemError, StepWarning, Unstable
from qdem_fem.mesh_generation import box_mesh, jitter
from qdem_fem.reference_forces import Strain
from validation.case import Check
from validation.qdem_hard_shapes import CONCRETE, critical_checks, critical_judge
from validation.qdem_judge import FloatArray
from validation.qdem_problem import Problem, below, between, clamped

STEPS_MOST = 4096
"""Steps within which a step 1 % above the critical one must be stopped: a window of the march."""


def near_critical_problem() -> Problem:
    """An irregular cube of 384 elements, clamped on one side."""
    return clamped(jitter(box_mesh((1.0, 1.0, 1.0), (4, 4, 4)), 0.2, seed=1), CONCRETE)


def near_critical_checks(steps: int) -> list[Check]:
    """0.99, 1 and 1.01 times the critical step."""
    problem = near_critical_problem()
    rows = long_run_checks("irregular cube", problem, 0.99, steps)
    energy = energies(problem, 1.0, steps)
    share = run_share(problem)
    rows += [
        *critical_checks("irregular cube", problem, problem.simulation()[1].critical_step),
        # the reported step is short of the true one, so the bound of the stable motion holds
        below(f"irregular cube, 1 of the critical step, {steps:.0e} steps: greatest energy over "
              "the first", energy.max() / energy[0], 1 / max(1e-12, 1 - share**2)),
    ]  # fmt: skip
    laws: tuple[Strain, ...] = ("finger", "small", "svk", "corotational")
    for law in laws:
        rows += above_checks(problem, law)
    return rows


def run_share(problem: Problem) -> float:
    """Critical step by QDEM over that of the judge."""
    return problem.simulation()[1].critical_step.value / critical_judge(problem)


def above_checks(problem: Problem, law: Strain) -> list[Check]:
    """1 % above the critical step: a warning before the first step, and the end soon after.

    Both name the element, the end comes as `Unstable`.
    """
    name = f"irregular cube, 1.01 of the critical step, {law}"
    critical = problem.simulation()[1].critical_step
    body, run = problem.simulation(strain=law, step=1.01 * critical.value)
    body.velocity = rough_velocity(problem)
    raised: QdemError | None = None
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            run.advance(10 * STEPS_MOST * run.step)
        except QdemError as error:
            raised = error
    named = f"element {critical.element} of {body.name}"
    warned = [str(one.message) for one in caught if issubclass(one.category, StepWarning)]
    lacking = {
        "one warning with element and ratio": not (
            len(warned) == 1 and named in warned[0] and "1.01 times the critical" in warned[0]
        ),
        "Unstable": not isinstance(raised, Unstable),
        "its element": named not in str(raised),
        "its ratio": "1.010 times the critical" not in str(raised),
    }
    return [
        between(f"{name}: steps until it is stopped", run.steps_done, 1, STEPS_MOST + 1),
        below(f"{name}: of warning, error, element and ratio not said", sum(lacking.values()), 0.5),
    ]


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
