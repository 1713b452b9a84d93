"""States at the ends of a deck's cycles, as its windows leave them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from adapters.bed import FloatArray, IntArray
from adapters.decks import restart as kept
from adapters.decks.engine import Adopted
from adapters.errors import NotCredible
from adapters.files import read_frames
from trackbed.memory import read_arrays
from trackbed.run_files import replace_file

CENTRE, VELOCITY = ("x", "y", "z"), ("vx", "vy", "vz")
"""Columns of a dump."""


@dataclass(frozen=True)
class States:
    """Cycle ends of a deck, the first the state before the window; c of them, n grains.

    A grain of several spheres, a stone, counts as one.
    """

    identifier: IntArray  # ascending, shape (n,)
    radius: FloatArray
    """Radii [m], shape (n,); of stones half of the distance to the nearest one."""
    mass: FloatArray  # masses [kg], shape (n,)
    position: FloatArray  # centres as they are without periods [m], shape (c, n, 3)
    velocity: FloatArray  # [m/s], shape (c, n, 3)
    height: FloatArray  # of the loaded body [m], shape (c,); nan without
    last: FloatArray
    """Spheres of the last state: identifier, place as folded into the box [m], velocity [m/s];
    shape (spheres, 7)."""

    @property
    def energy(self) -> FloatArray:
        """Translational kinetic energy [J], shape (c,)."""
        return 0.5 * (self.mass * (self.velocity**2).sum(axis=2)).sum(axis=1)

    def behind(self, start: States) -> States:
        """The last state of ``start``, and these behind it."""
        names = ("position", "velocity", "height")
        pairs = ((getattr(start, name)[-1:], getattr(self, name)) for name in names)
        return replace(self, **dict(zip(names, map(np.concatenate, pairs), strict=True)))


def read_states(folder: Path, first: int, last: int, bed: Adopted) -> States:
    """States of a bed in a folder, at the ends of its cycles ``first`` to ``last``.

    Raises `NotCredible` where grains came or went, and what `read_frames` raises.
    """
    cycles = range(first, last + 1)
    frames = [next(iter(read_frames(folder / f"cycle_{c}.dump"))) for c in cycles]
    start, end = frames[0], frames[-1]
    identifier, radius, mass = (start.column(name) for name in ("id", "radius", "mass"))
    for number, one in zip(cycles, frames, strict=True):
        if not np.array_equal(one.column("id"), identifier):
            raise NotCredible(
                f"there are {len(one.values)} grains at the end of cycle {number} of this window, "
                f"and {len(start.values)} before it: grains came or went",
                where=str(folder), remedy="thermo_modify lost error; no insertion in the cycle",
            )  # fmt: skip
    height = np.full(len(frames), np.nan)
    position = np.array([one.find_centres() for one in frames])
    velocity = np.array([one.block(*VELOCITY) for one in frames])
    if bed.loaded or bed.stones:
        found = [bytearray((folder / f"cycle_{c}.restart").read_bytes()) for c in cycles]
        if bed.loaded:
            height = np.array([kept.find_mesh(one, *bed.loaded)[0].mean() for one in found])
        if bed.stones:
            stones = np.array([kept.find_stones(one, bed.stones) for one in found])
            order = stones[:, :, kept.STONE_ID].argsort(axis=1)[:, :, None]
            stones = np.take_along_axis(stones, order, axis=1)
            identifier, mass = stones[0, :, kept.STONE_ID], stones[0, :, kept.MASS]
            position, velocity = stones[:, :, kept.CENTRE], stones[:, :, kept.VELOCITY]
            radius = cKDTree(position[0]).query(position[0], 2)[0][:, 1] / 2
    spheres = end.block("id", *CENTRE, *VELOCITY)
    return States(identifier.astype(np.int64), radius, mass, position, velocity, height, spheres)


def find_overlap(position: FloatArray, radius: FloatArray) -> float:
    """Greatest overlap of two grains [m]: places (n, 3) and radii (n,) [m]; zero without."""
    pairs = cKDTree(position).query_pairs(2 * radius.max(), output_type="ndarray")
    apart = np.linalg.norm(position[pairs[:, 0]] - position[pairs[:, 1]], axis=1)
    return float((radius[pairs].sum(axis=1) - apart).max(initial=0.0))


def save_states(states: States, path: Path) -> None:
    """Write states to ``path`` (npz), without loss, atomically."""
    with replace_file(path) as temporary, temporary.open("wb") as stream:
        np.savez(stream, **vars(states))


def load_states(path: Path) -> States:
    """Read what `save_states` wrote."""
    return States(**read_arrays(path))
