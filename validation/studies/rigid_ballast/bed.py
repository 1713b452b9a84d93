"""A ballast bed in the plane: poured, tamped, loaded cyclically; by rigid or by soft grains."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from time import process_time

import numpy as np
from numpy.typing import NDArray

from rigid_lcp.motion.state import Motion, replace_rates
from rigid_lcp.motion.world import Scene, make_world
from rigid_lcp.scene.file import build_scene, load_scene, make_loads
from rigid_lcp.scene.simulation import Simulation
from validation.studies.rigid_ballast.soft import advance_grains, soften_grains

Floats = NDArray[np.float64]

SCENE = Path(__file__).parents[3] / "trackbed" / "scenes" / "ballast-2d.toml"
TAMPED, REST, PERIOD = 0.9, 0.05, 0.04
"""When the bed is tamped, time under the least load before the first cycle, length of one [s]."""
LEAST, PEAK, LATERAL = 1e3, 25e3, 0.2
"""Least and greatest load of the sleeper [N per metre of track], and the greatest push to and fro
over what a wheel adds to the vertical load [-]."""
FRICTION = 0.6
PREPARED_STEP, PREPARED_TOLERANCE = 2e-3, 1e-6
"""Step [s] and residual [-] of pouring and tamping."""


@dataclass(frozen=True)
class Moment:
    """The sleeper and the bodies' energy at the end of half a cycle or of a whole one."""

    height: float
    """Of the sleeper [m]."""
    tilt: float
    """[rad]"""
    energy: float
    """Kinetic and gravitational energy of all bodies [J]."""
    work: float
    """Work of the load so far [J]."""
    overlap: float
    """Greatest overlap of any two bodies [m]."""
    cpu: float
    """Processor time so far [s]."""
    steps: int
    residual: float
    """Worst scale-free residual of any step so far; zero for soft grains [-]."""


def prepare_bed(seed: int) -> tuple[Scene, Motion]:
    """The scene of a seed and its tamped state at rest."""
    seeds = [f"grains.{k}.seed={seed + 1000 * k}" for k in range(3)]
    file = load_scene(SCENE, seeds)
    scene = build_scene(file)
    loads = make_loads(file)
    run = Simulation(scene, step=PREPARED_STEP, tolerance=PREPARED_TOLERANCE, loads=loads)
    run.advance(TAMPED)
    return scene, replace_rates(run.motion, 0 * run.motion.rates)


def find_load(time: Floats | float) -> Floats:
    """Load of the sleeper (m, 2) [N] at m times [s] from the begin of the first cycle."""
    times = np.atleast_1d(np.asarray(time, dtype=float))
    angle = 2 * np.pi * np.maximum(times, 0.0) / PERIOD
    wheel = PEAK - LEAST
    down = LEAST + wheel * (0.5 - 0.5 * np.cos(angle))
    return np.column_stack([LATERAL * wheel * np.sin(angle), -down])


def find_sleeper(scene: Scene) -> int:
    """Number of the sleeper."""
    return next(n for n, body in enumerate(scene.bodies) if body.name == "sleeper")


def find_overlap(scene: Scene, motion: Motion) -> float:
    """Greatest overlap of any two bodies in a state [m]."""
    return max(0.0, -float(make_world(scene)[0].contacts(motion, 0.0).gap.min(initial=0.0)))


def load_rigid(
    scene: Scene, start: Motion, cycles: int, step: float, tolerance: float
) -> Iterator[Moment]:
    """Load cycles by `rigid_lcp` with steps of ``step`` [s] at most: after the rest and after
    every half cycle."""
    body, spent, work = find_sleeper(scene), 0.0, 0.0
    forces = np.zeros((len(scene.bodies), 3))

    def find_loads(time: float, motion: Motion) -> Floats:
        forces[body, :2] = find_load(time - REST)[0]
        return forces

    run = Simulation(scene, step=step, tolerance=tolerance, loads=find_loads)
    run.motion = start
    for part in range(2 * cycles + 1):
        seconds = REST if part == 0 else PERIOD / 2
        steps = int(np.ceil(seconds / step - 1e-9))
        for _ in range(steps):
            before, begin = run.positions[body].copy(), process_time()
            run.advance(seconds / steps)
            spent += process_time() - begin
            work += float(forces[body, :2] @ (run.positions[body] - before))
        yield Moment(
            float(run.positions[body, 1]), float(run.angles[body]), run.energy, work,
            find_overlap(scene, run.motion), spent, run.steps, run.worst_residual,
        )  # fmt: skip


def load_soft(
    scene: Scene, start: Motion, cycles: int, stiffness: float, share: float
) -> Iterator[Moment]:
    """The same load cycles by soft grains of normal stiffness ``stiffness`` [N/m]."""
    world = make_world(scene)[0]
    run = soften_grains(world, start, stiffness, FRICTION, share)
    body, spent = find_sleeper(scene), 0.0
    for part in range(2 * cycles + 1):
        seconds = REST if part == 0 else PERIOD / 2
        since = -REST if part == 0 else PERIOD / 2 * (part - 1)
        forces = find_load(since + np.linspace(0, seconds, 41))
        begin = process_time()
        advance_grains(run, body, forces, seconds)
        spent += process_time() - begin
        yield Moment(
            float(run.motion.position[body, 1]), float(run.motion.angle[body]),
            world.energy(run.motion), run.work, find_overlap(scene, run.motion), spent, run.steps,
            0.0,
        )  # fmt: skip
