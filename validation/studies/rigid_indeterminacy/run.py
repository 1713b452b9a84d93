"""All ways to the forces of each scene, and other orders and starts on pyramids."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from statistics import median
from time import process_time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigid_lcp.friction.problem.definition import FrictionProblem
from rigid_lcp.unique.elastic_limit import find_elastic_limit
from rigid_lcp.unique.micro_displacements import relax_displacements
from validation.bench.rigid.static_grains import (
    Grains,
    build_beam,
    build_groove,
    build_pyramid,
    build_wedge,
    renumber,
)
from validation.studies.rigid_indeterminacy.liggghts import has_liggghts, settle_liggghts
from validation.studies.rigid_indeterminacy.springs import settle_springs

Floats = NDArray[np.float64]
Row = dict[str, Any]
RELAXATION, SPRINGS, LIGGGHTS = "relaxation", "springs", "LIGGGHTS"
SLOW = 30_000
"""Steps of loading where contacts stick."""
STIFFNESS = (1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10)
"""Of the springs, in weights of all grains a metre."""


@dataclass(frozen=True)
class Scene:
    """A scene and how it is loaded."""

    make: Callable[[], Grains]
    friction: float = 0.0
    discs: bool = False
    """LIGGGHTS can have it."""
    slides: bool = False
    """Contacts slide in the limit: what counts is the time of loading."""

    def settings(self) -> list[tuple[float, int]]:
        """Stiffness and steps of loading of the springs' runs."""
        if self.slides:
            ramps = (0, 1_000, 3_000, 10_000, SLOW, 100_000, 300_000)
            return [(1e7, ramp) for ramp in ramps]
        if self.friction:
            others = [(1e6, ramp) for ramp in (0, SLOW // 10, 10 * SLOW)]
            return [*others, *((k, SLOW) for k in STIFFNESS)]
        return [(k, 0) for k in STIFFNESS]


SCENES = {
    "beam on three supports": Scene(build_beam),
    "wedge in a V": Scene(build_wedge),
    "wedge in a V, sticking": Scene(build_wedge, 5.0),
    "disc in a groove, sticking": Scene(build_groove, 5.0, True),
    "pyramid of 15": Scene(partial(build_pyramid, 5, walls=True), 0.0, True),
    "pyramid of 55": Scene(partial(build_pyramid, 10, walls=True), 0.0, True),
    "pyramid of 15, friction 0.3": Scene(partial(build_pyramid, 5, walls=True), 0.3, True, True),
    "pyramid of 55, friction 0.3": Scene(partial(build_pyramid, 10, walls=True), 0.3, True, True),
}
PILES = (6, 12, 16, 20, 30)
"""Rows of the pyramids whose order and start are changed."""


def count_sliding(force: Floats, friction: float) -> int:
    """Contacts that are at Coulomb's limit; ``force`` (nc, 2)."""
    at_limit = np.abs(force[:, 1]) >= friction * force[:, 0] * (1 - 1e-9)
    return int((at_limit & (force[:, 0] > 0)).sum()) if friction > 0 else 0


def find_closed_rows(problem: FrictionProblem, force: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """J, and which of its rows belong to contacts that carry ``force`` (nc, 2)."""
    assert problem.bodies is not None
    closed = force[:, 0] > 1e-12 * force.max()
    kept = np.column_stack([closed, closed & (problem.friction > 0)]).ravel()
    return problem.bodies.jacobian.toarray(), kept


def count_redundant(problem: FrictionProblem, force: Floats) -> int:
    """Free parameters of the forces of closed contacts: their number less the rank of J there."""
    rows, kept = find_closed_rows(problem, force)
    return int(kept.sum() - np.linalg.matrix_rank(rows[kept]))


def minimise_energy(problem: FrictionProblem, force: Floats, fall: Floats) -> Floats:
    """``argmin sum f^2`` in balance with ``fall`` (ndof,) over closed contacts, by dense least
    squares."""
    rows, kept = find_closed_rows(problem, force)
    found = np.zeros(len(kept))
    found[kept] = np.linalg.lstsq(rows[kept].T, -fall, rcond=1e-12)[0]
    return found


def measure_scene(scene: Scene) -> Row:
    """All ways to the forces of a scene."""
    settle_springs(build_groove(), 1e4, 0.0, steps_max=400)  # compiled before it is timed
    grains = scene.make()
    problem, weight = grains.problem(scene.friction), grains.weight
    costs = []
    for _ in range(6):
        began = process_time()
        answer = find_elastic_limit(problem)
        costs.append(process_time() - began)
    if not answer.solved:
        raise RuntimeError(answer.message)
    limit = answer.r.reshape(-1, 2)
    dense = None
    if not scene.slides:
        fall = np.column_stack([grains.mass[:, None] * grains.gravity, 0.0 * grains.mass]).ravel()
        dense = float(np.abs(minimise_energy(problem, limit, fall) - answer.r).max()) / weight
    runs = []

    def keep(method: str, began: float | None, force: Floats, cpu: float = 0.0, **more: Any) -> Row:
        cost = cpu if began is None else process_time() - began
        runs.append({
            "method": method, "error": float(np.abs(force - limit).max()) / weight,
            "residual": problem.residual(force.ravel()), "cpu_s": cost, **more,
        })  # fmt: skip
        return runs[-1]

    for asked in (1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12):
        began = process_time()
        relaxed = relax_displacements(problem, tolerance=asked, iterations_max=30_000)
        keep(RELAXATION, began, relaxed.r.reshape(-1, 2), asked=asked)
    for stiffness, ramp in scene.settings():
        began = process_time()
        rest = settle_springs(
            grains, stiffness * weight, scene.friction, ramp=ramp,
            tolerance=max(1e-11, 1e-14 * stiffness), steps_max=40_000 + ramp,
        )  # fmt: skip
        run = keep(SPRINGS, began, rest.force, stiffness=stiffness, ramp=ramp)
        if scene.slides and ramp >= SLOW:
            # whether the springs' forces are those of another state of eq. 38
            other = find_elastic_limit(problem, begin=stiffness * weight * rest.displacement).r
            run["other_state"] = float(np.abs(other - answer.r).max()) / weight
            run["from_it"] = float(np.abs(rest.force.ravel() - other).max()) / weight
        if scene.discs and has_liggghts():
            force, _, cpu = settle_liggghts(
                grains, stiffness * weight, scene.friction, ramp=ramp, steps=40_000 + ramp
            )
            keep(LIGGGHTS, None, force, cpu, stiffness=stiffness, ramp=ramp)
    return {
        "contacts": problem.contacts, "redundant": count_redundant(problem, limit),
        "sliding": count_sliding(limit, scene.friction), "dense": dense,
        "limit_cpu_s": float(median(costs[1:])), "runs": runs,
    }  # fmt: skip


def measure_order() -> Row:
    """Independence of the order of contacts and the numbers of bodies, on pyramids."""
    return {"piles": [try_order(rows, friction) for rows in PILES for friction in (0.0, 0.3, 5.0)]}


def try_order(rows: int, friction: float) -> Row:
    """A pyramid of so many rows: relative differences (2-norm) of all forces with contacts and
    bodies in random order."""
    grains = build_pyramid(rows, walls=friction < 1, seed=rows)
    problem = grains.problem(friction)
    rng = np.random.default_rng(rows)
    contact, body = rng.permutation(problem.contacts), rng.permutation(len(grains.mass))
    mixed = renumber(grains, contact, body).problem(friction)
    first = find_elastic_limit(problem)
    row: Row = {
        "pile": f"pyramid of {len(grains.mass)}, friction {friction:g}",
        "contacts": problem.contacts, "found": first.solved, "order": None,
        "sliding": count_sliding(first.r.reshape(-1, 2), friction),
    }  # fmt: skip
    if first.solved:
        other = find_elastic_limit(mixed)
        back = np.empty((problem.contacts, 2))
        back[contact] = other.r.reshape(-1, 2)
        row["order"] = float(np.linalg.norm(back.ravel() - first.r) / np.linalg.norm(first.r))
        row["found"] = other.solved
    return row


PARTS: dict[str, Callable[[], Row]] = {
    name: partial(measure_scene, scene) for name, scene in SCENES.items()
} | {"order": measure_order}
