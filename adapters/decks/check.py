"""One process against windows: whether a deck that is cut computes the bed that it computes whole.

Engines that go on from a restart file with the same grains in the same order give the same bits, or
part by round-off; more than that is a thing that the cut lost.
"""

import hashlib
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from adapters.bed import FloatArray
from adapters.decks.engine import Adopted, format_run, list_inputs, run_deck
from adapters.decks.states import States, read_states
from adapters.errors import NotCredible
from trackbed.run_files import digest_file, write_whole

ROUND_OFF = 1e-6
"""Greatest difference over the longest way of a grain [-]: LAMMPS parts by the last digits, which
chaos makes 1e-9 of the way within a cycle or two; what a cut loses is seen in the first digits."""

CHAOS = 100.0
"""By how much the second cycle may multiply a difference more than the first did [-]: a bed that
still collapses in YADE makes 1e-11 m of the last digit in a cycle, and 1e-5 m in two; so do two
runs that differ by 1e-16 m in the place of one grain."""


@dataclass(frozen=True)
class Difference:
    """How far windows of one cycle part from one process, at the ends of c cycles."""

    grains: int
    place: FloatArray  # greatest difference of a grain's place [m], shape (c,)
    height: FloatArray  # of the loaded body's height [m], shape (c,); nan without
    path: FloatArray  # greatest way of a grain since the mark, to measure these by [m], shape (c,)
    digit: float  # last digit of the greatest coordinate [m]

    @property
    def agrees(self) -> bool:
        """Whether they part by round-off at most: `ROUND_OFF` of the longest way of a grain, or
        what is left of a cycle's difference where the next multiplies it as the first did."""
        grown = CHAOS * self.place[0] / self.digit * self.place[:-1]
        allowed = np.maximum(ROUND_OFF * self.path.max(), np.concatenate([[0.0], grown]))
        worst = np.maximum(self.place, np.nan_to_num(self.height))
        return bool(self.path.max() > 0 and (worst <= allowed).all())


def digest_deck(bed: Adopted) -> str:
    """SHA-256 of what a deck computes, and of the files that it reads."""
    text = format_run(bed, "whole", 1) + ("\n".join(bed.deck.lines) if bed.deck.is_script else "")
    text += "".join(digest_file(bed.deck.path.parent / one) for one in list_inputs(bed.deck))
    return hashlib.sha256(text.encode(errors="surrogateescape")).hexdigest()


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

    Raises `EngineMissing`, `EngineFailed`, `NotCredible` where grains lie still, or are lost.
    """
    before = folder / "whole"
    before.mkdir()
    run_deck(bed, format_run(bed, "whole", cycles), before / "whole.in")
    one, ends = read_states(before, 0, cycles, bed), list[States]()
    for cycle in range(1, cycles + 1):
        if np.array_equal(one.position[cycle], one.position[cycle - 1], equal_nan=True):
            raise NotCredible(
                f"no grain moves in cycle {cycle}", where=str(bed.deck.path),
                remedy="put the marks around the commands that load the bed, whatever the step is",
            )  # fmt: skip
    for cycle in range(cycles):
        window = folder / f"window_{cycle + 1}"
        window.mkdir()
        os.link(before / f"cycle_{min(cycle, 1)}.restart", window / "cycle_0.restart")
        run_deck(bed, format_run(bed, "window", 1), window / "window.in")
        ends.append(read_states(window, 1, 1, bed))
        before = window
    apart = [np.inf] * cycles  # of other grains
    for cycle, end in enumerate(ends):
        if np.array_equal(end.identifier, (whole := one.at(cycle + 1)).identifier):
            apart[cycle] = np.abs(end.position - whole.position).max()
    height = np.array([end.height[0] for end in ends]) - one.height[1:]
    way = np.nanmax(np.linalg.norm(one.position[1:] - one.position[0], axis=2), axis=1)
    digit = float(np.spacing(np.nanmax(np.abs(one.position))))
    return Difference(len(one.identifier), np.array(apart), np.abs(height), way, digit)
