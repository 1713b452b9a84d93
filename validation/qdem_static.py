"""Statics of QDEM judged by scikit-fem: tip of the cantilever, von Mises stress, order (3.1).

An explicit method has a static answer only as the mean of a motion.  The paper ramps the load
over 1 s and averages from 1 to 2 s, 54 first periods.  `settled` needs four: a smooth step of two
first periods leaves the first mode at rest and the others nearly so, and a Hann window over two
more takes off what is left.  `Simulation.relax` takes no time at all.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from qdem_fem import Body, ramp
from qdem_fem.mesh_generation import Pattern
from validation import qdem_judge
from validation.case import Check
from validation.qdem_closed_forms import euler_bernoulli_tip, timoshenko_tip
from validation.qdem_judge import FloatArray
from validation.qdem_problem import (
    Problem,
    below,
    between,
    cantilever,
    near,
    orders,
    reported,
    smooth_step,
    tip_node,
)
from validation.qdem_record import Outcome, Table

TIP_P2 = 92.655e-6
"""Tip by quadratic tetrahedra, 72 x 8 x 8 cells (`qdem_judge.cantilever_p2`) [m]."""
TIP_PAPER = 91.94e-6
"""Tip that the paper gives for 488,361 elements, QDEM and FEM alike [m]."""
TIP_EULER_BERNOULLI = 92.32156e-6
"""Tip that the paper gives for eq. 12 [m]."""
SAMPLES = 200
P2_CELLS = ((12, 2, 2), (24, 4, 4), (48, 8, 8))
"""Of quadratic tetrahedra; each has half the size of the one before."""


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
        return -float(self.displacement[tip_node(self.problem.mesh), 2])

    @property
    def tip_judge(self) -> float:
        """Deflection of the tip by scikit-fem [m]."""
        return -float(self.problem.static[tip_node(self.problem.mesh), 2])

    @property
    def difference(self) -> float:
        """Relative difference of the two."""
        return abs(self.tip / self.tip_judge - 1)

    def von_mises_differences(self) -> FloatArray:
        """Relative difference of the von Mises stress of every element, (m,)."""
        mesh, material = self.problem.mesh, self.problem.material
        expected = qdem_judge.von_mises(
            mesh.nodes, mesh.elements, material.young, material.poisson, self.problem.static
        )
        body = Body(mesh, material)
        body.displacement = self.displacement
        return np.abs(body.von_mises() / expected - 1)


def settled(problem: Problem, ramped: int = 2, averaged: int = 2) -> StaticAnswer:
    """Static answer from whole first periods: a smooth step, then a mean under a Hann window."""
    period = 1 / problem.modes().frequency[0]
    started = time.process_time()
    body, run = problem.simulation(smooth_step(ramped * period))
    run.advance(ramped * period)
    stride = max(1, round(averaged * period / SAMPLES / run.step))
    weight = 1 - np.cos(2 * np.pi * np.arange(SAMPLES) / SAMPLES)
    total = np.zeros_like(problem.mesh.nodes)
    for share in weight / weight.sum():
        total += share * body.displacement
        run.advance(stride * run.step)
    return StaticAnswer(problem, total, run.steps_done, time.process_time() - started)


def settled_as_paper(problem: Problem) -> StaticAnswer:
    """Static answer as in the paper: a linear ramp of 1 s, then the mean from 1 to 2 s."""
    started = time.process_time()
    body, run = problem.simulation(ramp(1.0, 1.0))
    run.advance(1.0)
    total, count = np.zeros_like(problem.mesh.nodes), 1000
    for _ in range(count):
        total += body.displacement / count
        run.advance(max(1, round(1.0 / count / run.step)) * run.step)
    return StaticAnswer(problem, total, run.steps_done, time.process_time() - started)


def relaxed(problem: Problem, tolerance: float = 1e-8) -> StaticAnswer:
    """Static answer by dynamic relaxation with conjugate directions."""
    started = time.process_time()
    body, run = problem.simulation(1.0)
    found = run.relax(tolerance=tolerance)
    return StaticAnswer(problem, body.displacement, found.steps, time.process_time() - started)


def answer_checks(name: str, answer: StaticAnswer) -> list[Check]:
    """Same-mesh agreement: tip 1e-5, von Mises 0.04 % in the mean and 0.12 % at most."""
    stress = answer.von_mises_differences()
    return [
        below(f"{name}: tip, QDEM to scikit-fem", answer.difference, 1e-5),
        below(f"{name}: von Mises, mean difference", 100 * stress.mean(), 0.04, "%"),
        below(f"{name}: von Mises, greatest difference", 100 * stress.max(), 0.12, "%"),
        reported(f"{name}: tip", 1e6 * answer.tip, "um"),
        reported(f"{name}: steps", answer.steps),
        reported(f"{name}: processor time of QDEM", answer.cpu_s, "s"),
    ]


def convergence(cells: Sequence[tuple[int, int, int]], pattern: Pattern) -> list[StaticAnswer]:
    """The settled answers on a row of meshes."""
    return [settled(cantilever(each, pattern)) for each in cells]


def convergence_checks(name: str, answers: list[StaticAnswer], reference: float) -> list[Check]:
    """Order of the excess stiffness, reference over tip less 1, in the size of the cells."""
    sizes = [len(answer.problem.mesh.elements) ** (-1 / 3) for answer in answers]
    excess = [reference / answer.tip - 1 for answer in answers]
    agree = max(answer.difference for answer in answers)
    return [
        between(f"{name}: order of the excess stiffness", orders(sizes, excess), 1.9, 2.1),
        below(f"{name}: tips, QDEM to scikit-fem, worst", agree, 1e-5),
        reported(f"{name}: excess stiffness, finest", 100 * excess[-1], "%"),
    ]


def closed_form_checks() -> list[Check]:
    """Beam theory, for the reader: no solution in three dimensions converges to either."""
    slender, with_shear = euler_bernoulli_tip(200), timoshenko_tip(200)
    return [
        near(
            "tip by Euler-Bernoulli, eq. 12", 1e6 * slender, 1e6 * TIP_EULER_BERNOULLI, 1e-6, "um"
        ),
        reported("tip by Timoshenko", 1e6 * with_shear, "um"),
        reported("tip by quadratic tetrahedra", 1e6 * TIP_P2, "um"),
        reported("Euler-Bernoulli to quadratic tetrahedra", 100 * (slender / TIP_P2 - 1), "%"),
        reported("Timoshenko to quadratic tetrahedra", 100 * (with_shear / TIP_P2 - 1), "%"),
    ]


def paper_check(name: str, answer: StaticAnswer) -> Check:
    """The paper's way may be off by the rest of the first mode: 1/(pi 27) left by its ramp of 27
    periods, and 1/(pi 27) of that by its mean."""
    bar = 2 / (27 * np.pi) ** 2
    return below(f"{name}, as the paper averages: tip to scikit-fem", answer.difference, bar)


def quick_checks() -> list[Check]:
    """Meshes to 18,432 elements, about 20 s."""
    coarse = cantilever((24, 4, 4))
    row = convergence([(24, 4, 4), (36, 6, 6), (48, 8, 8)], "kuhn")
    return [
        *answer_checks("2,304 elements, settled", row[0]),
        *answer_checks("2,304 elements, relaxed", relaxed(coarse)),
        paper_check("2,304 elements", settled_as_paper(coarse)),
        *convergence_checks("cantilever to 18,432 elements", row, TIP_P2),
        *closed_form_checks(),
    ]


# --- the full form ----------------------------------------------------------------------------


def full() -> Outcome:
    """Meshes to 62,208 elements, and what static answers cost by each method."""
    cells = [(24, 4, 4), (36, 6, 6), (48, 8, 8), (72, 12, 12)]
    reference = -qdem_judge.cantilever_p2((72, 8, 8), -200.0)
    six, five = convergence(cells, "kuhn"), convergence(cells, "five")
    middle = cantilever((96, 10, 8))
    checks = [
        near("tip by quadratic tetrahedra", 1e6 * reference, 1e6 * TIP_P2, 1e-4, "um"),
        *answer_checks("46,080 elements, settled", settled(middle)),
        *answer_checks("46,080 elements, relaxed", relaxed(middle)),
        *convergence_checks("six tetrahedra a cell, to 62,208", six, reference),
        *convergence_checks("five tetrahedra a cell, to 51,840", five, reference),
        paper_check("2,304 elements", settled_as_paper(cantilever(cells[0]))),
        *closed_form_checks(),
    ]
    rows = [
        row
        for pattern, answers in (("six", six), ("five", five))
        for answer in answers
        for row in cost_rows(
            pattern, {"QDEM, settled": answer, "QDEM, relaxed": relaxed(answer.problem)}
        )
    ]
    second_order = quadratic_rows()
    tips = [row[3] for row in second_order]
    limit = tips[2] - (tips[2] - tips[1]) ** 2 / (tips[2] - 2 * tips[1] + tips[0])
    checks.append(reported("tip by quadratic tetrahedra, Aitken's limit", limit, "um"))
    return Outcome(checks, {"static": static_table([*rows, *second_order])})


Row = tuple[str, str, int, float, float]
"""Method, tetrahedra a cell, elements, tip [um], processor time [s]."""


def static_table(rows: Sequence[Row]) -> Table:
    """Tips and costs as a table."""
    titles = ("method", "tetrahedra a cell", "elements", "tip [um]", "processor time [s]")
    return dict(zip(titles, (list(column) for column in zip(*rows, strict=True)), strict=True))


def cost_rows(pattern: str, answers: dict[str, StaticAnswer]) -> list[Row]:
    """Of one mesh: answers of QDEM by name, and scikit-fem from the mesh to the answer."""
    problem = next(iter(answers.values())).problem
    mesh, material = problem.mesh, problem.material
    count, tip = len(mesh.elements), tip_node(mesh)
    started = time.process_time()
    stiffness = qdem_judge.stiffness(mesh.nodes, mesh.elements, material.young, material.poisson)
    # as accurate as the answer on a mesh deserves, not refined to the last digits
    judge = qdem_judge.static_solve(
        stiffness, problem.free, problem.load, mesh.nodes, problem.method, tolerance=1e-5
    )
    spent = time.process_time() - started
    rows: list[Row] = [
        (name, pattern, count, 1e6 * answer.tip, answer.cpu_s) for name, answer in answers.items()
    ]
    return [*rows, ("scikit-fem, linear", pattern, count, -1e6 * judge.displacement[tip, 2], spent)]


def quadratic_rows() -> list[Row]:
    """Quadratic tetrahedra by scikit-fem."""
    rows: list[Row] = []
    for cells in P2_CELLS:
        started = time.process_time()
        tip = -1e6 * qdem_judge.cantilever_p2(cells, -200.0)
        spent = time.process_time() - started
        rows.append(("scikit-fem, quadratic", "six", 6 * int(np.prod(cells)), tip, spent))
    return rows


def paper_size() -> Problem:
    """The cantilever with 488,400 elements, the paper's has 488,361."""
    return cantilever((222, 22, 20), "five")


def paper_size_relaxed() -> Outcome:
    """Static answer of the paper's number of elements, and how far the mesh is from the limit."""
    answer = relaxed(paper_size())
    checks = [
        *answer_checks("488,400 elements, relaxed", answer),
        near("488,400 elements: tip, the paper's", 1e6 * answer.tip, 1e6 * TIP_PAPER, 0.004, "um"),
        reported("488,400 elements: excess stiffness", 100 * (TIP_P2 / answer.tip - 1), "%"),
    ]
    rows = cost_rows("five", {"QDEM, relaxed": answer})
    return Outcome(checks, {"static-paper-size": static_table(rows)})


def paper_size_settled() -> Outcome:
    """The same by motion in time, as the paper does it.

    One period of mean is enough: the mesh is its own mirror image, so no bending across stirs.
    """
    answer = settled(paper_size(), averaged=1)
    return Outcome(answer_checks("488,400 elements, settled", answer))
