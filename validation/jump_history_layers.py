"""Where full runs are compacted: settlement by layers, piston beside mean grain.

A table of docs/jump-history.md, from the reference ensemble's record.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from adapters.state import FloatArray
from validation.page_text import table
from validation.settlement_ensemble import COARSE, CONFINED, Kind, Piece
from validation.settlement_ensemble_record import EnsembleRecord
from validation.settlement_rivals import BLOCK, mean_of
from validation.settlement_rivals_reference import columns_by_cycle

LAYERS = 6
"""From the lowest centre to the highest."""
BETWEEN: tuple[tuple[Kind, int, int], ...] = (
    (CONFINED, 100, 500),
    (COARSE, 200, 2000),
    (COARSE, 200, 10_000),
)
"""Ensemble, cycles between which every run's state is kept."""


@dataclass(frozen=True, eq=False)
class Compacted:
    """Mean over the runs of an ensemble between two cycles."""

    kind: Kind
    first: int
    last: int
    layers: FloatArray
    """Settlement of each layer over the mean of all grains, bottom first, shape (`LAYERS`,)."""
    ratio: FloatArray
    """What the piston sank by over what the mean grain settled, of each run, shape (r,)."""


def compacted(kind: Kind, first: int, last: int, record: EnsembleRecord) -> Compacted:
    """Layers and pistons of all members that have come to cycle ``last``."""
    settled, mean, ratio = list[list[float]](), list[float](), list[float]()
    for piece in kind.runs():
        _, position = record.states(piece.name)
        if not isinstance(piece, Piece) or piece.packing is None or last not in position:
            continue
        height, drop = position[first][:, 2], (position[first] - position[last])[:, 2]
        above = (height - height.min()) / (height.max() - height.min())
        layer = np.minimum((LAYERS * above).astype(int), LAYERS - 1)
        settled.append([float(drop[layer == each].mean()) for each in range(LAYERS)])
        mean.append(float(drop.mean()))
        columns = columns_by_cycle(piece, record)
        sunk, gained = (
            mean_of(columns, last, name) - mean_of(columns, first + BLOCK, name)
            for name in ("piston_height", "settlement")
        )
        ratio.append(-sunk / gained)
    layers = np.mean(settled, axis=0) / np.mean(mean)
    return Compacted(kind, first, last, layers, np.array(ratio))


def table_layers(record: EnsembleRecord) -> str:
    """A line a case, and what a uniform strain would be."""
    lines = []
    for case in BETWEEN:
        one = compacted(*case, record)
        scatter = f"{one.ratio.mean():.1f} ± {one.ratio.std(ddof=1):.1f}"
        cells = [f"{value:.2f}" for value in one.layers]
        name = f"{one.kind.name}, {one.first:,} to {one.last:,}"
        lines.append([name, *cells, scatter])
    even = [f"{(2 * each + 1) / LAYERS:.2f}" for each in range(LAYERS)]
    lines.append(["uniform strain", *even, "2.0"])
    head = ["run", "lowest layer", *(str(each) for each in range(2, LAYERS)), "highest"]
    return table([*head, "piston over mean grain"], lines)
