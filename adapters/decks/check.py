"""One process against windows: whether a deck that is cut computes the bed that it computes whole.

Round-off is not forgiven: engines that go on from a restart file with the same grains in the same
order give the same bits, so that any difference is a thing that the cut lost.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from adapters.bed import FloatArray
from adapters.decks.engine import Adopted, run_deck, run_window
from adapters.decks.split import format_whole
from adapters.decks.states import States, read_states

ROUND_OFF = 1e-6
"""Greatest difference over the longest way of a grain [-]: LAMMPS parts by the last digits, which
chaos makes 1e-9 of the way within a cycle or two; what a cut loses is seen in the first digits."""


@dataclass(frozen=True)
class Difference:
    """How far windows of one cycle part from one process, at the ends of c cycles."""

    grains: int
    place: FloatArray  # greatest difference of a grain's place [m], shape (c,)
    height: FloatArray  # of the loaded body's height [m], shape (c,); nan without
    path: FloatArray  # greatest way of a grain since the mark, to measure these by [m], shape (c,)
    cpu_s: float  # of both [s]

    @property
    def agrees(self) -> bool:
        """Whether they part by round-off at most: `ROUND_OFF` of the longest way of a grain."""
        return bool(self.place.max() <= ROUND_OFF * max(self.path.max(), np.finfo(float).tiny))


def check_cut(bed: Adopted, folder: Path, cycles: int = 2) -> Difference:
    """Run ``cycles`` cycles both ways in ``folder`` and compare them.

    Raises `EngineMissing`, `EngineFailed`, `NotCredible` where grains come or go.
    """
    whole = folder / "whole"
    whole.mkdir()
    cpu_s = run_deck(bed, format_whole(bed.deck, bed.engine, cycles), "whole.in", whole)
    one = read_states(whole, cycles, bed.loaded)
    before, ends = whole, list[States]()
    for cycle in range(cycles):
        window = folder / f"window_{cycle + 1}"
        window.mkdir()
        link_start(before, 0 if cycle == 0 else 1, window)
        cpu_s += run_window(bed, window, 1)
        ends.append(read_states(window, 1, bed.loaded))
        before = window
    place = np.array([end.position[1] for end in ends]) - one.position[1:]
    height = np.array([end.height[1] for end in ends]) - one.height[1:]
    way = one.position[1:] - one.position[0]
    return Difference(
        len(one.identifier), np.abs(place).max(axis=(1, 2)), np.abs(height),
        np.linalg.norm(way, axis=2).max(axis=1), cpu_s,
    )  # fmt: skip


def link_start(before: Path, cycle: int, window: Path) -> None:
    """Give a window the state and the restart file at the end of a ``cycle`` of another folder."""
    for kind in ("dump", "restart"):
        os.link(before / f"cycle_{cycle}.{kind}", window / f"cycle_0.{kind}")
