"""Wear and breakage in a run: closed forms, balances, and what a break does to a pile at rest."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from time import process_time

import numpy as np

from rigid_lcp.breakage import Breakage
from rigid_lcp.motion import Motion
from rigid_lcp.scene import Scene
from rigid_lcp.shapes_2d import HalfSpace, Polygon
from rigid_lcp.simulation import Simulation
from rigid_lcp.strength import brazilian_tension
from rigid_lcp.wear import Wear

GRAVITY = 9.81
ANGLE, FRICTION = 0.5, 0.3
"""Of the slope [rad], [-]."""


@dataclass(frozen=True)
class WearRow:
    """One measured value against its bar."""

    name: str
    value: float
    bar: float
    unit: str = ""


def sliding_block(step: float, coefficient: float, every: int = 10) -> Simulation:
    """A block of 0.2 by 0.1 m and 54 kg on a slope that it slides down."""
    scene = Scene(2, [GRAVITY * np.sin(ANGLE), -GRAVITY * np.cos(ANGLE)])
    scene.add(HalfSpace([0, 1]), friction=FRICTION)
    scene.add(Polygon.rectangle(0.2, 0.1), density=2700.0, position=[0, 0.05])
    return Simulation(scene, step=step, wear=Wear(coefficient, every))


def tumbling_pile(wear: Wear | None, breakage: Breakage | None = None) -> Simulation:
    """Twelve polygons thrown on each other between two walls."""
    scene = Scene(2)
    for normal, offset in (([0, 1], 0.0), ([1, 0], -0.3), ([-1, 0], -0.3)):
        scene.add(HalfSpace(normal, offset), friction=0.4)
    for k in range(12):
        scene.add(
            Polygon.regular(5 + k % 3, 0.08), density=2000.0, friction=0.4, angle=0.3 * k,
            position=[0.2 * (k % 3 - 1), 0.1 + 0.2 * (k // 3)], velocity=[1.5 * (-1) ** k, 0.0],
        )  # fmt: skip
    return Simulation(scene, step=2e-3, tolerance=1e-10, wear=wear, breakage=breakage)


def pressed_diamond(load: float, strength: float) -> Simulation:
    """A diamond of 0.2 m between a floor and a plate of 1.5 kg, pressed with ``load`` [N]."""
    scene = Scene(2)
    scene.add(HalfSpace([0, 1]), friction=0.5)
    diamond = Polygon([(0, -0.1), (0.1, 0), (0, 0.1), (-0.1, 0)])
    scene.add(diamond, density=2700.0, position=[0, 0.1], friction=0.5)
    plate = Polygon.rectangle(0.3, 0.05)
    scene.add(plate, density=100.0, position=[0, 0.225], friction=0.5)

    def loads(time: float, motion: Motion) -> list[list[float]]:
        forces = [[0.0, 0.0, 0.0] for _ in motion.position]
        forces[2][1] = -load
        return forces

    return Simulation(scene, step=1e-3, loads=loads, breakage=Breakage(strength, every=1))


def box_tower(strength: float) -> Simulation:
    """Three boxes of 0.1 m on one another, the upper one a hundred times as dense."""
    scene = Scene(2)
    scene.add(HalfSpace([0, 1]), friction=0.6)
    for k, density in enumerate((1000.0, 1000.0, 1e5)):
        box = Polygon.rectangle(0.1, 0.1)
        scene.add(box, density=density, position=[0, 0.05 + 0.1 * k], friction=0.6)
    return Simulation(scene, step=1e-3, breakage=Breakage(strength, every=5, unique=True))


def area_of(run: Simulation) -> float:
    """Area of all grains [m^2]."""
    return float(sum(body.shape.area for body in run.world.scene.bodies if body.movable))


def wear_rows(quick: bool) -> Iterator[WearRow]:
    """All rows; about ten seconds."""
    yield from _slope_rows()
    yield from _pile_rows(quick)
    yield from _break_rows()


def _slope_rows() -> Iterator[WearRow]:
    k, time = 1e-12, 0.5
    run = sliding_block(5e-3, k)
    run.advance(time)
    assert run.worn is not None
    pull = GRAVITY * (np.sin(ANGLE) - FRICTION * np.cos(ANGLE))
    work = FRICTION * 54.0 * GRAVITY * np.cos(ANGLE) * pull * time**2 / 2
    yield WearRow("block on a slope: V / (k W) - 1", abs(run.worn.volume / (k * work) - 1), 1e-9)
    coarse, middle, fine = (sliding_block(step, 2e-6, 1) for step in (0.02, 0.01, 0.005))
    for each in (coarse, middle, fine):
        each.advance(0.4)
    volume = [each.worn.volume for each in (coarse, middle, fine) if each.worn is not None]
    ratio = (volume[1] - volume[2]) / (volume[0] - volume[1])
    yield WearRow("mass wears away: change of V with half the step, over that before", ratio, 0.6)
    gone = 0.02 - area_of(fine) + float(fine.worn.pending.sum() if fine.worn else 0.0)
    yield WearRow("area lost / V - 1", abs(gone / volume[2] - 1), 1e-10)


def _pile_rows(quick: bool) -> Iterator[WearRow]:
    spent = {}
    for wear in (None, Wear(1e-5, every=10)):
        run = tumbling_pile(wear)
        whole, overlap = area_of(run), 0.0
        run.advance(2e-3)
        began = process_time()
        for _ in range(20 if quick else 50):
            run.advance(2e-2)
            overlap = max(overlap, run.overlap)
        spent[wear is not None] = (process_time() - began) / run.steps
        if run.worn is not None:
            gone = whole - area_of(run) + float(run.worn.pending.sum())
            share = run.worn.volume / whole
            yield WearRow("pile of 12: share worn off", share, 0.5)
            yield WearRow("pile of 12: area lost / V - 1", abs(gone / run.worn.volume - 1), 1e-8)
        yield WearRow(
            f"pile of 12, {'worn' if wear else 'not worn'}: greatest overlap", overlap, 1e-4, "m"
        )
    yield WearRow("pile of 12: CPU of a step, worn over not worn", spent[True] / spent[False], 10.0)


def _break_rows() -> Iterator[WearRow]:
    load = 5e3
    push = load + 1.5 * GRAVITY + 27.0 * GRAVITY  # the mean of both ends
    tension = brazilian_tension(np.diag([0.0, -0.2 * push / 0.02]))
    broke = []
    for share in (0.999, 1.001):
        run = pressed_diamond(load, tension / share)
        energy = run.energy
        run.advance(1e-3)
        broke.append(len(run.broken))
    yield WearRow("diamond: breaks 0.1 % below its strength", float(broke[0]), 0.0)
    yield WearRow("diamond: holds 0.1 % above it", float(1 - broke[1]), 0.0)
    yield WearRow("diamond: energy gained in the break", run.energy - energy, 1e-9, "J")
    yield WearRow("diamond: overlap after the break", run.overlap, 1e-12, "m")
    tower_tension = 0.5 * (1000 + 15) * GRAVITY / 0.1
    run = box_tower(0.9999 * tower_tension)
    run.advance(5e-3)
    places = run.positions.copy()
    broken = len(run.broken)
    run.breakage = None
    run.advance(0.2)
    moved = float(np.abs(run.positions - places).max()) if broken == 1 else float("nan")
    yield WearRow("tower: moved in 0.2 s after its lowest box broke", moved, 1e-9, "m")
