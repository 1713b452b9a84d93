"""A hopper that jams: discs are poured until an arch closes its outlet, and must then stay.

The jam is found, not built: which seed jams, and where the grains lie, comes out of the pouring.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rigid_lcp.motion.world import Scene
from rigid_lcp.scene.simulation import Simulation
from rigid_lcp.shapes.disc import Disc
from rigid_lcp.shapes.polygon import Polygon
from validation.bench.rigid.scenes import DENSITY

Floats = NDArray[np.float64]

RADIUS = 0.01
"""Mean radius of the discs [m]."""
OUTLET = 2.6
"""Width of the outlet, in mean diameters."""
WALL = 4
"""The last bodies of the scene: two slopes and two walls above them, all fixed."""
STILL = 1e-9
"""Speed below which the discs above the outlet are at rest [m/s]."""
SETTLING = 0.5
"""Time the arch has to come to rest once those that fell through are gone [s]."""


def hopper(grains: int, seed: int, *, mu: float = 0.6, step: float = 1e-3) -> Simulation:
    """Discs on a loose lattice above the outlet, about to fall; they come first, then the walls."""
    generator = np.random.default_rng(seed)
    scene = Scene(2)
    half, slope, wide = OUTLET * RADIUS, np.tan(np.radians(50)), 0.11
    columns = 6
    for k in range(grains):
        x = (k % columns - (columns - 1) / 2) * 2.6 * RADIUS
        y = wide * slope + (k // columns) * 2.6 * RADIUS
        shift = 0.08 * RADIUS * generator.uniform(-1, 1, 2)
        radius = RADIUS * generator.uniform(0.8, 1.2)
        scene.add(Disc(radius), density=DENSITY, position=(x + shift[0], y + shift[1]), friction=mu)
    high = 0.6
    outline = [(half, 0.0), (wide + half, 0.0), (wide + half, wide * slope)]
    scene.add(Polygon(outline), fixed=True)
    scene.add(Polygon([(-x, y) for x, y in outline[::-1]]), fixed=True)
    for side in (1, -1):
        scene.add(
            Polygon.rectangle(0.02, high), position=(side * (wide + half + 0.01), high / 2),
            fixed=True,
        )  # fmt: skip
    return Simulation(scene, step=step)


def jam(grains: int, seed: int, *, longest: float = 4.0) -> tuple[Simulation, float] | None:
    """A scene of the discs that an arch holds, at rest, and how long it took [s]; None: no jam.

    Discs that fell through are left out; the arch bears at least a third of the grains.  Discs that
    fall over a saddle are still for a moment: what moves again by itself is no jam yet.
    """
    run = hopper(grains, seed)
    while run.time < longest:
        run.advance(0.05)
        held = run.positions[:-WALL, 1] > 0
        if held.sum() < grains / 3:
            return None
        if _still(run, held):
            jammed = _held(run, held)
            jammed.advance(SETTLING)
            left = jammed.positions[:-WALL, 1] > 0
            if left.sum() >= grains / 3 and _still(jammed, left):
                return _held(jammed, left), run.time
    return None


def _still(run: Simulation, held: NDArray[np.bool_]) -> bool:
    return bool(np.abs(run.velocities[:-WALL][held]).max() < STILL)


def _held(run: Simulation, held: NDArray[np.bool_]) -> Simulation:
    scene = Scene(2)
    bodies = run.world.scene.bodies
    keep = [*np.flatnonzero(held), *range(len(held), len(bodies))]
    rest = np.zeros(2)
    scene.bodies = [
        replace(
            bodies[k], position=run.positions[k].copy(), angle=np.atleast_1d(run.angles[k]),
            velocity=rest,
        )
        for k in keep
    ]  # fmt: skip
    return Simulation(scene, step=run.step)
