"""Bounces that get shorter without end, when they are over, and where they are cut off."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import ceil, nan, sqrt

import numpy as np

from rigid_lcp.lasting_contacts import REST_SPEED
from rigid_lcp.simulation import Simulation
from rigid_lcp.simulation_input import Method
from validation.rigid_integration_steps import STAGES, Attempts
from validation.rigid_scene_peers import peer_run, scene_data
from validation.rigid_scenes import G, bouncing_disc, bouncing_time

REST = 1e-3
"""A disc rests when it stays to land with less than this share of the speed of its first impact."""


@dataclass(frozen=True)
class Zeno:
    """A disc that bounces until it rests."""

    restitution: float
    method: str
    step: float
    rest: float
    """When it was at rest [s]; NaN where it never was."""
    error: float
    """Relative, of the time to rest."""
    collisions: int
    """Impacts met one by one; 0 where steps hold several."""
    cpu_s: float
    steps: int
    why: str = ""
    peer: bool = False


def rest_time(height: float, restitution: float) -> float:
    """When it last landed with `REST` of the first impact's speed [s]: the end of flight k.

    k is the last with ``e^k >= REST``; after it ``2 v e^(k+1) / (g (1-e))`` are left of
    `bouncing_time`.
    """
    flights = int(np.floor(np.log(REST) / np.log(restitution)))
    speed = sqrt(2 * G * height)
    left = 2 * speed * restitution ** (flights + 1) / (G * (1 - restitution))
    return bouncing_time(height, restitution) - left


def cut_off(height: float, restitution: float, radius: float = 0.1) -> float:
    """Most of the time of bounces that the stated cut-off leaves out, relative to all of it.

    Approaches below ``REST_SPEED sqrt(g R)`` do not bounce: `rigid_lcp.lasting_contacts`.
    """
    left = 2 * REST_SPEED * sqrt(G * radius) / (G * (1 - restitution))
    return left / bouncing_time(height, restitution)


def zeno(method: Method, step: float, restitution: float, height: float = 0.1) -> Zeno:
    """Ours; noted after each step, and at acceleration level where the steps of its own begin."""
    scene = bouncing_disc(height, restitution).world.scene
    begun = Attempts(len(scene.bodies))
    run = Simulation(scene, method, step=step, loads=begun if method == "acceleration" else None)
    floor, cost, noted = run.positions[0, 1] - height, 0.0, list[tuple[float, float, float]]()
    while run.time < 1.1 * bouncing_time(height, restitution):
        start = time.process_time()
        run.advance(step)
        cost += time.process_time() - start
        noted.append((run.time, run.velocities[0, 1], run.positions[0, 1] - floor))
    for now, motion in zip(begun.times[::STAGES], begun.starts, strict=True):
        noted.append((now, motion.velocity[0, 1], motion.position[0, 1] - floor))
    rest = _rest(sorted(noted), sqrt(2 * G * height))
    wanted = rest_time(height, restitution)
    return Zeno(
        restitution, method, step, rest, abs(rest / wanted - 1), run.pace.collisions, cost,
        run.steps,
    )  # fmt: skip


def zeno_peer(engine: str, step: float, restitution: float, height: float = 0.1) -> Zeno:
    """A peer, judged alike."""
    scene = bouncing_disc(height, restitution).world.scene
    steps = ceil(1.1 * bouncing_time(height, restitution) / step)
    made = peer_run(engine, scene_data(scene, impacts=True), step, steps, every=1)
    if made.why:
        return Zeno(restitution, made.engine, step, nan, nan, 0, nan, 0, made.why, True)
    noted = [
        (step * (k + 1), float(frame[4]), height + float(frame[1]))
        for k, frame in enumerate(made.path[:, 0])
    ]
    rest = _rest(noted, sqrt(2 * G * height))
    error = abs(rest / rest_time(height, restitution) - 1)
    return Zeno(restitution, made.engine, step, rest, error, 0, made.cpu_s, steps, "", True)


def _rest(noted: Sequence[tuple[float, float, float]], first: float) -> float:
    """When the last flight ends that lands with `REST` times ``first`` [m/s] or more [s].

    From times [s], velocities [m/s] and heights [m]: it lands with ``w = sqrt(v^2 + 2 g z)``, after
    ``(v + w) / g``.  NaN where the last one noted is such a flight.
    """
    landing = [sqrt(v * v + 2 * G * max(z, 0.0)) for _, v, z in noted]
    flying = [k for k, w in enumerate(landing) if w >= REST * first]
    if flying[-1] + 1 == len(noted):
        return nan
    now, speed, _ = noted[flying[-1]]
    return float(now + (speed + landing[flying[-1]]) / G)


def zeno_rows(quick: bool, peers: bool) -> Iterator[Zeno]:
    """Restitution 0.5 and 0.9, at several steps."""
    for restitution in (0.5,) if quick else (0.5, 0.9):
        yield zeno("acceleration", 1e-2, restitution)
        for step in (4e-3, 1e-3) if quick else (4e-3, 1e-3, 2.5e-4):
            yield zeno("time-stepping", step, restitution)
        for engine in ("mujoco", "ode", "lmgc90") if peers else ():
            for step in (4e-3, 1e-3, 2.5e-4):
                yield (row := zeno_peer(engine, step, restitution))
                if row.why:
                    break
