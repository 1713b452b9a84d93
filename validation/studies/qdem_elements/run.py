"""The parts: bending, pulse, grain."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial

import numpy as np
import skfem
from skfem.models.elasticity import lame_parameters, linear_elasticity

import qdem_fem as q
from qdem_fem.grains.hulls import make_flat_form, place_corners_apart
from qdem_fem.grains.meshing import make_grain_tetrahedra
from validation.bench.qdem.checks import check_below, make_row, report
from validation.case import Check
from validation.studies.qdem_cost.methods import SAFETY, solve_by_qdem
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
"""How often each tetrahedron of the grain is cut into eight."""
CORNERS, RADIUS = 8, 0.025  # of the grain; from its middle to a corner [m]
ROCK = q.Material(young=50e9, poisson=0.2, density=2700.0)
SQUEEZE, MARCH = 1e-6, 1e-3  # motion of one face towards the other [m]; time that is timed [s]

Found = tuple[int, float, float, float]
"""Elements; critical step times its safety [s]; error; processor time [s]."""


def measure(element: str, answer: Callable[[type[q.Body]], Found]) -> Row:
    """The median of some runs by their cost: the first may compile."""
    found = sorted((answer(KINDS[element]) for _ in range(REPEATS)), key=lambda one: one[-1])
    names = ("element", "elements", "step_s", "error", "cost_s")
    return dict(zip(names, (element, *found[REPEATS // 2]), strict=True))


def follow_bar(name: str, cells: tuple[int, ...], kind: type[q.Body]) -> Found:
    """A question of `validation.studies.qdem_cost`, answered with a kind of element."""
    question = QUESTIONS[name]
    one = solve_by_qdem(question, list(cells), kind=kind)
    error = question.error(one.times, one.displacement, question.reference()[0])
    return one.elements, one.step, error, sum(one.cost.values())


def ask(name: str) -> Row:
    """A question on all meshes."""
    runs = [
        measure(element, partial(follow_bar, name, cells))
        for element, meshes in BAR.items()
        for cells in meshes
    ]
    return make_row(compare(name, runs, 0.1 if name == "bending" else np.inf), runs=runs)


def compare(name: str, runs: list[Row], share: float) -> list[Check]:
    """Both elements on the coarsest mesh that both have, and beyond; ``share``: greatest of the
    linear ones' error that quadratic ones may leave."""
    linear, quadratic = ([r for r in runs if r["element"] == kind] for kind in KINDS)
    one, other = next((a, b) for a in linear for b in quadratic if a["elements"] == b["elements"])
    left = other["error"] / one["error"], f"{name}: error of quadratic elements over linear ones'"
    bar = report(left[1], left[0]) if share == np.inf else check_below(left[1], left[0], share)
    checks = [
        bar,
        report(f"{name}: cost of the same", other["cost_s"] / one["cost_s"]),
        report(f"{name}: step of the same", other["step_s"] / one["step_s"]),
    ]
    if name == "bending":
        coarse, fine = quadratic[0], linear[-1]
        for what, key, most in (("error", "error", 1.0), ("cost", "cost_s", 0.01)):
            text = f"bending: {what} of the coarsest quadratic mesh over the finest linear one's"
            checks.append(check_below(text, coarse[key] / fine[key], most))
    return checks


def make_grain(level: int) -> tuple[skfem.MeshTet, list[np.ndarray]]:
    """A grain, and its nodes (k,) on the lowest and on the highest of its faces."""
    form = make_flat_form(place_corners_apart(np.random.default_rng(1), CORNERS))
    coarse = make_grain_tetrahedra(RADIUS * form.nodes, form.corner_faces)
    mesh = skfem.MeshTet(coarse.nodes.T.copy(), coarse.elements.T.copy()).refined(level)
    corners = coarse.nodes[form.corner_faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    chosen = [int(normal[:, 2].argmin()), int(normal[:, 2].argmax())]
    heights = [(mesh.p.T - corners[face, 0]) @ normal[face] for face in chosen]
    return mesh, [np.flatnonzero(abs(height) < 1e-9 * RADIUS) for height in heights]


def squeeze_grain(level: int, force: float, kind: type[q.Body]) -> Found:
    """Its force at rest over that of the reference [N], less 1; the cost of marching on."""
    mesh, (low, high) = make_grain(level)
    body = kind(mesh, ROCK)
    run = q.Simulation([body], threads=1, safety=SAFETY)
    run.fix(body, low)
    run.fix(body, high, "xy")
    run.prescribe(body, high, "z", -SQUEEZE)
    run.relax()
    found = 2 * run.energy().elastic / SQUEEZE
    run.advance(2 * run.step)
    started = time.process_time()
    run.advance(MARCH)
    return len(body.elements), run.step, found / force - 1, time.process_time() - started


def find_force(level: int) -> float:
    """The force [N] by scikit-fem's quadratic elements."""
    mesh, (low, high) = make_grain(level)
    basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementTetP2()))
    lame = lame_parameters(float(ROCK.young), float(ROCK.poisson))
    stiffness = linear_elasticity(*lame).assemble(basis)
    faces = [np.flatnonzero(np.isin(mesh.facets, nodes).all(axis=0)) for nodes in (low, high)]
    held, moved = (basis.get_dofs(one) for one in faces)
    u = basis.zeros()
    u[moved.all("u^3")] = -SQUEEZE
    u = skfem.solve(*skfem.condense(stiffness, x=u, D=np.union1d(held.flatten(), moved.flatten())))
    return float(u @ stiffness @ u) / SQUEEZE


def squeeze() -> Row:
    """The grain on all meshes."""
    coarse, fine = (find_force(level) for level in GRAIN["linear"][-2:])
    runs = [
        measure(element, partial(squeeze_grain, level, fine))
        for element, levels in GRAIN.items()
        for level in levels
    ]
    checks = compare("grain", runs, 0.5)
    checks.append(
        report("grain: force of the reference on the mesh before, less 1", coarse / fine - 1)
    )
    return make_row(checks, runs=runs)


PARTS = {"bending": partial(ask, "bending"), "pulse": partial(ask, "pulse"), "grain": squeeze}
