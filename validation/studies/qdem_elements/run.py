"""The parts: bending, pulse, grain."""

import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
import skfem

import qdem_fem as q
from qdem_fem.grains.hulls import make_flat_form, place_corners_apart
from qdem_fem.grains.meshing import make_grain_tetrahedra
from validation.bench.qdem.checks import check_below, make_row
from validation.studies.qdem_cost.methods import solve_by_qdem
from validation.studies.qdem_cost.questions import QUESTIONS
from validation.study import Row

KINDS = {"linear": q.Body, "quadratic": q.QuadraticBody}
REPEATS = 3
BAR = {
    "linear": ((22, 2, 2), (44, 4, 4), (88, 8, 8)),
    "quadratic": ((11, 1, 1), (22, 2, 2), (44, 4, 4)),
}
"""Cells of the bar, five tetrahedra each."""
GRAIN = {"linear": (0, 1, 2), "quadratic": (0, 1)}
"""How often each of the grain's 96 tetrahedra is cut into eight."""
CORNERS, RADIUS = 8, 0.025  # of the grain; from its middle to a corner [m]
ROCK = q.Material(young=50e9, poisson=0.2, density=2700.0)
SQUEEZE, MARCH = 1e-6, 1e-3  # motion of one face towards the other [m]; time that is timed [s]


def measure_meshes(
    meshes: dict[str, Any], answer: Callable[[Any, Any], tuple[float, ...]]
) -> list[Row]:
    """Of each kind of element on each mesh the median of some runs by their cost: one compiles."""
    names, runs = ("elements", "step_s", "error", "cost_s"), []
    for element, kind in KINDS.items():
        for mesh in meshes[element]:
            found = sorted((answer(mesh, kind) for _ in range(REPEATS)), key=lambda one: one[-1])
            runs.append({"element": element} | dict(zip(names, found[REPEATS // 2], strict=True)))
    return runs


def compare(runs: Sequence[Row], name: str, share: float) -> Row:
    """``share``: greatest of the error that quadratic elements may leave on a mesh of both."""
    linear, quadratic = ([one for one in runs if one["element"] == kind] for kind in KINDS)
    one, other = next((a, b) for a in linear for b in quadratic if a["elements"] == b["elements"])
    asked = [("error", other, one, "on the same mesh", share)]
    if name == "bending":
        asked += [("error", quadratic[0], linear[-1], "coarsest over finest", 1.0),
                  ("cost_s", quadratic[0], linear[-1], "coarsest over finest", 0.01)]  # fmt: skip
    checks = [
        check_below(f"{name}: {key}, quadratic over linear, {which}", a[key] / b[key], most)
        for key, a, b, which, most in asked
    ]
    return make_row(checks, runs=runs)


def ask(name: str, share: float) -> Row:
    """A question of `validation.studies.qdem_cost` on all meshes."""

    def answer(cells: tuple[int, ...], kind: type[q.Body]) -> tuple[float, ...]:
        question, one = QUESTIONS[name], solve_by_qdem(QUESTIONS[name], list(cells), kind=kind)
        error = question.error(one.times, one.displacement, question.reference()[0])
        return one.elements, one.step, error, sum(one.cost.values())

    return compare(measure_meshes(BAR, answer), name, share)


def squeeze_grain(level: int, kind: type[q.Body]) -> tuple[float, ...]:
    """Elements, step [s], force at rest [N] of a grain of flat faces, and the cost of a march."""
    form = make_flat_form(place_corners_apart(np.random.default_rng(1), CORNERS))
    coarse = make_grain_tetrahedra(RADIUS * form.nodes, form.corner_faces)
    body = kind(skfem.MeshTet(coarse.nodes.T.copy(), coarse.elements.T.copy()).refined(level), ROCK)
    run = q.Simulation([body], threads=1)
    corners = coarse.nodes[form.corner_faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    slope = normal[:, 2] / np.linalg.norm(normal, axis=1)
    low, high = (
        abs((body.nodes - corners[face, 0]) @ normal[face]) < 1e-9 * RADIUS**3
        for face in (slope.argmin(), slope.argmax())
    )
    run.fix(body, low)
    run.fix(body, high, "xy")
    run.prescribe(body, high, "z", -SQUEEZE)
    run.relax()
    force = 2 * run.energy().elastic / SQUEEZE
    run.advance(2 * run.step)  # compiles
    started = time.process_time()
    run.advance(MARCH)
    return len(body.elements), run.step, force, time.process_time() - started


def squeeze() -> Row:
    """The grain on all meshes."""
    force = squeeze_grain(GRAIN["linear"][-1], q.QuadraticBody)[2]

    def answer(level: int, kind: type[q.Body]) -> tuple[float, ...]:
        elements, step, found, cost = squeeze_grain(level, kind)
        return elements, step, found / force - 1, cost

    return compare(measure_meshes(GRAIN, answer), "grain", 0.5)


PARTS = {
    "bending": partial(ask, "bending", 0.1),
    "pulse": partial(ask, "pulse", np.inf),
    "grain": squeeze,
}
