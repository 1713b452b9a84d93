"""The parts: statics, vibration, motion, waves, and the paper's number of elements."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from qdem_fem.mesh.generation import Pattern
from validation.bench.qdem import judge
from validation.bench.qdem.checks import below, figures_row, near, reported
from validation.bench.qdem.closed_forms import cantilever_frequencies
from validation.bench.qdem.problem import Problem, cantilever, tip_node
from validation.bench.qdem.static import (
    TIP_P2,
    TIP_PAPER,
    StaticAnswer,
    answer_checks,
    closed_form_checks,
    convergence_checks,
    relaxed,
    settled,
)
from validation.bench.qdem.vibration import (
    first_mode,
    five_frequencies,
    frequency_checks,
    motion_checks,
    unload,
)
from validation.bench.qdem.waves import wave_checks
from validation.study import Row

CELLS = [(24, 4, 4), (36, 6, 6), (48, 8, 8), (72, 12, 12)]
QUADRATIC = [(12, 2, 2), (24, 4, 4), (48, 8, 8)]
FREQUENCY_PAPER = 26.98
"""[Hz]"""
Tip = tuple[str, str, int, float, float]
"""Method, tetrahedra a cell, elements, tip [um], processor time [s]."""


def static() -> Row:
    """Same-mesh answers, order of convergence, and what an answer costs by each method."""
    reference = -judge.cantilever_p2((72, 8, 8), -200.0)
    middle = cantilever((96, 10, 8))
    checks = [
        near("tip by quadratic tetrahedra", 1e6 * reference, 1e6 * TIP_P2, 1e-4, "um"),
        *answer_checks("46,080 elements, settled", settled(middle)),
        *answer_checks("46,080 elements, relaxed", relaxed(middle)),
    ]
    tips: list[Tip] = []
    patterns: dict[Pattern, str] = {"kuhn": "six", "five": "five"}
    for pattern, words in patterns.items():
        answers = [settled(cantilever(each, pattern)) for each in CELLS]
        checks += convergence_checks(f"{words} tetrahedra a cell", answers, reference)
        for answer in answers:
            by = {"QDEM, settled": answer, "QDEM, relaxed": relaxed(answer.problem)}
            tips += tips_of(words, by)
    return figures_row([*checks, *closed_form_checks()], tips=tips + quadratic_tips())


def tips_of(pattern: str, answers: dict[str, StaticAnswer]) -> list[Tip]:
    """Of one mesh: answers of QDEM by name, and scikit-fem from the mesh to the answer."""
    problem = next(iter(answers.values())).problem
    mesh, material = problem.mesh, problem.material
    started = time.process_time()
    stiffness = judge.stiffness(mesh.nodes, mesh.elements, material.young, material.poisson)
    # as accurate as the answer on a mesh deserves, not refined to the last digits
    found = judge.static_solve(
        stiffness, problem.free, problem.load, mesh.nodes, problem.method, tolerance=1e-5
    )
    spent = time.process_time() - started
    count, tip = len(mesh.elements), -1e6 * float(found.displacement[tip_node(mesh), 2])
    tips = [(name, pattern, count, 1e6 * one.tip, one.cpu_s) for name, one in answers.items()]
    return [*tips, ("scikit-fem, linear", pattern, count, tip, spent)]


def quadratic_tips() -> list[Tip]:
    """Quadratic tetrahedra by scikit-fem."""
    tips: list[Tip] = []
    for cells in QUADRATIC:
        started = time.process_time()
        tip = -1e6 * judge.cantilever_p2(cells, -200.0)
        spent = time.process_time() - started
        tips.append(("scikit-fem, quadratic", "six", 6 * int(np.prod(cells)), tip, spent))
    return tips


def vibration() -> Row:
    """Five frequencies from one motion, decay by viscosity, and beam theory beside them."""
    checks, modes = [], []
    for cells, name in (((24, 4, 4), "2,304 elements"), ((96, 10, 8), "46,080 elements")):
        problem = cantilever(cells)
        five = five_frequencies(problem)
        checks += frequency_checks(name, problem, five)
    theory: Sequence[Any] = list(cantilever_frequencies().items())[: len(five.judge)]
    for (mode, beam), found, expected in zip(theory, five.found, five.judge, strict=True):
        checks.append(reported(f"46,080 elements: {mode}, QDEM over beam theory", found / beam))
        modes.append([mode, float(expected), float(found), beam])
    return figures_row(checks, modes=modes)


def motion() -> Row:
    """The motion in time against the sum over all modes, 2,304 elements."""
    return figures_row(motion_checks(cantilever((24, 4, 4))))


def waves() -> Row:
    """Waves in a bar of up to 80 cells a wave."""
    return figures_row(wave_checks([10, 20, 40, 80]))


def paper_size() -> Row:
    """488,400 elements; the paper has 488,361."""
    problem: Problem = cantilever((222, 22, 20), "five")
    answer, name = relaxed(problem), "488,400 elements"
    expected = float(problem.modes().frequency[0])
    frequency = first_mode(unload(problem, expected, periods=2.0)).frequency
    checks = [
        *answer_checks(f"{name}, relaxed", answer),
        near(f"{name}: tip, the paper's", 1e6 * answer.tip, 1e6 * TIP_PAPER, 0.004, "um"),
        reported(f"{name}: excess stiffness", 100 * (TIP_P2 / answer.tip - 1), "%"),
        below(f"{name}: first frequency to same mesh", abs(frequency / expected - 1), 1e-3),
        near(f"{name}: first frequency, the paper's", frequency, FREQUENCY_PAPER, 0.004, "Hz"),
    ]
    return figures_row(checks, tips=tips_of("five", {"QDEM, relaxed": answer}))


PARTS = {
    "static": static, "vibration": vibration, "motion": motion, "waves": waves,
    "paper size": paper_size,
}  # fmt: skip
