"""A ballast bed in the plane: poured, tamped, loaded cyclically; by rigid or by soft grains.

The bed is that of ``scenes/ballast-2d.toml``.  Pouring and tamping are done once a seed, by rigid
grains; every method then starts from that state at rest, so that what differs is the method.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigid_lcp.errors import SceneError
from rigid_lcp.motion import Motion, motion_with_rates
from rigid_lcp.scene import Scene, World, world_of
from rigid_lcp.scene_file import loads_of, scene_build, scene_read
from rigid_lcp.simulation import Simulation
from validation.rigid_ballast_md import soft_advance, soft_grains

Floats = NDArray[np.float64]
Row = dict[str, Any]

SCENE = Path(__file__).parents[1] / "scenes" / "ballast-2d.toml"
TAMPED = 1.0
"""Time at which the bed of the scene is tamped and the traffic begins [s]."""
REST = 0.05
"""Time under the least load before the first cycle [s]."""
PERIOD = 0.04
"""Length of a load cycle [s]: 25 Hz."""
LEAST = 1e3
"""Load of the sleeper between two wheels [N per metre of track]."""
FRICTION = 0.6
UPRIGHT = 0.25
"""Greatest angle of the sleeper after tamping [rad]; a bed where it is larger is not used."""
PREPARED_STEP, PREPARED_TOLERANCE = 2e-3, 1e-6
"""Step [s] and residual [-] of pouring and tamping."""


@dataclass(frozen=True)
class Bed:
    """What a bed is made of; the default is the scene's."""

    seed: int
    stones: int = 40
    width: float = 0.30
    """Distance of the walls [m]."""
    sleeper: float = 0.14
    """Width of the sleeper [m]."""
    peak: float = 25e3
    """Greatest vertical load of a cycle [N per metre of track]."""
    lateral: float = 0.25
    """Lateral over vertical part of what a wheel adds to the load, as in a curve [-]."""

    def scene_words(self) -> list[str]:
        """Overrides of the scene file."""
        half = 0.5 * self.width
        high = 0.05 + 0.48 * (self.stones / 40) * (0.30 / self.width)
        return [
            f"grains.0.seed={self.seed}", f"grains.0.count={self.stones}",
            f"grains.0.region_low=[{-half}, 0.0]", f"grains.0.region_high=[{half}, 0.6]",
            f"ground.1.offset={-half}", f"ground.2.offset={-half}",
            f"body.0.box=[{self.sleeper}, 0.05]", f"body.0.position=[0.0, {high}]",
            f"load.3.force=[{self.lateral * (self.peak - LEAST)}, {-self.peak}]",
        ]  # fmt: skip


def bed_prepared(bed: Bed) -> tuple[Scene, Motion, float]:
    """The scene, its tamped state at rest and the processor time that took [s].

    Raises `SceneError` where the sleeper does not lie flat: such a bed would be tamped again.
    """
    file = scene_read(SCENE, bed.scene_words())
    scene = scene_build(file)
    run = Simulation(scene, step=PREPARED_STEP, tolerance=PREPARED_TOLERANCE, loads=loads_of(file))
    start = process_time()
    run.advance(TAMPED)
    if abs(tilt := float(run.angles[sleeper_of(scene)])) > UPRIGHT:
        raise SceneError(
            f"the sleeper is tilted by {tilt:.2f} rad after tamping", where=f"seed {bed.seed}",
            remedy="use another seed",
        )  # fmt: skip
    return scene, motion_with_rates(run.motion, 0 * run.motion.rates), process_time() - start


def bed_scene(bed: Bed) -> Scene:
    """The scene alone, as it is before anything falls."""
    return scene_build(scene_read(SCENE, bed.scene_words()))


def load_at(bed: Bed, time: Floats | float) -> Floats:
    """Load of the sleeper (m, 2) [N] at m times [s] from the begin of the first cycle."""
    times = np.atleast_1d(np.asarray(time, dtype=float))
    phase = np.where(times < 0, 0.0, 0.5 - 0.5 * np.cos(2 * np.pi * times / PERIOD))
    wheel = (bed.peak - LEAST) * phase
    return np.column_stack([bed.lateral * wheel, -LEAST - wheel])


@dataclass(frozen=True)
class Moment:
    """The sleeper and the contacts at the end of half a cycle (loaded) or of a whole one."""

    cycle: float
    """Cycles so far: 0 after the rest, then 0.5, 1, 1.5, ..."""
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
    bed: Bed, scene: Scene, start: Motion, cycles: int, step: float, tolerance: float
) -> Iterator[Moment]:
    """Load cycles by `rigid_lcp` with steps of ``step`` [s] at most; twice a cycle a moment."""
    body, spent, work = sleeper_of(scene), 0.0, 0.0
    forces = np.zeros((len(scene.bodies), 3))

    def loads(time: float, motion: Motion) -> Floats:
        forces[body, :2] = load_at(bed, time - REST)[0]
        return forces

    run = Simulation(scene, step=step, tolerance=tolerance, loads=loads)
    run.motion = start
    for half in range(2 * cycles + 1):
        seconds = REST if half == 0 else 0.5 * PERIOD
        count = int(np.ceil(seconds / step - 1e-9))
        for _ in range(count):
            before, begin = run.positions[body].copy(), process_time()
            run.advance(seconds / count)
            spent += process_time() - begin
            work += float(forces[body, :2] @ (run.positions[body] - before))
        found = run.contacts
        contacts = {
            "bodies": np.column_stack([found.body_a, found.body_b]), "point": found.point,
            "normal": found.normal, "gap": found.gap,
            "force": np.column_stack([found.normal_force, found.tangential_force]),
        }  # fmt: skip
        place = np.append(run.positions[body], run.angles[body])
        yield Moment(0.5 * half, place, run.energy, work, run.motion, contacts, spent, run.steps,
                     run.worst_residual)  # fmt: skip


def soft_moments(
    bed: Bed, scene: Scene, start: Motion, cycles: int, stiffness: float, share: float
) -> Iterator[Moment]:
    """The same load cycles by soft grains of normal stiffness ``stiffness`` [N/m]."""
    world: World = world_of(scene)[0]
    run = soft_grains(world, start, stiffness, FRICTION, share)
    body, spent = sleeper_of(scene), 0.0
    for half in range(2 * cycles + 1):
        seconds = REST if half == 0 else 0.5 * PERIOD
        since = -REST if half == 0 else 0.5 * PERIOD * (half - 1)
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
        yield Moment(0.5 * half, place, world.energy(run.motion), run.work, run.motion, contacts,
                     spent, run.steps, 0.0)  # fmt: skip
