"""What section 9 does with its steps, and how far contacts drift in long runs.

Each stage of a Runge-Kutta step asks for the loads, so a load of nothing sees every step that is
tried: four times, of which the first is where it starts and the last where it ends.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from dataclasses import dataclass
from math import ceil, pi
from unittest import mock

import numpy as np
from numpy.typing import NDArray

from rigid_lcp import runge_kutta
from rigid_lcp.errors import RigidError
from rigid_lcp.motion import Motion
from rigid_lcp.scene import Scene
from rigid_lcp.shapes_2d import Disc, HalfSpace, Polygon
from rigid_lcp.simulation import Simulation
from rigid_lcp.simulation_input import Method
from validation.rigid_scenes import DENSITY

Floats = NDArray[np.float64]
STAGES = 4


class Attempts:
    """Loads of nothing that note the steps which are tried."""

    def __init__(self, bodies: int) -> None:
        self.none = np.zeros((bodies, 3))
        self.times: list[float] = []
        self.starts: list[Motion] = []

    def __call__(self, now: float, motion: Motion) -> Floats:
        if len(self.times) % STAGES == 0:
            self.starts.append(motion)
        self.times.append(now)
        return self.none

    def steps(self) -> list[tuple[float, float, bool]]:
        """Start [s] and length [s] of every step tried, and whether it was kept."""
        stages = np.array(self.times).reshape(-1, STAGES)
        start, length = stages[:, 0], stages[:, -1] - stages[:, 0]
        kept = np.append(start[1:] > start[:-1], True)
        rows = zip(start.tolist(), length.tolist(), kept.tolist(), strict=True)
        return [(begin, taken, was_kept) for begin, taken, was_kept in rows]


@dataclass(frozen=True)
class Trace:
    """The steps of a run at acceleration level."""

    scene: str
    way: str
    steps: list[tuple[float, float, bool]]
    """`Attempts.steps`."""
    longest: float
    """Longest step allowed [s]."""
    collisions: int
    overlap: float
    """Greatest overlap at the end of any kept step over the smallest body [-]."""
    cpu_s: float


def grains_in_a_box(seed: int) -> Scene:
    """Five discs and boxes that fly about in a trough; restitution 0.7, friction 0.3."""
    generator = np.random.default_rng(seed)
    scene = Scene(2)
    for k in range(5):
        shape = Disc(0.04) if k % 2 else Polygon.rectangle(0.07, 0.05)
        scene.add(
            shape, density=2700, position=(0.1 + 0.12 * (k % 3), 0.1 + 0.12 * (k // 3)),
            angle=generator.uniform(-1, 1), velocity=generator.uniform(-1, 1, 2), friction=0.3,
            restitution=0.7,
        )  # fmt: skip
    for normal, offset in (((0, 1), 0.0), ((1, 0), 0.0), ((-1, 0), -0.44)):
        scene.add(HalfSpace(normal, offset), restitution=0.7)
    return scene


WAYS = {"halving, as in section 9": False, "closing of the gap located": True}


def traces(seconds: float) -> Iterator[Trace]:
    """Grains in a box for a while [s], by the paper's halving alone and as the package has it."""
    longest = 5e-3
    for way, locating in WAYS.items():
        scene = grains_in_a_box(0)
        noted = Attempts(len(scene.bodies))
        run = Simulation(scene, "acceleration", step=longest, loads=noted)
        run.pace.locating = locating
        begin = time.process_time()
        run.advance(seconds)
        cost = time.process_time() - begin
        gaps = [run.world.contacts(motion, 0.0).gap.min(initial=0.0) for motion in noted.starts]
        overlap = max(0.0, -float(min(gaps))) / run.world.length
        yield Trace(
            "five grains in a trough", way, noted.steps(), longest, run.pace.collisions, overlap,
            cost,
        )  # fmt: skip


# --- drift: a disc that goes round another for long ---

ORBIT_RADII = (0.1, 0.3)
"""Radii of the disc that goes round and of the fixed one [m]."""
ORBIT_FRICTION = 0.5


def orbiting_disc(method: Method, step: float, friction: float) -> Simulation:
    """A disc (body 0) pressed on a fixed one (body 1) by a constant force to its middle.

    It goes round at 1 m/s, by pure rolling where there is friction: both are kept for ever.
    """
    small, large = ORBIT_RADII
    way = small + large
    scene = Scene(2, gravity=(0.0, 0.0))
    scene.add(
        Disc(small), density=DENSITY, position=(way, 0), velocity=(0, 1), friction=friction,
        spin=1 / small if friction else 0.0,
    )  # fmt: skip
    scene.add(Disc(large), fixed=True, position=(0, 0))
    press = 10.0 * scene.bodies[0].mass / way  # ten times what the bend asks for

    def towards_the_middle(_: float, motion: Motion) -> Floats:
        loads = np.zeros((2, 3))
        loads[0, :2] = -press * motion.position[0] / np.linalg.norm(motion.position[0])
        return loads

    return Simulation(scene, method, step=step, loads=towards_the_middle)


@dataclass(frozen=True)
class Drift:
    """How far a contact that never opens drifts in a long run."""

    scene: str
    method: str
    control: bool
    """Whether gaps are put back to zero after each step, as the package does."""
    step: float
    steps: int
    rounds: float
    gap: list[float]
    """Greatest gap or overlap over the disc's radius up to each tenth of the run [-]."""
    speed: float
    """Relative error of the speed at the end [-]."""
    cpu_s: float
    why: str = ""


def drift(method: Method, step: float, friction: float, rounds: float, control: bool) -> Drift:
    """A disc that goes round ``rounds`` times; ``control`` off leaves gaps as they come out.

    Off at acceleration level only.
    """
    run = orbiting_disc(method, step, friction)
    way, small = sum(ORBIT_RADII), ORBIT_RADII[0]
    tenth = ceil(rounds * 2 * pi * way / step / 10)
    gaps, why, begin = list[float](), "", time.process_time()
    worst = 0.0
    with nullcontext() if control else _uncontrolled():
        for _ in range(10):
            try:
                for _ in range(tenth):
                    run.advance(step)
                    off = float(np.linalg.norm(run.positions[0])) - way
                    worst = max(worst, abs(off) / small)
            except RigidError as error:
                why = f"{type(error).__name__}: {error}".splitlines()[0]
                break
            gaps.append(worst)
    speed = abs(float(np.linalg.norm(run.velocities[0])) - 1.0)
    scene = "disc rolls round a disc" if friction else "disc slides round a disc"
    return Drift(
        scene, method, control, step, run.steps, run.time / (2 * pi * way), gaps, speed,
        time.process_time() - begin, why,
    )  # fmt: skip


def _uncontrolled() -> mock._patch[Callable[..., Motion]]:
    """Acceleration level without its last act: gaps of lasting contacts stay as they come out."""
    return mock.patch.object(
        runge_kutta, "drift_removed", lambda world, motion, pressed, stuck: motion
    )


def drifts(quick: bool) -> Iterator[Drift]:
    """Both methods, sliding and rolling, with and without what keeps gaps closed."""
    cases: tuple[tuple[Method, float], ...] = (("acceleration", 2e-2), ("time-stepping", 4e-3))
    for method, step in cases:
        for friction in (0.0, ORBIT_FRICTION):
            # time stepping has nothing to leave out: its law of the gap keeps contacts closed
            for control in (True, False) if method == "acceleration" else (True,):
                yield drift(method, step, friction, 0.1 if quick else 5.0, control)
