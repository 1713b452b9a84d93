"""States at the ends of a deck's cycles, as its windows leave them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from adapters.bed import FloatArray, IntArray
from adapters.decks.restart import find_stones, measure_height
from adapters.errors import NotCredible
from adapters.files import Frame, read_frames, write_dump

CENTRES = ("x", "y", "z")
MOTION = ("vx", "vy", "vz", "omegax", "omegay", "omegaz")


@dataclass(frozen=True)
class States:
    """Cycle ends of a deck, the first the state before the window; c of them, n grains."""

    time_step: IntArray  # shape (c,)
    identifier: IntArray  # ascending, shape (n,)
    radius: FloatArray  # radii [m], shape (n,)
    mass: FloatArray  # masses [kg], shape (n,)
    position: FloatArray  # centres as they are without periods [m], shape (c, n, 3)
    motion: FloatArray  # velocities [m/s] and spins [rad/s], shape (c, n, 6)
    height: FloatArray  # of the loaded body [m], shape (c,); nan without
    last: Frame  # the last state as the engine wrote it

    @property
    def energy(self) -> FloatArray:
        """Translational kinetic energy [J], shape (c,)."""
        return 0.5 * (self.mass * (self.motion[:, :, :3] ** 2).sum(axis=2)).sum(axis=1)


def read_states(folder: Path, cycles: int, loaded: tuple[str, str] | None = None) -> States:
    """States 0 to ``cycles`` in a folder; ``loaded``: name and style of the loaded body's mesh.

    Raises `NotCredible` where grains came or went, and what `read_frames` raises.
    """
    frames = [next(iter(read_frames(folder / f"cycle_{c}.dump"))) for c in range(cycles + 1)]
    first = frames[0]
    for number, one in enumerate(frames):
        if not np.array_equal(one.column("id"), first.column("id")):
            raise NotCredible(
                f"there are {len(one.values)} grains at the end of cycle {number} of this window, "
                f"and {len(first.values)} before it: grains came or went",
                where=str(folder), remedy="thermo_modify lost error; no insertion in the cycle",
            )  # fmt: skip
    height = np.full(len(frames), np.nan)
    if loaded is not None:
        restarts = [folder / f"cycle_{c}.restart" for c in range(cycles + 1)]
        height = np.array([measure_height(one, *loaded) for one in restarts])
    return States(
        np.array([one.time_step for one in frames]), first.column("id").astype(np.int64),
        first.column("radius"), first.column("mass"),
        np.array([one.find_centres() for one in frames]),
        np.array([one.block(*MOTION) for one in frames]), height, frames[-1],
    )  # fmt: skip


def write_moved(states: States, move: FloatArray, path: Path) -> None:
    """Write the last state moved by ``move`` (n, 3) [m], at rest, for the engine to read."""
    values = states.last.values.copy()
    columns = states.last.columns
    values[:, [columns.index(name) for name in CENTRES]] += move
    values[:, [columns.index(name) for name in MOTION]] = 0.0
    last = states.last
    write_dump(path, [Frame(last.time_step, columns, values, last.bounds, "atoms", last.boundary)])


def read_stones(restart: Path, fix: str) -> FloatArray:
    """Bodies of several spheres in a restart file, by identifier, shape (s, 55)."""
    stones = find_stones(bytearray(restart.read_bytes()), fix)
    return stones[np.argsort(stones[:, 4])].copy()
