"""Further hard scenes in the plane: known ones turned, in other units, jittered; taller, kicked.

The answer of a scene that is turned, or measured in millimetres and grams, is the answer of the
scene itself; what round-off makes of it is what these rows show.
"""

from __future__ import annotations

from dataclasses import replace
from math import cos, sin, tan

import numpy as np
from numpy.typing import NDArray

from rigid_lcp.motion.world import Scene
from rigid_lcp.scene.simulation import Simulation
from rigid_lcp.shapes import Disc
from rigid_lcp.shapes.half_space import HalfSpace
from rigid_lcp.shapes.polygon import Polygon
from rigid_lcp.shapes.polyhedron import make_box
from validation.bench.rigid.scenes import DENSITY, FLOOR, G, find_card_friction, stack

Floats = NDArray[np.float64]


def incline_in_space(slope: float, across: float, mu: float) -> Simulation:
    """A flat block (body 0) at rest on a plane inclined by ``slope`` [rad], in its frame.

    Downhill is turned from x by ``across`` [rad] about the normal of the plane, z.
    """
    down = np.array([sin(slope) * cos(across), sin(slope) * sin(across), -cos(slope)])
    scene = Scene(3, G * down)
    scene.add(make_box(0.3, 0.2, 0.1), density=DENSITY, position=(0, 0, 0.05), friction=mu)
    scene.add(HalfSpace((0, 0, 1)), friction=mu)
    return Simulation(scene)


def turn_scene(run: Simulation, angle: float) -> Simulation:
    """The scene, and gravity with it, turned about the origin by ``angle`` [rad]."""
    frame = np.array([[cos(angle), -sin(angle)], [sin(angle), cos(angle)]])
    old = run.world.scene
    scene = Scene(2, frame @ old.gravity)
    for body in old.bodies:
        shape = body.shape
        if isinstance(shape, HalfSpace):
            shape = HalfSpace(frame @ shape.normal, shape.offset)
        scene.bodies.append(replace(
            body, shape=shape, position=frame @ body.position, angle=body.angle + angle,
            velocity=frame @ body.velocity,
        ))  # fmt: skip
    return Simulation(scene, run.method, step=run.step)


def change_units(run: Simulation, length: float, mass: float) -> Simulation:
    """The scene in units of which ``length`` make a metre and ``mass`` a kilogram."""
    old = run.world.scene
    scene = Scene(2, old.gravity * length)
    for body in old.bodies:
        shape = body.shape
        if isinstance(shape, HalfSpace):
            shape = HalfSpace(shape.normal, shape.offset * length)
        elif isinstance(shape, Disc):
            shape = Disc(shape.radius * length)
        else:
            shape = Polygon(shape.vertices * length)
        scene.bodies.append(replace(
            body, shape=shape, mass=body.mass * mass, inertia=body.inertia * mass * length**2,
            position=body.position * length, velocity=body.velocity * length,
        ))  # fmt: skip
    return Simulation(scene, run.method, step=run.step)


def jitter_grid(columns: int, rows: int, offset: float) -> Simulation:
    """Boxes side by side and upon each other, each off its place by up to ``offset`` [m]."""
    generator = np.random.default_rng(0)
    scene = Scene(2)
    for k in range(columns * rows):
        place = np.array([k % columns, k // columns + 0.5]) + generator.uniform(-offset, offset, 2)
        scene.add(Polygon.rectangle(1, 1), density=DENSITY, position=place, friction=0.5)
    scene.add(FLOOR)
    return Simulation(scene)


def stack_cards(storeys: int, phi: float, mu: float) -> Simulation:
    """A card house: ``storeys`` pairs of cards below, one pair less a storey, slabs between.

    Cards of height 1 m lean by ``phi`` [rad], with flat feet and tops 2 cm wide; two meet in a
    short upright face.  A slab spans from the middle of one top to the next; ``mu`` everywhere.
    """
    foot, wide, slab, edge = tan(phi), 0.02, 0.02, 0.05
    pitch = 2 * (foot + wide) + 0.2 * wide
    card = np.array(
        [(-foot - wide, 0), (-foot, 0), (0, 1 - edge), (0, 1), (-wide, 1)]
    )  # fmt: skip
    other = (card * (-1, 1))[::-1]
    scene = Scene(2)
    for storey in range(storeys):
        base = storey * (1 + slab)
        for k in range(storeys - storey):
            x = pitch * (k + storey / 2)
            for outline in (card, other):
                scene.add(Polygon(outline + np.array([x, base])), density=DENSITY)
            if k:
                centre = (x - pitch / 2, base + 1 + slab / 2)
                shape = Polygon.rectangle(pitch - wide / 2, slab)
                scene.add(shape, density=DENSITY, position=centre)
    scene.add(FLOOR, friction=mu)
    for number, body in enumerate(scene.bodies):
        scene.bodies[number] = replace(body, friction=mu)
    return Simulation(scene)


def find_storeys_friction(storeys: int, phi: float) -> float:
    """Least friction at which a card house can stand, by `validation.bench.rigid.rest_limit`."""
    from validation.bench.rigid.rest_limit import BALANCED, bisect_rest, find_unbalance

    run = stack_cards(storeys, phi, 1.0)
    few = find_card_friction(phi)
    return bisect_rest(lambda mu: find_unbalance(run, mu) <= BALANCED, few / 10, 10 * few, 1e-9)


def kick_tower(boxes: int, speed: float) -> Simulation:
    """A tower whose lowest box is given a ``speed`` [m/s] sideways."""
    scene = stack(boxes).world.scene
    scene.bodies[0] = replace(scene.bodies[0], velocity=np.array([speed, 0.0]))
    return Simulation(scene)


def drop_needles(needles: int, slender: float) -> Simulation:
    """Needles of 1 m by ``1 / slender``, crossed, that fall on a floor and upon each other."""
    scene = Scene(2)
    for k in range(needles):
        scene.add(
            Polygon.rectangle(1, 1 / slender), density=DENSITY, friction=0.5,
            position=(0.1 * (k % 3), 0.3 + 0.3 * k), angle=0.2 * (-1) ** k,
        )  # fmt: skip
    scene.add(FLOOR)
    return Simulation(scene)


def pile_needles(needles: int) -> Simulation:
    """Needles of 1 m by 0.1 mm upon each other, and one that stands on its end on the floor."""
    scene = Scene(2)
    for k in range(needles):
        scene.add(
            Polygon.rectangle(1, 1e-4), density=DENSITY, position=(0, (k + 0.5) * 1e-4),
            friction=0.5,
        )  # fmt: skip
    scene.add(Polygon.rectangle(1e-4, 1), density=DENSITY, position=(1, 0.5), friction=0.5)
    scene.add(FLOOR)
    return Simulation(scene)
