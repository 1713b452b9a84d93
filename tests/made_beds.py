"""Beds that no engine prepared: disordered, at rest, for tests of the relaxation.

A bed's nearest pairs are closed until each grain has the contacts and the overlaps of a ballast bed
at rest under its own weight (coordination number near 4 with walls, exponential overlaps of 6e-8 m
in the mean).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from adapters.bed.contact_law import make_hertz_stiffness
from adapters.bed.container import Container, Walls
from adapters.bed.overlaps import Neighbours, find_behind_discs, find_pairs
from adapters.bed.state import FloatArray, State
from adapters.relaxation.measured import Surroundings
from adapters.relaxation.methods import relax
from adapters.relaxation.smallest import find_smallest_move

STIFFNESS = make_hertz_stiffness(46.9e9, 0.25, 210e9, 0.3)
DENSITY = 2710.0
OVERLAP = 6e-8  # mean overlap of a made bed [m]
SETTLEMENT = 40e-6  # mean settlement of the jumps [m]


def state_at_rest(position: FloatArray, radius: FloatArray) -> State:
    """Grains at rest without any record of contacts; metres."""
    n = len(radius)
    mass = 4 / 3 * np.pi * radius**3 * DENSITY
    return State(np.arange(n), position, radius, mass, np.zeros((n, 3)), np.zeros((n, 3)))


def parted(position: FloatArray, radius: FloatArray, walls: Walls) -> FloatArray:
    """The nearest places [m] without overlaps, as after a jump of a bed without any contact."""
    far = 1000.0
    wide = replace(
        walls, plane_point=far * walls.plane_point, cylinder_radius=far * walls.cylinder_radius
    )
    before = state_at_rest(np.abs(far * position) + radius[:, None], radius)
    found = relax(position, before, wide, STIFFNESS, walls_after=walls, keep_height=False)
    return found.position


def bed_made(count: int, seed: int = 0) -> tuple[State, Walls]:
    """A bed of ``count`` grains (Karrech's radii) in a square box, two contacts closed a grain."""
    generator = np.random.default_rng(seed)
    radius = np.clip(generator.normal(3.2e-3, 5.65e-4, count), 2.07e-3, 4.33e-3)
    edge = float(4 * 4 / 3 * np.pi * np.mean(radius**3) / 0.54) ** (1 / 3)
    side = int(np.ceil((count / 4) ** (1 / 3)))
    cell = np.array(list(np.ndindex(side + 2, side, side)))[:, ::-1]
    corner = np.array([[1, 1, 1], [3, 3, 1], [3, 1, 3], [1, 3, 3]]) / 4
    place = (cell[:, None] + corner).reshape(-1, 3)[:count]
    position = edge * place + 3e-4 * generator.standard_normal((count, 3))
    walls = Container("box", size_x=side * edge, size_y=side * edge).walls()
    position = parted(position, radius, walls)
    near = find_pairs(position, radius, walls, 1e-3)
    closed = np.argsort(-near.overlap)[: 2 * count]
    network = Neighbours(
        near.first[closed],
        near.second[closed],
        near.normal[closed],
        OVERLAP * generator.exponential(size=len(closed)),
    )
    scene = Surroundings(radius, walls, find_behind_discs(position, walls), STIFFNESS)
    made, _, _ = find_smallest_move(
        position,
        position,
        scene,
        network,
        np.inf,
        5 * OVERLAP,
        5 * OVERLAP,
        keep_height=False,
        tolerance=0.01 * OVERLAP,
        accepted=10 * OVERLAP,
        evaluations_max=40_000,
    )
    return state_at_rest(made, radius), walls


def jump(state: State, seed: int = 1) -> FloatArray:
    """Estimated positions [m]: settlement that grows with height, and every grain by itself."""
    generator = np.random.default_rng(seed)
    move = SETTLEMENT * generator.standard_normal(state.position.shape)
    height = state.position[:, 2]
    move[:, 2] -= SETTLEMENT * height / height.mean() + move[:, 2].mean()
    return state.position + move
