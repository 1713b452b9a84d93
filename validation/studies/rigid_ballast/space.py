"""A sleeper block on polyhedral ballast in space: settlement against the step.

Stones are poured; the block is laid on the highest of them and pressed down; then the load goes up
and down.  The block stays level, as rails hold a sleeper.  Pouring is the same for all steps.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigid_lcp.motion.state import Motion
from rigid_lcp.motion.world import Scene
from rigid_lcp.scene.file import build_scene, load_scene
from rigid_lcp.scene.simulation import Simulation
from rigid_lcp.shapes.polyhedron import make_box
from rigid_lcp.shapes.rotations import rotate

SCENE = Path(__file__).parents[3] / "trackbed" / "scenes" / "sleeper-3d.toml"
STONES, BLOCK = 100, (0.12, 0.09, 0.06)
"""Number of stones, and edges of the sleeper block [m]."""
LEAST, MOST, FREQUENCY, CYCLES = 50.0, 500.0, 25.0, 6
"""Smallest and greatest load [N], [Hz], [-]."""
POURING, LAYING, POUR_STEP, TOLERANCE = 0.45, 0.15, 1e-3, 1e-6
"""Times and step of pouring and laying [s], residual asked of every step [-]."""
STEPS = (2e-3, 1e-3, 5e-4)
"""Steps of the cycles [s]."""
HELD, FAR = 1e6, 10.0
"""What the block's inertia is multiplied with, and the height at which it waits [m]."""
Floats = NDArray[np.float64]


def make_bed(sample: int) -> tuple[Scene, int]:
    """Stones above their box and the block far above them; the block's number."""
    overrides = (f"grains.0.count={STONES}", f"grains.0.seed={sample}", "body=[]", "load=[]")
    scene = build_scene(load_scene(SCENE, overrides))
    block = scene.add(
        make_box(*BLOCK), density=2400.0, position=[0.0, 0.0, FAR], friction=0.6, name="sleeper"
    )
    body = scene.bodies[block]
    scene.bodies[block] = replace(body, inertia=HELD * body.inertia)
    return scene, block


def lay_block(scene: Scene, motion: Motion, block: int) -> Motion:
    """The block at rest a hair above the highest corner that may be under it."""
    shape = scene.bodies[block].shape
    half, top = shape.vertices.max(axis=0), 0.0
    for number, body in enumerate(scene.bodies):
        if body.movable and number != block:
            corners = motion.position[number] + rotate(motion.angle[number], body.shape.vertices)
            under = (np.abs(corners[:, :2]) <= half[:2] + body.shape.reach).all(axis=1)
            top = max(top, float(corners[under, 2].max(initial=0.0)))
    position, velocity = motion.position.copy(), motion.velocity.copy()
    position[block], velocity[block] = [0.0, 0.0, top + half[2] + 1e-4], 0.0
    return replace(motion, position=position, velocity=velocity)


def push(motion: Motion, body: int, force: float) -> Floats:
    """Loads (n, 6) [N, N m]: ``force`` [N] down on a body."""
    loads = np.zeros((len(motion.position), 6))
    loads[body, 2] = -force
    return loads


def find_load(seconds: float) -> float:
    """Load [N] ``seconds`` after the first cycle began."""
    return LEAST + (MOST - LEAST) * (0.5 - 0.5 * float(np.cos(2 * np.pi * FREQUENCY * seconds)))


def measure_space(sample: int) -> dict[str, Any]:
    """Settlement after each cycle, cost and worst residual at every step."""
    scene, block = make_bed(sample)
    pour = Simulation(scene, step=POUR_STEP, tolerance=TOLERANCE)
    pour.advance(POURING)
    start = Simulation(
        scene, step=POUR_STEP, tolerance=TOLERANCE,
        loads=lambda _, motion: push(motion, block, LEAST),
    )  # fmt: skip
    start.motion = lay_block(scene, pour.motion, block)
    start.advance(LAYING)
    return {"space": {f"{step:g}": load_in_space(start, block, step) for step in STEPS}}


def load_in_space(start: Simulation, block: int, step: float) -> dict[str, Any]:
    """All cycles in steps of ``step`` [s] from the state of ``start``."""
    began = start.time
    run = Simulation(
        start.world.scene, step=step, tolerance=TOLERANCE,
        loads=lambda now, motion: push(motion, block, find_load(now - began)),
    )  # fmt: skip
    run.motion, run.contacts, run.time = start.motion, start.contacts, began
    height, begin = [run.positions[block, 2]], process_time()
    for _ in range(CYCLES):
        run.advance(1.0 / FREQUENCY)
        height.append(run.positions[block, 2])
    return {"settlement": [float(height[0] - z) for z in height[1:]], "steps": run.steps,
            "cpu_s": process_time() - begin, "residual": run.worst_residual}  # fmt: skip
