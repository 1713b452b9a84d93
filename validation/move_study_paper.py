"""What docs/moves.md says in words of the bed at paper scale: moved, not moved, and in full."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from adapters.moves import moves_known
from validation.jump_history_behind import PROFILE, SMOOTHED, first_share, told, way_jumps
from validation.move_study import Row
from validation.move_study_engine import PAPER
from validation.move_study_reading import (
    beds,
    change,
    cycles,
    median_of,
    offline_rows,
    way_to_end,
    ways_of,
)


def first_rate(row: Row) -> float:
    """Settlement of the first cycle behind the jump [m]."""
    return float(cycles(row, "after", "rate")[0])


def later_rate(row: Row) -> float:
    """Settlement a cycle from the second one behind the jump on [m]."""
    return float(cycles(row, "after", "rate")[1:].mean())


def softer(row: Row) -> float:
    """Elastic deflection behind the jump beside that before it, less 1."""
    return change(row, "elastic_deflection")


def stiffer(row: Row) -> float:
    """The same of the piston's stiffness."""
    return change(row, "piston_stiffness")


def kinds_of(rows: Sequence[Row]) -> dict[str, list[Row]]:
    """Rows of the bed that nothing moved, of beds that were moved, of runs of every cycle."""
    ways = ways_of(rows)
    moved = [way for way in ways if way in moves_known() and way != "still"]
    full = [way for way in ways if way not in moves_known()]
    return {
        "STILL": beds(rows, "still"),
        "MOVED": [row for way in moved for row in beds(rows, way)],
        "FULL": [row for way in full for row in beds(rows, way)],
    }


def range_told(rows: Sequence[Row], figure: Callable[[Row], float], scale: float, form: str) -> str:
    """Least and greatest of a figure over rows, times a scale."""
    ends = [format(scale * end, form) for end in (min(map(figure, rows)), max(map(figure, rows)))]
    return " to ".join(dict.fromkeys(ends))


def words_of(offline: Sequence[Row], rows: Sequence[Row]) -> dict[str, str]:
    """Marks of the page's template and what stands there; ``rows`` with the ensemble's members."""
    kinds = kinds_of(rows)
    parts = {
        "PAPER_FIRST_CYCLES": str(PAPER.k_i),
        "PAPER_STILL": range_told(kinds["STILL"], first_rate, 1e6, ".1f"),
        "PAPER_FIRST": range_told(kinds["MOVED"], first_rate, 1e6, ".1f"),
        "PAPER_FULL": range_told(kinds["FULL"], first_rate, 1e6, ".1f"),
        "PAPER_LATER": range_told(kinds["MOVED"], later_rate, 1e6, ".1f"),
        "FULL_LATER": range_told(kinds["FULL"], later_rate, 1e6, ".1f"),
        "FULL_SETTLED": range_told(kinds["FULL"], way_to_end, 1e6, ".0f"),
        "FULL_RUNS": str(len(kinds["FULL"])),
    }
    for kind, mine in kinds.items():
        parts[f"{kind}_DEFLECTION"] = range_told(mine, softer, 100, "+.0f")
        parts[f"{kind}_STIFFNESS"] = range_told(mine, stiffer, 100, "+.0f")
    for way in ("profile", "smoothed"):
        mine = beds(rows, way)
        field = median_of(offline_rows(offline, "paper scale", way), "field_relaxed")
        parts[f"{way.upper()}_FIELD"] = f"{field:.2f}"
        parts[f"{way.upper()}_SETTLED"] = range_told(mine, way_to_end, 1e6, ".0f")
        parts[f"{way.upper()}_STIFFNESS"] = range_told(mine, stiffer, 100, "+.0f")
    for bed, jumps in (("partial", "1 jump"), ("coarse", "5 equal")):
        for name, words in (("PROFILE", PROFILE), ("SMOOTHED", SMOOTHED)):
            behind = way_jumps(bed, f"{words}, {jumps}")
            parts[f"{bed.upper()}_{name}"] = told(behind, first_share)
    return parts
