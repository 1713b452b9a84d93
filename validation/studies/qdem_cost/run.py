"""The runs: every method on every mesh and with every step, and the race of kernels."""

from __future__ import annotations

import os
import sys
from functools import partial
from typing import Any

import numpy as np

from qdem_fem.mesh.generation import make_box_mesh
from validation.bench.qdem_gpu.beam import SIZE
from validation.studies.qdem_cost.methods import Answer, answer_by
from validation.studies.qdem_cost.questions import QUESTIONS
from validation.studies.qdem_cost.race import count_bytes, measure_bandwidth, race
from validation.study import Row

LEVELS = ((22, 2, 2), (44, 4, 4), (65, 6, 6), (87, 8, 8), (109, 10, 10), (130, 12, 12),
          (174, 16, 16), (218, 20, 20))  # fmt: skip
"""Cells of the linear meshes, five tetrahedra each: 440 to 436,000; bending takes the first six."""
QUADRATIC = ((11, 1, 1), (22, 2, 2), (33, 3, 3), (44, 4, 4), (55, 5, 5))
"""Cells of the quadratic meshes, six tetrahedra each: 66 to 8,250."""
STEPS = {"bending": (20, 50, 100, 200), "pulse": (10, 20, 40, 80)}
"""Newmark's steps in a first period, or in a pulse."""
REPEATS = 3
RACE_CELLS, ROUNDS = (222, 22, 20), 5
ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")

Run = tuple[str, str, dict[str, Any]]
"""Name of the family, method, settings."""


def plan_runs(question: str) -> list[Run]:
    """All runs, cheap ones first; the most expensive are left out, as no sentence needs them."""
    bends = question == "bending"
    runs: list[Run] = []
    for level, cells in enumerate(LEVELS[:6] if bends else LEVELS):
        mesh = {"cells": list(cells)}
        runs += [("QDEM float64", "QDEM", mesh),
                 ("QDEM float32", "QDEM", mesh | {"precision": "float32"})]  # fmt: skip
        if level < (5 if bends else 7):
            runs.append(("P1 central difference", "P1 central difference", mesh))
        steps: tuple[int, ...] = STEPS[question]
        if bends and level > 2:
            steps = steps[:3] if level < 5 else steps[1:3]
        elif not bends and level > 3:
            steps = steps[2:3] if level == 4 else ()
        runs += [("P1 Newmark", "P1 Newmark", mesh | {"steps_per_unit": n}) for n in steps]
    for level, cells in enumerate(QUADRATIC):
        steps = STEPS[question]
        if level == 4:  # bending has no error left to lose; a pulse needs short steps there
            steps = () if bends else steps[2:]
        runs += [
            ("P2 Newmark", "P2 Newmark", {"cells": list(cells), "steps_per_unit": n}) for n in steps
        ]
    return runs


def measure_run(question: str, run: Run) -> Row:
    """Error of a run, and the median of its costs; no motion that is not finite has either."""
    family, method, setting = run
    asked = QUESTIONS[question]
    found = [answer_by(method, asked, setting) for _ in range(REPEATS)]
    if not all(np.isfinite(one.displacement).all() for one in found):
        raise ArithmeticError(f"the motion of {family} with {setting} is not finite")
    middle = sorted(found, key=lambda one: sum(one.cost.values()))[REPEATS // 2]
    error = asked.error(middle.times, middle.displacement, asked.reference()[0])
    return describe_run(family, setting, middle, error)


def describe_run(family: str, setting: dict[str, Any], one: Answer, error: float) -> Row:
    """The run in the record."""
    return {
        "method": family, "setting": setting, "error": error, "cost_s": sum(one.cost.values()),
        "parts_s": dict(one.cost), "work": one.steps, "elements": one.elements, "step_s": one.step,
    }  # fmt: skip


def ask(question: str) -> Row:
    """All runs of a question; the kernels are compiled before on the coarsest mesh."""
    if os.environ.get(ONE_THREAD[0]) != "1":
        sys.exit(f"set {', '.join(ONE_THREAD)} to 1: costs are those of one thread")
    runs = plan_runs(question)
    for run in {run[0]: run for run in reversed(runs)}.values():
        answer_by(run[1], QUESTIONS[question], run[2])
    return {
        "reference": QUESTIONS[question].reference()[1],
        "runs": [measure_run(question, run) for run in runs],
    }


def race_kernels() -> Row:
    """The race, and the bandwidth that a step would need at least."""
    mesh = make_box_mesh(SIZE, RACE_CELLS, "five")
    return {
        "elements": len(mesh.elements),
        "bytes_per_element": count_bytes(len(mesh.elements), len(mesh.nodes)),
        "bandwidth": {str(n): measure_bandwidth(n) for n in (1, 2)},
        "race": race(RACE_CELLS, ROUNDS),
    }


PARTS = {"bending": partial(ask, "bending"), "pulse": partial(ask, "pulse"), "speed": race_kernels}
