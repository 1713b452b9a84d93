"""Jumps by tolerance at paper scale beside the full runs of the same packings.

The runs are those of the study of rivals (`validation.settlement_rivals_studies`), confined to
cycle 500; full runs are the reference ensemble's, two a packing.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from adapters.state import FloatArray
from validation.jump_liggghts import share_interval
from validation.jump_study import HEALING
from validation.settlement_ensemble import CONFINED, Piece
from validation.settlement_ensemble_record import EnsembleRecord
from validation.settlement_rivals import Row
from validation.settlement_rivals_studies import STUDIES

WAY, TOLERANCE = "tolerance 0.02", 0.02


@dataclass(frozen=True)
class PaperJump:
    """A jump with its healing cycles, beside full runs of the packing; lengths in m."""

    seed: int
    first: int
    last: int
    """Cycles N and N + h."""
    gained: float
    """Settlement from N to the end of the healing cycles."""
    full: FloatArray
    """Of each full run between the same cycles, shape (members,)."""
    settled: float
    """Since the rain at the later, mean of the full runs."""

    @property
    def within(self) -> bool:
        """Whether it gains what the full runs do on the mean, to within the tolerance."""
        return self.off(self.gained, float(self.full.mean()))

    @property
    def full_within(self) -> bool:
        """Whether the full runs gain the same as one another, the least and the most."""
        return self.off(float(self.full.min()), float(self.full.max()))

    def off(self, one: float, other: float) -> bool:
        """Whether two gains differ by no more than the tolerance."""
        return bool(abs(one - other) <= TOLERANCE * abs(self.settled))


def paper_jumps(rows: Sequence[Row], record: EnsembleRecord) -> Iterator[PaperJump]:
    """Every jump of the finished runs by tolerance among ``rows``."""
    for row in rows:
        if row["method"] != WAY or row["refused"] or row["last"] != STUDIES["confined"].last:
            continue
        curves = full_curves(row["seed"], record)
        for side, (_, moved) in zip(row["sides"], row["moved"], strict=True):
            first, end = side["first"], side["last"] + HEALING
            gained = moved + sum(side["after"]["settlement"][:HEALING])
            full = np.array([curve[end] - curve[first] for curve in curves])
            settled = float(np.mean([curve[end] for curve in curves]))
            yield PaperJump(row["seed"], first, side["last"], gained, full, settled)


def full_curves(seed: int, record: EnsembleRecord) -> list[FloatArray]:
    """Settlement since the rain [m] of a packing's full runs at every cycle, from 0 on."""
    curves = []
    for member in range(CONFINED.members):
        piece = Piece(CONFINED, seed, member)
        assert piece.packing is not None
        curve = record.since_rain(piece.packing.name, piece.name)["settlement"]
        curves.append(np.array([0.0, *curve]))
    return curves


def paper_told(jumps: Sequence[PaperJump]) -> dict[str, str]:
    """What they say, for the page of jump control."""
    return {
        "paper_seeds": str(len({one.seed for one in jumps})),
        "paper_tolerance": f"{TOLERANCE:g}",
        "paper_within": share_interval([one.within for one in jumps]),
        "paper_full": share_interval([one.full_within for one in jumps]),
    }
