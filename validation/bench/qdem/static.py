"""Statics of QDEM judged by scikit-fem: tip of the cantilever, von Mises stress, order (3.1).

An explicit method has a static answer only as the mean of a motion: `settled`.  It needs four first
periods: a smooth step of two
first periods leaves the first mode at rest and the others nearly so, and a Hann window over two
more takes off what is left.  `Simulation.relax` takes no time at all.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from qdem_fem import Body
from validation.bench.qdem import judge as qdem_judge
from validation.bench.qdem.checks import check_below, check_between, check_near, fit_order, report
from validation.bench.qdem.closed_forms import find_euler_bernoulli_tip, find_timoshenko_tip
from validation.bench.qdem.judge import FloatArray
from validation.bench.qdem.problem import Problem, find_tip_node, make_smooth_step
from validation.case import Check

TIP_P2 = 92.655e-6
"""Tip by quadratic tetrahedra, 72 x 8 x 8 cells (`find_tip_p2`) [m]."""
TIP_PAPER = 91.94e-6
"""Tip that the paper gives for 488,361 elements, QDEM and FEM alike [m]."""
TIP_EQ_12 = 92.32156
"""Tip that the paper gives for eq. 12 [um]."""
SAMPLES = 200


@dataclass(frozen=True)
class StaticAnswer:
    """The same static problem by QDEM and by scikit-fem on the same mesh."""

    problem: Problem
    displacement: FloatArray
    """By QDEM [m], (n, 3)."""
    steps: int
    cpu_s: float
    """Processor time of QDEM, its set-up included [s]."""

    @property
    def tip(self) -> float:
        """Deflection of the tip by QDEM [m]."""
        return -float(self.displacement[find_tip_node(self.problem.mesh), 2])

    @property
    def tip_judge(self) -> float:
        """Deflection of the tip by scikit-fem [m]."""
        return -float(self.problem.static[find_tip_node(self.problem.mesh), 2])

    @property
    def difference(self) -> float:
        """Relative difference of the two."""
        return abs(self.tip / self.tip_judge - 1)

    def von_mises_differences(self) -> FloatArray:
        """Relative difference of the von Mises stress of every element, (m,)."""
        mesh, material = self.problem.mesh, self.problem.material
        expected = qdem_judge.find_von_mises(
            mesh.nodes, mesh.elements, material.young, material.poisson, self.problem.static
        )
        body = Body(mesh, material)
        body.displacement = self.displacement
        return np.abs(body.von_mises() / expected - 1)


def settle(problem: Problem, ramped: int = 2, averaged: int = 2) -> StaticAnswer:
    """Static answer from whole first periods: a smooth step, then a mean under a Hann window."""
    period = 1 / problem.modes().frequency[0]
    started = time.process_time()
    body, run = problem.simulation(make_smooth_step(ramped * period))
    run.advance(ramped * period)
    stride = max(1, round(averaged * period / SAMPLES / run.step))
    weight = 1 - np.cos(2 * np.pi * np.arange(SAMPLES) / SAMPLES)
    total = np.zeros_like(problem.mesh.nodes)
    for share in weight / weight.sum():
        total += share * body.displacement
        run.advance(stride * run.step)
    return StaticAnswer(problem, total, run.steps_done, time.process_time() - started)


def relax(problem: Problem, tolerance: float = 1e-8) -> StaticAnswer:
    """Static answer by dynamic relaxation with conjugate directions."""
    started = time.process_time()
    body, run = problem.simulation(1.0)
    found = run.relax(tolerance=tolerance)
    return StaticAnswer(problem, body.displacement, found.steps, time.process_time() - started)


def check_answer(name: str, answer: StaticAnswer) -> list[Check]:
    """Same-mesh agreement: tip 1e-5, von Mises 0.04 % in the mean and 0.12 % at most."""
    stress = answer.von_mises_differences()
    return [
        check_below(f"{name}: tip, QDEM to scikit-fem", answer.difference, 1e-5),
        check_below(f"{name}: von Mises, mean difference", 100 * stress.mean(), 0.04, "%"),
        check_below(f"{name}: von Mises, greatest difference", 100 * stress.max(), 0.12, "%"),
        report(f"{name}: tip", 1e6 * answer.tip, "um"),
        report(f"{name}: steps", answer.steps),
        report(f"{name}: processor time of QDEM", answer.cpu_s, "s"),
    ]


def check_convergence(name: str, answers: list[StaticAnswer], reference: float) -> list[Check]:
    """Order of the excess stiffness, reference over tip less 1, in the size of the cells."""
    sizes = [len(answer.problem.mesh.elements) ** (-1 / 3) for answer in answers]
    excess = [reference / answer.tip - 1 for answer in answers]
    agree = max(answer.difference for answer in answers)
    return [
        check_between(f"{name}: order of the excess stiffness", fit_order(sizes, excess), 1.9, 2.1),
        check_below(f"{name}: tips, QDEM to scikit-fem, worst", agree, 1e-5),
        report(f"{name}: excess stiffness, finest", 100 * excess[-1], "%"),
    ]


def check_closed_forms() -> list[Check]:
    """Beam theory, for the reader: no solution in three dimensions converges to either."""
    slender, with_shear = find_euler_bernoulli_tip(200), find_timoshenko_tip(200)
    return [
        check_near("tip by Euler-Bernoulli, eq. 12", 1e6 * slender, TIP_EQ_12, 1e-6, "um"),
        report("tip by Timoshenko", 1e6 * with_shear, "um"),
        report("tip by quadratic tetrahedra", 1e6 * TIP_P2, "um"),
    ]
