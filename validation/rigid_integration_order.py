"""Error against step and cost of both methods, and of rivals, on motions whose answer is known.

A `Problem` is a scene of `validation.rigid_integration_scenes`; its error is the greatest
difference of any coordinate of its body from the answer, at the end.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from math import isfinite, nan

import numpy as np
from numpy.typing import NDArray

from rigid_lcp.errors import RigidError
from rigid_lcp.rotations import quaternion_of_matrix, rotation_matrix
from rigid_lcp.scene import Scene
from rigid_lcp.simulation import Simulation
from rigid_lcp.simulation_input import Method
from validation import rigid_integration_scenes as motions
from validation.rigid_scene_peers import PeerScene, peer_run, scene_data, unless_it_falls
from validation.rigid_scenes import rocking_block

Floats = NDArray[np.float64]
METHODS: tuple[Method, ...] = ("acceleration", "time-stepping")
PEER_STEPS = (4e-3, 1e-3, 2.5e-4, 5e-5)
ROCKING = (0.2, 1.0, 0.5 * float(np.arctan2(0.2, 1.0)))
"""Half width, half height [m], lean [rad] of the rocking block."""


def coordinates(run: Simulation) -> Floats:
    """Centre [m] and angle [rad] of body 0."""
    return np.array([*run.positions[0], run.angles[0]])


def coordinates_of_peer(scene: Scene, made: PeerScene) -> Floats:
    """The same at the end of a peer's path."""
    body = scene.bodies[0]
    return np.array([*body.position, body.angle[0]]) + made.displacement[0]


@dataclass(frozen=True)
class Problem:
    """A motion with a known answer."""

    name: str
    answer: str
    """Where the answer is from."""
    seconds: float
    build: Callable[[Method, float], Simulation]
    exact: Callable[[float], Floats]
    steps: dict[Method, tuple[float, ...]]
    """Steps of each method, falling [s]."""
    peers: tuple[str, ...]
    place: Callable[[Simulation], Floats] = coordinates
    turned: bool = False
    """Coordinates are a quaternion, told up to its sign; the error is an angle [rad]."""

    def error(self, found: Floats) -> float:
        """Greatest error of a coordinate [m, rad]."""
        wanted = answer_of(self.name)
        if self.turned:
            return 2.0 * float(np.linalg.norm(found * np.sign(found @ wanted) - wanted))
        return float(np.abs(found - wanted).max())


@dataclass(frozen=True)
class OrderRow:
    """One run of one problem."""

    problem: str
    method: str
    step: float
    """Longest step [s]."""
    error: float
    """Greatest error of a coordinate at the end [m, rad]; NaN where the run did not end."""
    cpu_s: float
    steps: int
    why: str = ""
    peer: bool = False


def halved(first: float, count: int) -> tuple[float, ...]:
    """Steps that halve."""
    return tuple(first / 2**k for k in range(count))


PROBLEMS = (
    Problem(
        "disc skids, then rolls", "closed form", 0.5, motions.skidding_disc,
        motions.skidding_disc_answer,
        {"acceleration": halved(0.05, 4), "time-stepping": halved(1.6e-2, 6)}, ("mujoco", "ode"),
    ),
    Problem(
        "stone in free flight", "Euler's equations", 0.08, motions.stone_in_flight,
        motions.stone_in_flight_answer,
        {"acceleration": halved(4e-3, 5), "time-stepping": halved(4e-3, 6)},
        ("mujoco", "mujoco RK4", "ode"), lambda run: run.angles[0], turned=True,
    ),
    Problem(
        "prism slides and turns", "its equations of motion", 0.12, motions.sliding_prism,
        motions.sliding_prism_answer,
        {"acceleration": halved(0.02, 5), "time-stepping": halved(8e-3, 5)}, (),
        motions.sliding_prism_place,
    ),
    Problem(
        "rod tips over an edge", "its equations of motion", 0.3, motions.rod_over_edge,
        motions.rod_over_edge_answer,
        {"acceleration": halved(0.05, 6), "time-stepping": halved(8e-3, 6)},
        ("mujoco", "ode", "lmgc90"),
    ),
    Problem(
        "block rocks, two impacts", "Housner's equations", 1.1,
        lambda method, step: rocking_block(*ROCKING, method=method, step=step),
        lambda seconds: motions.rocking_block_state(*ROCKING, seconds),
        {"acceleration": halved(0.02, 4), "time-stepping": halved(8e-3, 6)},
        ("mujoco", "ode", "lmgc90"),
    ),
    Problem(
        "box falls on its corner", "acceleration level at a step of 1.25 ms", 0.3,
        motions.falling_box, lambda seconds: converged(motions.falling_box, 1.25e-3, seconds),
        {"acceleration": halved(0.04, 5), "time-stepping": halved(8e-3, 6)}, ("ode",),
    ),
)  # fmt: skip


@cache
def answer_of(name: str) -> Floats:
    """The answer of a problem, found once."""
    problem = next(each for each in PROBLEMS if each.name == name)
    return problem.exact(problem.seconds)


def converged(build: Callable[[Method, float], Simulation], step: float, seconds: float) -> Floats:
    """Where a motion without closed form ends: Runge-Kutta at a step far below those judged."""
    run = build("acceleration", step)
    run.advance(seconds)
    return coordinates(run)


def order_row(problem: Problem, method: Method, step: float) -> OrderRow:
    """One run of ours."""
    run, error, why = problem.build(method, step), nan, ""
    start = time.process_time()
    try:
        run.advance(problem.seconds)
    except RigidError as failure:
        why = f"{type(failure).__name__}: {failure}"
    cost = time.process_time() - start
    if not why:
        error = problem.error(problem.place(run))
    return OrderRow(problem.name, method, step, error, cost, run.steps, why)


def peer_row(problem: Problem, engine: str, step: float) -> OrderRow:
    """One run of a peer."""
    steps = round(problem.seconds / step)
    if problem.turned:
        made = _top(engine, step, steps)
    else:
        scene = problem.build("time-stepping", step).world.scene
        data = scene_data(scene, impacts=True)
        made = peer_run(engine, data, problem.seconds / steps, steps)
        made = unless_it_falls(made, scene, problem.seconds)
    name = made.engine + engine.partition(" ")[1] + engine.partition(" ")[2]
    if made.why:
        return OrderRow(problem.name, name, step, nan, nan, 0, made.why, True)
    found = _orientation(made) if problem.turned else coordinates_of_peer(scene, made)
    error = problem.error(found) if np.isfinite(found).all() else nan
    why = "" if isfinite(error) else "the motion blew up"
    return OrderRow(problem.name, name, step, error, made.cpu_s, steps, why, True)


def _principal() -> tuple[Floats, Floats]:
    """Principal moments of the stone, over the greatest, and their axes as columns."""
    moments, axes = np.linalg.eigh(motions.STONE.mass_properties(motions.STONE_DENSITY)[1])
    axes[:, 2] *= np.sign(np.linalg.det(axes))
    return moments / moments.max(), axes


def _top(engine: str, step: float, steps: int) -> PeerScene:
    moments, axes = _principal()
    name, _, integrator = engine.partition(" ")
    top = {
        "inertia": moments.tolist(), "spin": (axes.T @ motions.STONE_SPIN).tolist(),
        "integrator": integrator or "Euler",
    }  # fmt: skip
    return peer_run(name, {"top": top}, step, steps)


def _orientation(made: PeerScene) -> Floats:
    """The quaternion of the stone, from that of its principal axes."""
    _, axes = _principal()
    return quaternion_of_matrix(axes @ rotation_matrix(made.path[-1, 0]) @ axes.T)


def order_rows(
    quick: bool, peers: bool, problems: Sequence[Problem] = PROBLEMS
) -> Iterator[OrderRow]:
    """Every problem at every step, by ours and, where asked for, the peers; a row as it ends.

    ``quick``: the two longest steps only.
    """
    for problem in problems:
        for method in METHODS:
            order_row(problem, method, problem.steps[method][0])  # compiles
            for step in problem.steps[method][: 2 if quick else None]:
                yield order_row(problem, method, step)
        for engine in problem.peers if peers else ():
            for step in PEER_STEPS:
                yield (row := peer_row(problem, engine, step))
                if not row.steps:
                    break


def order_fitted(rows: Sequence[OrderRow], least: float = 1e-11) -> float:
    """Slope of log error against log step by least squares; NaN where fewer than two are above.

    Errors below ``least`` are round-off.
    """
    points = [(row.step, row.error) for row in rows if row.error > least]
    if len(points) < 2:
        return nan
    step, error = np.log(np.array(points)).T
    return float(np.polyfit(step, error, 1)[0])
