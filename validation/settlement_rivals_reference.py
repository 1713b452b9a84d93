"""What the rivals are compared with: members of an ensemble, and laws fitted to their curves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from adapters.fit_auto import outlook
from adapters.laws import law_named
from adapters.state import FloatArray
from validation.settlement_ensemble import Kind, Piece
from validation.settlement_ensemble_record import EnsembleRecord
from validation.settlement_rivals import (
    BLOCK,
    FIRST_WINDOW,
    Row,
    figures_of,
    mean_of,
    profile,
)
from validation.settlement_rivals_continuity import CYCLES, sides_without_jump

LAWS = tuple(
    (law, cycles) for law in ("log", "auto") for cycles in (FIRST_WINDOW, 5 * FIRST_WINDOW)
)
"""A law, and cycles behind k_i that are computed before it stands for the rest."""


def law_name(law: str, cycles: int) -> str:
    """A fitted law among the methods, such as ``law log, 20 cycles``."""
    return f"law {law}, {cycles} cycles"


def columns_by_cycle(piece: Piece, record: EnsembleRecord) -> dict[int, dict[str, float]]:
    """Columns of the packing's cycles and the member's, by cycle."""
    assert piece.packing is not None
    table = record.since_rain(piece.packing.name, piece.name)
    rows = (dict(zip(table, row, strict=True)) for row in zip(*table.values(), strict=True))
    return {int(row["cycle"]): row for row in rows}


def curves_of_reference(kind: Kind, record: EnsembleRecord) -> list[dict[str, FloatArray]]:
    """Tables of all members as far as they came, their packings' before them."""
    return [
        record.since_rain(piece.packing.name, piece.name)
        for piece in kind.runs()
        if piece.packing is not None and record.kept(piece.name) is not None
    ]


def sides_of_reference(
    curves: Sequence[dict[str, FloatArray]], first: int, last: int
) -> list[dict[str, Any]]:
    """What every member that came so far has on both sides of cycles ``first`` to ``last``."""
    return [
        sides_without_jump(curve, curve["cycle"], first, last)
        for curve in curves
        if curve["cycle"][-1] >= last + CYCLES
    ]


def engine_s(found: dict[int, dict[str, float]], k_i: int, last: int) -> float:
    """CPU time of the engine from k_i to ``last`` [s]."""
    return float(sum(found[cycle]["cpu_s"] for cycle in range(k_i + 1, last + 1)))


def reference_row(piece: Piece, last: int, record: EnsembleRecord) -> Row:
    """The figures of a member, whose state at ``last`` the ensemble keeps; time without Python.

    ``begun``: settlement [m] from the rain to k_i.
    """
    kept, k_i = record.kept(piece.name), piece.kind.k_i
    assert kept is not None
    found = columns_by_cycle(piece, record)
    found = {cycle: columns for cycle, columns in found.items() if cycle <= last}
    cpu_s = engine_s(found, k_i, last)
    radius, position = record.states(piece.name)
    layers = profile(piece.kind.scene(piece.seed), kept.density_height, position[last], radius)
    row: Row = {"computed": last - k_i, "cost": {"engine": cpu_s}, "cpu_s": cpu_s}
    row["steps_per_cycle"] = piece.kind.scene(piece.seed).steps_per_cycle
    row["begun"] = mean_of(found, k_i, "settlement")
    return row | figures_of(found, k_i) | {"profile": layers, "engine": kept.engine}


def law_row(law: str, cycles: int, piece: Piece, last: int, record: EnsembleRecord) -> Row:
    """Settlement at ``last`` by a law fitted to the curve of a member: no bed is left.

    ``auto``: the prediction of `adapters.fit_auto` from all cycles since the rain; another: that
    law's value, fitted to the ``cycles`` behind k_i.
    """
    found, k_i = columns_by_cycle(piece, record), piece.kind.k_i
    first, end = (1 if law == "auto" else k_i + 1), k_i + cycles
    cycle = np.arange(first, end + 1, dtype=float)
    path = np.array([found[int(c)]["settlement"] for c in cycle])
    if law == "auto":
        predicted = float(outlook(cycle, path[:, None], last).prediction[0])
    else:
        chosen = law_named(law)
        at_end = chosen.value(chosen.fit(cycle, path), np.arange(last - BLOCK + 1.0, last + 1))
        predicted = float(np.mean(at_end))
    settlement = predicted - mean_of(found, k_i, "settlement")
    cpu_s = engine_s(found, k_i, end)
    return {
        "computed": cycles,
        "cost": {"engine": cpu_s},
        "cpu_s": cpu_s,
        "settlement": {str(last): settlement},
    }
