"""One process against windows: whether a deck that is cut computes the bed that it computes whole.

Engines that go on from a restart file with the same grains in the same order give the same bits, or
part by round-off; more than that is a thing that the cut lost.
"""

from __future__ import annotations

import hashlib
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from adapters.bed import FloatArray
from adapters.decks.engine import Adopted, run_deck
from adapters.decks.split import format_whole, format_window
from adapters.decks.states import States, read_states
from trackbed.run_files import write_whole

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

    @property
    def agrees(self) -> bool:
        """Whether they part by round-off at most: `ROUND_OFF` of the longest way of a grain."""
        worst = max(self.place.max(), np.nan_to_num(self.height).max())
        return bool(self.path.max() > 0 and worst <= ROUND_OFF * self.path.max())


def digest_deck(bed: Adopted) -> str:
    """SHA-256 of what a deck computes."""
    text = format_whole(bed.deck, bed.engine, 1).encode(errors="surrogateescape")
    return hashlib.sha256(text).hexdigest()


def keep_check(scene: Path, bed: Adopted) -> None:
    """Note beside a deck's scene that windows of it compute what one process does."""
    write_whole(scene.with_name("checked.txt"), digest_deck(bed) + "\n")


def is_checked(scene: Path, bed: Adopted) -> bool:
    """Whether `keep_check` noted this deck as it is."""
    try:
        return scene.with_name("checked.txt").read_text().strip() == digest_deck(bed)
    except (OSError, ValueError):
        return False


def check_cut(bed: Adopted, folder: Path, cycles: int = 2) -> Difference:
    """Run ``cycles`` cycles both ways in ``folder`` and compare them.

    Raises `EngineMissing`, `EngineFailed`, `NotCredible` where grains come or go.
    """
    before = folder / "whole"
    before.mkdir()
    run_deck(bed, format_whole(bed.deck, bed.engine, cycles), before / "whole.in")
    one, ends = read_states(before, 0, cycles, bed), list[States]()
    for cycle in range(cycles):
        window = folder / f"window_{cycle + 1}"
        window.mkdir()
        os.link(before / f"cycle_{min(cycle, 1)}.restart", window / "cycle_0.restart")
        run_deck(bed, format_window(bed.deck, bed.engine, 1), window / "window.in")
        ends.append(read_states(window, 1, 1, bed))
        before = window
    place = np.array([end.position[0] for end in ends]) - one.position[1:]
    height = np.array([end.height[0] for end in ends]) - one.height[1:]
    way = np.linalg.norm(one.position[1:] - one.position[0], axis=2).max(axis=1)
    return Difference(len(one.identifier), np.abs(place).max(axis=(1, 2)), np.abs(height), way)
