"""Bounces that get shorter without end, when they are over, and where they are cut off."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import ceil, nan, sqrt

import numpy as np
from numpy.typing import NDArray

from rigid_lcp.lasting_contacts import REST_SPEED
from rigid_lcp.motion import Motion
from rigid_lcp.simulation import Simulation
from rigid_lcp.simulation_input import Method
from validation.rigid_scene_peers import peer_run, scene_data
from validation.rigid_scenes import G, bouncing_disc, bouncing_time

Floats = NDArray[np.float64]
REST = 1e-3
"""A disc rests when its speed stays below this share of that of its first impact."""


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
    """When the speed was last `REST` of the first impact's [s]: the end of flight k.

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
    """Ours; a load of nothing notes times and speeds, as in `rigid_integration_steps`."""
    noted = list[tuple[float, float]]()

    def note(now: float, motion: Motion) -> Floats:
        noted.append((now, abs(float(motion.velocity[0, 1]))))
        return np.zeros((2, 3))

    scene = bouncing_disc(height, restitution).world.scene
    run = Simulation(scene, method, step=step, loads=note)
    start = time.process_time()
    run.advance(1.1 * bouncing_time(height, restitution))
    cost = time.process_time() - start
    rest = _rest(noted, sqrt(2 * G * height))
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
    noted = [(step * (k + 1), abs(float(v))) for k, v in enumerate(made.path[:, 0, 4])]
    rest = _rest(noted, sqrt(2 * G * height))
    error = abs(rest / rest_time(height, restitution) - 1)
    return Zeno(restitution, made.engine, step, rest, error, 0, made.cpu_s, steps, "", True)


def _rest(noted: Sequence[tuple[float, float]], first: float) -> float:
    """The first time noted after the last speed of `REST` times ``first`` [m/s]; NaN if none."""
    moving = [k for k, (_, speed) in enumerate(noted) if speed >= REST * first]
    return noted[moving[-1] + 1][0] if moving[-1] + 1 < len(noted) else nan


def zeno_rows(quick: bool, peers: bool) -> Iterator[Zeno]:
    """Restitution 0.5 and 0.9, at several steps."""
    for restitution in (0.5,) if quick else (0.5, 0.9):
        yield zeno("acceleration", 1e-2, restitution)
        for step in (4e-3, 1e-3) if quick else (4e-3, 1e-3, 2.5e-4):
            yield zeno("time-stepping", step, restitution)
        for engine in ("mujoco", "ode", "lmgc90") if peers else ():
            for step in (4e-3, 1e-3, 2.5e-4):
                yield zeno_peer(engine, step, restitution)
