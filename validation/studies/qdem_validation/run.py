"""The parts: statics, vibration, motion, waves, and the paper's number of elements."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from qdem_fem.mesh.generation import Pattern
from validation.bench.qdem import judge
from validation.bench.qdem.checks import check_below, check_near, make_row, report
from validation.bench.qdem.closed_forms import list_beam_frequencies
from validation.bench.qdem.problem import Problem, find_tip_node, make_cantilever
from validation.bench.qdem.static import (
    TIP_P2,
    TIP_PAPER,
    StaticAnswer,
    check_answer,
    check_closed_forms,
    check_convergence,
    relax,
    settle,
)
from validation.bench.qdem.vibration import (
    check_exact_motion,
    check_frequencies,
    find_first_mode,
    find_frequencies,
    unload,
)
from validation.bench.qdem.waves import check_waves
from validation.study import Row

CELLS = [(24, 4, 4), (36, 6, 6), (48, 8, 8), (72, 12, 12)]
QUADRATIC = [(12, 2, 2), (24, 4, 4), (48, 8, 8)]
FREQUENCY_PAPER = 26.98
"""[Hz]"""
Tip = tuple[str, str, int, float, float]
"""Method, tetrahedra a cell, elements, tip [um], processor time [s]."""


def run_static() -> Row:
    """Same-mesh answers, order of convergence, and what an answer costs by each method."""
    reference = -judge.find_tip_p2((72, 8, 8), -200.0)
    middle = make_cantilever((96, 10, 8))
    checks = [
        check_near("tip by quadratic tetrahedra", 1e6 * reference, 1e6 * TIP_P2, 1e-4, "um"),
        *check_answer("46,080 elements, settled", settle(middle)),
        *check_answer("46,080 elements, relaxed", relax(middle)),
    ]
    tips: list[Tip] = []
    patterns: dict[Pattern, str] = {"kuhn": "six", "five": "five"}
    for pattern, words in patterns.items():
        answers = [settle(make_cantilever(each, pattern)) for each in CELLS]
        checks += check_convergence(f"{words} tetrahedra a cell", answers, reference)
        for answer in answers:
            by = {"QDEM, settled": answer, "QDEM, relaxed": relax(answer.problem)}
            tips += list_tips(words, by)
    return make_row([*checks, *check_closed_forms()], tips=tips + list_quadratic_tips())


def list_tips(pattern: str, answers: dict[str, StaticAnswer]) -> list[Tip]:
    """Of one mesh: answers of QDEM by name, and scikit-fem from the mesh to the answer."""
    problem = next(iter(answers.values())).problem
    mesh, material = problem.mesh, problem.material
    started = time.process_time()
    stiffness = judge.build_stiffness(mesh.nodes, mesh.elements, material.young, material.poisson)
    # as accurate as the answer on a mesh deserves, not refined to the last digits
    found = judge.solve_static(
        stiffness, problem.free, problem.load, mesh.nodes, problem.method, tolerance=1e-5
    )
    spent = time.process_time() - started
    count, tip = len(mesh.elements), -1e6 * float(found.displacement[find_tip_node(mesh), 2])
    tips = [(name, pattern, count, 1e6 * one.tip, one.cpu_s) for name, one in answers.items()]
    return [*tips, ("scikit-fem, linear", pattern, count, tip, spent)]


def list_quadratic_tips() -> list[Tip]:
    """Quadratic tetrahedra by scikit-fem."""
    tips: list[Tip] = []
    for cells in QUADRATIC:
        started = time.process_time()
        tip = -1e6 * judge.find_tip_p2(cells, -200.0)
        spent = time.process_time() - started
        tips.append(("scikit-fem, quadratic", "six", 6 * int(np.prod(cells)), tip, spent))
    return tips


def run_vibration() -> Row:
    """Five frequencies from one motion, decay by viscosity, and beam theory beside them."""
    checks, modes = [], []
    for cells, name in (((24, 4, 4), "2,304 elements"), ((96, 10, 8), "46,080 elements")):
        problem = make_cantilever(cells)
        five = find_frequencies(problem)
        checks += check_frequencies(name, problem, five)
    theory: Sequence[Any] = list(list_beam_frequencies().items())[: len(five.judge)]
    for (mode, beam), found, expected in zip(theory, five.found, five.judge, strict=True):
        checks.append(report(f"46,080 elements: {mode}, QDEM over beam theory", found / beam))
        modes.append([mode, float(expected), float(found), beam])
    return make_row(checks, modes=modes)


def run_motion() -> Row:
    """The motion in time against the sum over all modes, 2,304 elements."""
    return make_row(check_exact_motion(make_cantilever((24, 4, 4))))


def run_waves() -> Row:
    """Waves in a bar of up to 80 cells a wave."""
    return make_row(check_waves([10, 20, 40, 80]))


def run_paper_size() -> Row:
    """488,400 elements; the paper has 488,361."""
    problem: Problem = make_cantilever((222, 22, 20), "five")
    answer, name = relax(problem), "488,400 elements"
    expected = float(problem.modes().frequency[0])
    frequency = find_first_mode(unload(problem, expected, periods=2.0)).frequency
    checks = [
        *check_answer(f"{name}, relaxed", answer),
        check_near(f"{name}: tip, the paper's", 1e6 * answer.tip, 1e6 * TIP_PAPER, 0.004, "um"),
        report(f"{name}: excess stiffness", 100 * (TIP_P2 / answer.tip - 1), "%"),
        check_below(f"{name}: first frequency to same mesh", abs(frequency / expected - 1), 1e-3),
        check_near(
            f"{name}: first frequency, the paper's", frequency, FREQUENCY_PAPER, 0.004, "Hz"
        ),
    ]
    return make_row(checks, tips=list_tips("five", {"QDEM, relaxed": answer}))


PARTS = {
    "static": run_static, "vibration": run_vibration, "motion": run_motion, "waves": run_waves,
    "paper size": run_paper_size,
}  # fmt: skip
