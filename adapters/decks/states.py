"""States at the ends of a deck's cycles, as its windows leave them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from adapters.bed import FloatArray, IntArray
from adapters.decks.engine import Adopted
from adapters.errors import NotCredible
from adapters.files import read_frames
from adapters.files import restart as kept
from trackbed.memory import read_arrays
from trackbed.run_files import replace_file

CENTRE, VELOCITY = ("x", "y", "z"), ("vx", "vy", "vz")
"""Columns of a dump."""
PER_CYCLE = ("position", "velocity", "height")
"""What states have of each cycle."""


@dataclass(frozen=True)
class States:
    """Cycle ends of a deck, the first the state before the window; c of them, n grains.

    A grain of several spheres, a stone, counts as one.
    """

    identifier: IntArray  # ascending, shape (n,)
    radius: FloatArray  # radii [m], shape (n,); of stones half of the distance to the nearest one
    mass: FloatArray  # masses [kg], shape (n,)
    position: FloatArray  # centres as they are without periods [m], shape (c, n, 3)
    velocity: FloatArray  # [m/s], shape (c, n, 3)
    height: FloatArray  # of the loaded body [m], shape (c,); nan without
    last: FloatArray
    """Spheres of the last state, in the deck's units: identifier, place as folded into the box,
    velocity; shape (spheres, 7)."""
    period: FloatArray = field(default_factory=lambda: np.full((3, 2), np.nan))
    """Low and high side of the box in the deck's units, nan where it is not periodic, (3, 2)."""

    @property
    def energy(self) -> FloatArray:
        """Translational kinetic energy [J], shape (c,)."""
        return 0.5 * (self.mass * (self.velocity**2).sum(axis=2)).sum(axis=1)

    def behind(self, start: States) -> States:
        """The last state of ``start``, and these behind it."""
        pairs = ((getattr(start, name)[-1:], getattr(self, name)) for name in PER_CYCLE)
        return replace(self, **dict(zip(PER_CYCLE, map(np.concatenate, pairs), strict=True)))


def read_states(folder: Path, first: int, last: int, bed: Adopted) -> States:
    """States of a bed in a folder, at the ends of its cycles ``first`` to ``last``.

    Raises `NotCredible` where grains came or went, and what `read_frames` raises.
    """
    read = read_scene_end if bed.deck.is_script else read_end
    ends = [read(folder, number, bed) for number in range(first, last + 1)]
    start, end = ends[0], ends[-1]
    if not len(start.last):
        raise NotCredible("there are no grains where the cycle begins", where=str(bed.deck.path))
    for number, one in enumerate(ends, first):
        if not np.array_equal(one.last[:, 0], start.last[:, 0]):
            raise NotCredible(
                f"there are {len(one.last)} grains at the end of cycle {number} of this window, "
                f"and {len(start.last)} before it: grains came or went",
                where=str(folder), remedy="thermo_modify lost error; no insertion in the cycle",
            )  # fmt: skip
    position, velocity, height = (
        np.concatenate([getattr(one, name) for one in ends]) for name in PER_CYCLE
    )
    radius = start.radius
    if (stone := radius == 0).any():
        nearest = cKDTree(position[0]).query(position[0], 2)[0][:, 1] / 2
        radius = np.where(stone, nearest, radius)
    return replace(
        end, radius=radius, mass=start.mass, position=position, velocity=velocity, height=height
    )


def read_end(folder: Path, number: int, bed: Adopted) -> States:
    """The end of a cycle as LIGGGHTS and LAMMPS leave it; radii of stones are 0."""
    frame = next(iter(read_frames(folder / f"cycle_{number}.dump")))
    identifier, radius, mass = (frame.column(name) for name in ("id", "radius", "mass"))
    position, velocity, height = frame.find_centres(), frame.block(*VELOCITY), np.nan
    periodic = [["p" in side] for side in frame.boundary.split()[-3:]]
    upright = frame.bounds.shape == (3, 2)  # a grain that leaves a tilted box fails the jump
    period = np.where(periodic, frame.bounds if upright else np.nan, np.full((3, 2), np.nan))
    if bed.loaded or bed.stones:
        restart = bytearray((folder / f"cycle_{number}.restart").read_bytes())
        if bed.loaded:
            height = kept.find_mesh(restart, *bed.loaded)[0].mean()
        if bed.stones:
            stones = kept.find_stones(restart, bed.stones)
            stones = stones[stones[:, kept.STONE_ID].argsort()]
            identifier, mass = stones[:, kept.STONE_ID], stones[:, kept.MASS]
            position, velocity = stones[:, kept.CENTRE], stones[:, kept.VELOCITY]
            radius = np.zeros(len(stones))
    spheres, (metre, kilogram) = frame.block("id", *CENTRE, *VELOCITY), bed.deck.units
    return States(
        identifier.astype(np.int64), radius * metre, mass * kilogram, metre * position[None],
        metre * velocity[None], metre * np.array([height]), spheres, period,
    )  # fmt: skip


def read_scene_end(folder: Path, number: int, bed: Adopted) -> States:
    """The end of a cycle as a script of YADE leaves it; radii of clumps are 0."""
    end = read_arrays(folder / f"cycle_{number}.npz")
    spheres = np.column_stack([end["identifier"], end["position"], end["velocity"]])
    for name in PER_CYCLE:
        end[name] = end[name][None]
    return States(**end, last=spheres)


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
