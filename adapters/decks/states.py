"""States at the ends of a deck's cycles, as its windows leave them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from adapters.bed import FloatArray, IntArray
from adapters.decks.engine import Adopted
from adapters.decks.exchange import count_exchange, refuse_losses, refuse_strangers
from adapters.errors import NotCredible
from adapters.files import read_frames
from adapters.files import restart as kept
from trackbed.memory import read_arrays
from trackbed.run_files import replace_file

CENTRE, VELOCITY = ("x", "y", "z"), ("vx", "vy", "vz")
"""Columns of a dump."""


@dataclass(frozen=True)
class States:
    """Cycle ends of a deck, the first the state before the window; c of them, n grains.

    A grain of several spheres, a stone, counts as one.  Radius and mass are those at the last end
    at which a grain is there; where it is not, place and velocity are nan.
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
    exchange: FloatArray = field(default_factory=lambda: np.empty((0, 5)))
    """What came, went and wore in each cycle, rows of `count_exchange`, shape (c - 1, 5)."""

    @property
    def energy(self) -> FloatArray:
        """Translational kinetic energy [J], shape (c,)."""
        return 0.5 * np.nansum(self.mass * (self.velocity**2).sum(axis=2), axis=1)

    def at(self, index: int) -> States:
        """The end at an ``index`` alone, and the grains that are there."""
        there, one = np.isfinite(self.position[index, :, 2]), slice(index, index + 1 or None)
        kept = {name: getattr(self, name)[there] for name in ("identifier", "radius", "mass")}
        kept |= {name: getattr(self, name)[one, there] for name in ("position", "velocity")}
        return replace(self, height=self.height[one], **kept)


def read_states(
    folder: Path, first: int, last: int, bed: Adopted, start: States | None = None
) -> States:
    """States of a bed in a folder, at the ends of its cycles ``first`` to ``last``, behind the one
    of ``start``, of all grains in any of them.

    Raises `NotCredible` where no grain is there in all, and as `refuse_strangers` and
    `refuse_losses`; and what `read_frames` raises.
    """
    read = read_scene_end if bed.deck.is_script else read_end
    ends = [*([start] if start else ()), *(read(folder, n, bed) for n in range(first, last + 1))]
    if not set.intersection(*(set(one.identifier.tolist()) for one in ends)):
        what = "there are no grains where the cycle begins, or none stays as long as the window"
        raise NotCredible(what, where=str(bed.deck.path))
    identifier = np.unique(np.concatenate([one.identifier for one in ends]))
    position, velocity = np.full((2, len(ends), len(identifier), 3), np.nan)
    radius, last_mass, mass = (*np.empty((2, len(identifier))), position[:, :, 0].copy())
    for number, one in enumerate(ends):
        rows = np.searchsorted(identifier, one.identifier)
        position[number, rows], velocity[number, rows] = one.position[0], one.velocity[0]
        radius[rows], last_mass[rows], mass[number, rows] = one.radius, one.mass, one.mass
    there = np.isfinite(mass[-1])
    if (stone := there & (radius == 0)).any():
        radius[stone] = cKDTree(position[-1, there]).query(position[-1, stone], 2)[0][:, 1] / 2
    refuse_strangers(identifier, mass, folder)
    refuse_losses(exchange := count_exchange(mass), bed, folder)
    return replace(
        ends[-1], identifier=identifier, radius=radius, mass=last_mass, position=position,
        velocity=velocity, height=np.concatenate([one.height for one in ends]), exchange=exchange,
    )  # fmt: skip


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
    for name in ("position", "velocity", "height"):
        end[name] = end[name][None]
    return States(**end, last=spheres)


def find_overlap(position: FloatArray, radius: FloatArray) -> float:
    """Greatest overlap of two grains, places (n, 3) and radii (n,) [m], over the smaller's [-]."""
    pairs = cKDTree(position).query_pairs(2 * radius.max(), output_type="ndarray")
    apart = np.linalg.norm(position[pairs[:, 0]] - position[pairs[:, 1]], axis=1)
    share = (radius[pairs].sum(axis=1) - apart) / radius[pairs].min(axis=1)
    return float(share.max(initial=0.0))


def save_states(states: States, path: Path) -> None:
    """Write states to ``path`` (npz), without loss, atomically."""
    with replace_file(path) as temporary, temporary.open("wb") as stream:
        np.savez(stream, **vars(states))


def load_states(path: Path) -> States:
    """Read what `save_states` wrote."""
    return States(**read_arrays(path))
