"""The parts: bending, pulse, grain."""

import time
from collections.abc import Callable
from functools import partial
from operator import itemgetter
from typing import Any

import numpy as np
import skfem

import qdem_fem as q
from qdem_fem.grains.hulls import make_flat_form, place_corners_apart
from qdem_fem.grains.meshing import make_grain_tetrahedra
from validation.bench.qdem.checks import check_below, make_row, report
from validation.studies.qdem_cost.methods import solve_by_qdem
from validation.studies.qdem_cost.questions import QUESTIONS
from validation.study import Row

REPEATS = 3  # of which the median counts
BAR = ((22, 2, 2), (44, 4, 4), (88, 8, 8)), ((11, 1, 1), (22, 2, 2), (44, 4, 4))
"""Cells of the bar, five tetrahedra each, of linear and of quadratic elements."""
GRAIN = (0, 1, 2), (0, 1)
"""How often each of the grain's 96 tetrahedra is cut into eight."""
CORNERS, RADIUS = 8, 0.025  # of the grain; from its middle to a corner [m]
ROCK = q.Material(young=50e9, poisson=0.2, density=2700.0)
SQUEEZE, MARCH = 1e-6, 1e-3  # motion of one face towards the other [m]; time that is timed [s]


def measure(name: str, share: float, meshes: Any, answer: Callable[[Any, Any], Row]) -> Row:
    """All runs of a part, each the median of some by their cost, as one compiles; its bars.

    ``share``: greatest of the error that quadratic elements may leave on a mesh of both."""
    linear, quadratic = (
        [
            sorted((answer(mesh, kind) for _ in range(REPEATS)), key=itemgetter("cost_s"))[1]
            | {"element": kind.ELEMENT}
            for mesh in own
        ]
        for kind, own in zip((q.Body, q.QuadraticBody), meshes, strict=True)
    )
    one, other = next((a, b) for a in linear for b in quadratic if a["elements"] == b["elements"])
    ratio = f"{name}: error, quadratic over linear, on the same mesh", other["error"] / one["error"]
    checks = [report(*ratio) if share == np.inf else check_below(*ratio, share)]
    if name == "bending":
        for key, most in (("error", 1.0), ("cost_s", 0.01)):
            text = f"bending: {key}, quadratic over linear, coarsest over finest"
            checks.append(check_below(text, quadratic[0][key] / linear[-1][key], most))
    return make_row(checks, runs=linear + quadratic)


def follow_bar(name: str, cells: tuple[int, ...], kind: type[q.Body]) -> Row:
    """A question of `validation.studies.qdem_cost`."""
    question, one = QUESTIONS[name], solve_by_qdem(QUESTIONS[name], list(cells), kind=kind)
    error = question.error(one.times, one.displacement, question.reference()[0])
    cost = sum(one.cost.values())
    return {"elements": one.elements, "step_s": one.step, "error": error, "cost_s": cost}


def squeeze_grain(force: float, level: int, kind: type[q.Body]) -> Row:
    """A grain of flat faces; the error is that of its force at rest over ``force`` [N]."""
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
    found = 2 * run.energy().elastic / SQUEEZE
    run.advance(2 * run.step)  # compiles
    started = time.process_time()
    run.advance(MARCH)
    cost, error = time.process_time() - started, found / force - 1
    return {"elements": len(body.elements), "step_s": run.step, "error": error, "cost_s": cost}


def squeeze() -> Row:
    """The grain on all meshes."""
    force = 1 + squeeze_grain(1.0, GRAIN[0][-1], q.QuadraticBody)["error"]
    return measure("grain", 0.5, GRAIN, partial(squeeze_grain, force))


PARTS = {
    "bending": lambda: measure("bending", 0.1, BAR, partial(follow_bar, "bending")),
    "pulse": lambda: measure("pulse", np.inf, BAR, partial(follow_bar, "pulse")),
    "grain": squeeze,
}
