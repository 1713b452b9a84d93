"""Members of the reference ensemble beside jumps of one of its beds: the same cycles in full."""

from __future__ import annotations

from typing import Any

from validation.move_study_engine import MEASURES, Judged
from validation.settlement_ensemble import Piece
from validation.settlement_ensemble_record import EnsembleRecord
from validation.settlement_rivals_reference import columns_by_cycle

Row = dict[str, Any]


def member_name(number: int) -> str:
    """How tables call a member."""
    return f"every cycle, ensemble's member {number}"


def rows_of_members(judged: Judged, seed: int, record: EnsembleRecord) -> list[Row]:
    """Rows like the study's of all members of a packing: they part from it at the kind's k_i.

    Only for a bed that begins at the ensemble's checkpoint, so that the members are its own.
    """
    assert judged.stored
    first = judged.k_i + judged.k
    target = first + judged.h
    found = []
    for number in range(judged.kind.members):
        columns = columns_by_cycle(Piece(judged.kind, seed, number), record)
        parts = {
            "before": range(first - judged.after + 1, first + 1),
            "start": range(target, target + 1),
            "after": range(target + 1, target + judged.after + 1),
        }
        row: Row = {
            name: {measure: [columns[cycle][measure] for cycle in cycles] for measure in MEASURES}
            for name, cycles in parts.items()
        }
        row["start"] = {measure: values[0] for measure, values in row["start"].items()}
        cost = sum(columns[cycle]["cpu_s"] for cycle in range(first + 1, target + judged.after + 1))
        row |= {"run": f"{judged.kind.name}-{seed}", "move": member_name(number), "cpu_s": cost}
        found.append(row)
    return found
