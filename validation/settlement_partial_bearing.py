"""What the piston of the partially confined bed stands on, by the states of the ensemble."""

from __future__ import annotations

import numpy as np

from adapters.jump_seating import HUNG, deflection_over_mean_field, spans
from adapters.state import FloatArray
from validation.page_text import table
from validation.settlement_ensemble import PARTIAL, Piece
from validation.settlement_ensemble_record import EnsembleRecord
from validation.settlement_rivals_reference import columns_by_cycle

NEAR = 1e-5
"""Gap [m] up to which a grain counts as under the piston: the seated beds spring by as much."""


def gaps_to_disc(
    position: FloatArray, radius: FloatArray, height: float, reach: float
) -> tuple[FloatArray, FloatArray]:
    """Gaps [m] between grains and a horizontal disc about the z axis, ascending; negative: overlap.

    ``position`` (n, 3) and ``radius`` (n,) of the grains, ``height`` of the disc and its radius
    ``reach``, in metres.  First those of grains whose centres are below the disc, then those of
    grains beside it, whose nearest point of it is on its rim.
    """
    beyond = np.maximum(np.hypot(position[:, 0], position[:, 1]) - reach, 0.0)
    gap = np.hypot(beyond, position[:, 2] - height) - radius
    return np.sort(gap[beyond == 0]), np.sort(gap[beyond > 0])


def bearing(piece: Piece, record: EnsembleRecord) -> dict[int, tuple[FloatArray, FloatArray]]:
    """`gaps_to_disc` of the piston at the ends of the cycles whose states a run keeps."""
    radius, position = record.states(piece.name)
    columns = record.table(piece.name)
    heights = dict(zip(columns["cycle"].tolist(), columns["piston_height"].tolist(), strict=True))
    reach = piece.kind.scene(piece.seed).piston_reach
    return {
        cycle: gaps_to_disc(where, radius, heights[cycle], reach)
        for cycle, where in position.items()
        if cycle in heights
    }


def near(gaps: tuple[FloatArray, FloatArray]) -> tuple[int, int]:
    """Grains within `NEAR` of the piston: under it, and beside its rim."""
    under, beside = gaps
    return int((under < NEAR).sum()), int((beside < NEAR).sum())


def mean_field_ratios(piece: Piece, record: EnsembleRecord) -> FloatArray:
    """Elastic deflection of every cycle of a full run since the rain, over the mean field's."""
    rows = list(columns_by_cycle(piece, record).values())
    return deflection_over_mean_field(piece.kind.scene(piece.seed), rows)


def hung_first(piece: Piece, record: EnsembleRecord) -> int:
    """The last cycle before the bed carries a full run's piston for the first time."""
    return int(np.flatnonzero(mean_field_ratios(piece, record) <= HUNG)[0])


def table_seating(record: EnsembleRecord) -> str:
    """Of every full run: elastic deflection over the mean field's, and where the piston hangs."""
    marks = (5, 20, 40, 60, 80, 100)
    lines = []
    for piece in PARTIAL.runs():
        if piece.packing is None or record.kept(piece.name) is None:
            continue
        ratio = mean_field_ratios(piece, record)
        told = [f"{ratio[mark - 1]:.1f}" if mark <= len(ratio) else "-" for mark in marks]
        hung = spans(np.flatnonzero(ratio > HUNG) + 1) or "-"
        lines.append([f"{piece.seed}, {1 + (piece.member or 0)}", *told, hung])
    return table(["packing, run", *(f"cycle {mark}" for mark in marks), "hangs in cycles"], lines)


def table_bearing(record: EnsembleRecord) -> str:
    """Of every full run at its kept cycles: grains under the piston and at its rim."""
    marks = [mark for mark in PARTIAL.marks if mark]
    lines = []
    for piece in PARTIAL.runs():
        if piece.packing is None or record.kept(piece.name) is None:
            continue
        found = bearing(piece.packing, record) | bearing(piece, record)
        told = ["{} + {}".format(*near(found[mark])) if mark in found else "-" for mark in marks]
        lines.append([f"{piece.seed}, {1 + (piece.member or 0)}", *told])
    return table(["packing, run", *(f"cycle {mark}" for mark in marks)], lines)
