"""The reference of the settlement study: which full runs, from which states, to which cycle.

A bed of hard grains is chaotic: one grain moved by 1e-10 m changes the settlement after 60 cycles
by several per cent.  So the reference is an ensemble of runs without any jump:

* a *packing* is the rain of grains of one seed and its first k_i load cycles;
* a *member* goes on from a packing's state at k_i: number 0 as it is, number m with one grain moved
  by m times 1e-10 m.  All methods are to start from the same states.

Every run is cut into windows of equal length, each a fresh process from the engine's restart file,
so that it gives the same bits whether it is stopped between two windows or not.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from adapters.scene import Scene
from adapters.scene_file import scene_load
from adapters.state import FloatArray
from adapters.window import PistonTrack
from scenes import scene_path

STEP = 1e-10
"""Displacement [m] of one grain at k_i, times the number of the member."""


@dataclass(frozen=True)
class Kind:
    """An ensemble: one scene under one load."""

    name: str
    title: str
    scene_name: str
    settings: tuple[str, ...]
    """Keys of the scene that differ, beside seed and engine."""
    packings: int
    """Seeds 1, 2, ... of the rain of grains."""
    members: int
    """Runs that go on from each packing."""
    k_i: int
    """Cycles of a packing, from whose state its members start."""
    last: int
    """Cycles at a member's end."""
    window: int
    """Cycles of a window: what a killed run loses at most."""
    marks: tuple[int, ...]
    """Cycles whose states are kept."""
    told: tuple[int, ...]
    """Cycles at which the page tells figures."""
    engine: str = "liggghts"

    def scene(self, seed: int) -> Scene:
        """The scene of a packing."""
        own = (f"sample.seed={seed}", f'engine.name="{self.engine}"', f"procedure.k_i={self.k_i}")
        return scene_load(scene_path(self.scene_name), [*self.settings, *own])

    def runs(self) -> Iterator[Piece]:
        """All packings, then all members, the first one of each packing before any second."""
        for seed in range(1, self.packings + 1):
            yield Piece(self, seed)
        for member in range(self.members):
            for seed in range(1, self.packings + 1):
                yield Piece(self, seed, member)


@dataclass(frozen=True)
class Piece:
    """A packing up to k_i (``member`` None), or a member from k_i on."""

    kind: Kind
    seed: int
    member: int | None = None

    @property
    def name(self) -> str:
        """Such as ``confined-2`` (packing) and ``confined-2-1`` (member)."""
        packing = f"{self.kind.name}-{self.seed}"
        return packing if self.member is None else f"{packing}-{self.member}"

    @property
    def packing(self) -> Piece | None:
        """The packing that a member goes on from; None for a packing."""
        return None if self.member is None else Piece(self.kind, self.seed)

    @property
    def first(self) -> int:
        """Cycles done at the start."""
        return 0 if self.member is None else self.kind.k_i

    @property
    def last(self) -> int:
        """Cycles done at the end."""
        return self.kind.k_i if self.member is None else self.kind.last

    @property
    def perturbation(self) -> float:
        """Displacement [m] of one grain at the start."""
        return (self.member or 0) * STEP


CONFINED = Kind(
    "confined",
    "confined, 50 Hz, as in the paper",
    "karrech",
    (),
    packings=3,
    members=2,
    k_i=50,
    last=500,
    window=10,
    marks=(0, 50, 100, 200, 300, 500),
    told=(10, 20, 50, 60, 75, 100, 150, 200, 300, 500),
)
PARTIAL = Kind(
    "partial",
    "partially confined, 10 Hz, as in the paper",
    "karrech-partial",
    (),
    packings=5,
    members=2,
    k_i=20,
    last=100,
    window=4,
    marks=(0, 20, 40, 60, 100),
    told=(5, 10, 20, 30, 40, 60, 80, 100),
)
COARSE = Kind(
    "coarse",
    "coarse and softer (150 grains, 10⁹ Pa), 50 Hz",
    "karrech-coarse",
    ("material.grain.young=1e9", "procedure.total_cycles=10000"),
    packings=5,
    members=2,
    k_i=100,
    last=10_000,
    window=100,
    marks=(0, 100, 200, 500, 1000, 2000, 5000, 10_000),
    told=(10, 100, 200, 500, 1000, 2000, 5000, 10_000),
)
KINDS = {kind.name: kind for kind in (CONFINED, PARTIAL, COARSE)}


def piston_stiffness(track: PistonTrack, steps_per_cycle: int) -> FloatArray:
    """Unloading stiffness dF/dz of the bed under the piston in each cycle [N/m], shape (c,).

    Slope by least squares of the contact force over the piston's height, over the samples behind
    the greatest target force in which the target is at least half of it.  Of one period with one
    peak; nan in a cycle with fewer than two such samples.
    """
    cycle = track.cycles(steps_per_cycle)
    slopes = []
    for number in range(int(cycle.max()) + 1):
        rows = np.flatnonzero(cycle == number)
        target = track.target_force[rows]
        peak = int(target.argmax())
        rows = rows[peak:][target[peak:] >= target[peak] / 2]
        height = track.height[rows] - track.height[rows].mean()
        slope = (
            -float(height @ track.contact_force[rows] / (height @ height))
            if len(rows) > 1 and height.any()
            else float("nan")
        )
        slopes.append(slope)
    return np.array(slopes)
