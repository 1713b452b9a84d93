"""A ballast bed in the plane: poured, tamped, loaded cyclically; by rigid or by soft grains.

The bed is that of ``scenes/ballast-2d.toml``.  Pouring and tamping are done once a seed, by rigid
grains; every method then starts from that state at rest, so that what differs is the method.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import ceil
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigid_lcp.motion import Motion, motion_with_rates
from rigid_lcp.scene import Scene, World, world_of
from rigid_lcp.scene_file import loads_of, scene_build, scene_read
from rigid_lcp.simulation import Simulation
from validation.rigid_ballast_md import DAMPING, soft_advance, soft_grains

Floats = NDArray[np.float64]
Row = dict[str, Any]

SCENE = Path(__file__).parents[1] / "scenes" / "ballast-2d.toml"
TAMPED = 0.9
"""Time at which the bed of the scene is tamped and the traffic begins [s]."""
REST = 0.05
"""Time under the least load before the first cycle [s]."""
PERIOD = 0.04
"""Length of a load cycle [s]: 25 Hz."""
LEAST = 1e3
"""Load of the sleeper between two wheels [N per metre of track]."""
FRICTION = 0.6
PREPARED_STEP, PREPARED_TOLERANCE = 2e-3, 1e-6
"""Step [s] and residual [-] of pouring and tamping."""
CELL = 0.0525
"""Distance of the stones in the grid from which they fall [m]."""


@dataclass(frozen=True)
class Bed:
    """What a bed is made of; the default is the scene's."""

    seed: int
    stones: int = 72
    """Stones below the sleeper."""
    crib: int = 6
    """Stones on each side of it."""
    width: float = 0.43
    """Distance of the walls [m]."""
    sleeper: float = 0.18
    """Width of the sleeper [m]."""
    peak: float = 25e3
    """Greatest vertical load of a cycle [N per metre of track]."""
    lateral: float = 0.2
    """Greatest push to and fro over what a wheel adds to the vertical load [-]."""

    def scene_words(self) -> list[str]:
        """Overrides of the scene file."""
        half, beside = round(0.5 * self.width, 6), round(0.5 * self.sleeper + 0.003, 6)
        layers = ceil(self.stones / int(self.width / CELL))
        high = round(CELL * layers + 0.0475, 3)  # the sleeper falls after the stones below it
        cribs = round(high + 0.04, 3)
        push = self.lateral * (self.peak - LEAST)
        return [
            f"grains.0.seed={self.seed}", f"grains.0.count={self.stones}",
            f"grains.0.region_low=[{-half}, 0.0]", f"grains.0.region_high=[{half}, 0.6]",
            f"grains.1.seed={self.seed + 1000}", f"grains.1.count={self.crib}",
            f"grains.1.region_low=[{-half}, {cribs}]",
            f"grains.1.region_high=[{-beside}, {cribs + 0.24}]",
            f"grains.2.seed={self.seed + 2000}", f"grains.2.count={self.crib}",
            f"grains.2.region_low=[{beside}, {cribs}]",
            f"grains.2.region_high=[{half}, {cribs + 0.24}]",
            f"ground.1.offset={-half}", f"ground.2.offset={-half}",
            f"body.0.box=[{self.sleeper}, 0.06]", f"body.0.position=[0.0, {high}]",
            f"load.3.force=[0, {-self.peak}]", f"load.4.force=[{push}, 0]",
            f"load.4.least=[{-push}, 0]",
        ]  # fmt: skip


def bed_prepared(bed: Bed) -> tuple[Scene, Motion, float]:
    """The scene, its tamped state at rest and the processor time that took [s]."""
    file = scene_read(SCENE, bed.scene_words())
    scene = scene_build(file)
    run = Simulation(scene, step=PREPARED_STEP, tolerance=PREPARED_TOLERANCE, loads=loads_of(file))
    start = process_time()
    run.advance(TAMPED)
    return scene, motion_with_rates(run.motion, 0 * run.motion.rates), process_time() - start


def bed_scene(bed: Bed) -> Scene:
    """The scene alone, as it is before anything falls."""
    return scene_build(scene_read(SCENE, bed.scene_words()))


def load_at(bed: Bed, time: Floats | float) -> Floats:
    """Load of the sleeper (m, 2) [N] at m times [s] from the begin of the first cycle."""
    times = np.atleast_1d(np.asarray(time, dtype=float))
    angle = 2 * np.pi * np.maximum(times, 0.0) / PERIOD
    wheel = bed.peak - LEAST
    down = LEAST + wheel * (0.5 - 0.5 * np.cos(angle))
    return np.column_stack([bed.lateral * wheel * np.sin(angle), -down])


@dataclass(frozen=True)
class Moment:
    """The sleeper and the contacts at the end of half a cycle (loaded) or of a whole one."""

    cycle: float
    """Cycles so far: 0 after the rest, then, with two parts a cycle, 0.5, 1, 1.5, ..."""
    place: Floats
    """Sleeper x, y [m] and angle [rad]."""
    energy: float
    """Kinetic and gravitational energy of all bodies [J]."""
    work: float
    """Work of the load so far [J]."""
    motion: Motion
    contacts: Row
    """``bodies`` (nc, 2), ``point``, ``normal`` (nc, 2), ``gap`` [m], ``force`` (nc, 2) [N]."""
    cpu: float
    """Processor time so far [s]."""
    steps: int
    residual: float
    """Worst scale-free residual of any step so far; zero for soft grains [-]."""


def sleeper_of(scene: Scene) -> int:
    """Number of the sleeper."""
    return next(n for n, body in enumerate(scene.bodies) if body.name == "sleeper")


def rigid_moments(
    bed: Bed, scene: Scene, start: Motion, count: int, step: float, tolerance: float,
    parts: int = 2,
) -> Iterator[Moment]:  # fmt: skip
    """Load cycles by `rigid_lcp` with steps of ``step`` [s] at most.

    After the rest, ``count`` moments, ``parts`` in a cycle.
    """
    body, spent, work = sleeper_of(scene), 0.0, 0.0
    forces = np.zeros((len(scene.bodies), 3))

    def loads(time: float, motion: Motion) -> Floats:
        forces[body, :2] = load_at(bed, time - REST)[0]
        return forces

    run = Simulation(scene, step=step, tolerance=tolerance, loads=loads)
    run.motion = start
    for part in range(count + 1):
        seconds = REST if part == 0 else PERIOD / parts
        steps = int(np.ceil(seconds / step - 1e-9))
        for _ in range(steps):
            before, begin = run.positions[body].copy(), process_time()
            run.advance(seconds / steps)
            spent += process_time() - begin
            work += float(forces[body, :2] @ (run.positions[body] - before))
        found = run.contacts
        contacts = {
            "bodies": np.column_stack([found.body_a, found.body_b]), "point": found.point,
            "normal": found.normal, "gap": found.gap,
            "force": np.column_stack([found.normal_force, found.tangential_force]),
        }  # fmt: skip
        place = np.append(run.positions[body], run.angles[body])
        yield Moment(part / parts, place, run.energy, work, run.motion, contacts, spent, run.steps,
                     run.worst_residual)  # fmt: skip


def soft_moments(
    bed: Bed, scene: Scene, start: Motion, count: int, stiffness: float, share: float,
    parts: int = 2, damping: float = DAMPING,
) -> Iterator[Moment]:  # fmt: skip
    """The same load cycles by soft grains of normal stiffness ``stiffness`` [N/m]."""
    world: World = world_of(scene)[0]
    run = soft_grains(world, start, stiffness, FRICTION, share)
    run.damping = damping
    body, spent = sleeper_of(scene), 0.0
    for part in range(count + 1):
        seconds = REST if part == 0 else PERIOD / parts
        since = -REST if part == 0 else PERIOD / parts * (part - 1)
        times = since + np.linspace(0, seconds, 41)
        forces = load_at(bed, times)
        begin = process_time()
        soft_advance(run, body, forces, seconds)
        spent += process_time() - begin
        bodies, numbers, carried = run.contacts
        contacts = {
            "bodies": bodies, "point": numbers[:, :2], "normal": numbers[:, 2:4],
            "gap": numbers[:, 4], "force": carried,
        }  # fmt: skip
        place = np.append(run.motion.position[body], run.motion.angle[body])
        yield Moment(part / parts, place, world.energy(run.motion), run.work, run.motion, contacts,
                     spent, run.steps, 0.0)  # fmt: skip
