"""How many healing cycles a jump wants, in tables for docs/settlement-rivals.md.

Healing cycles (`procedure.healing_cycles`) are computed behind a jump and kept out of the next fit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from adapters.state import FloatArray
from validation.page_text import table
from validation.settlement_bars import jumps_of
from validation.settlement_rivals import HEALED, HEALING, METHODS, Method, Row
from validation.settlement_rivals_budget_tables import pm
from validation.settlement_rivals_reading import (
    cheaper_even,
    finished,
    judged,
    mean_by_packing,
    reference,
)

BEHIND = ((1, 1), (2, 2), (3, 3), (4, 5), (6, 10))
"""Cycles behind a jump, first and last, whose settlement is told."""


def by_healing() -> list[Method]:
    """Five jumps by history and by the law, of each the ways with fewer healing cycles first."""
    default = [
        method
        for method in METHODS
        if any(replace(other, name=method.name, healing=HEALING) == method for other in HEALED)
    ]
    ways = [*HEALED, *default]
    return sorted(ways, key=lambda method: (method.settings == (), method.healing))


def table_healing(rows: Sequence[Row], last: int) -> str:
    """A line for each number of healing cycles: cost and errors over the reference's mean."""
    head = [
        "way", "healing cycles", "packings", "cycles computed", "attempts failed", "cheaper by",
        "settlement", "coordination number", "elastic deflection",
    ]  # fmt: skip
    truth, lines = reference(rows, last), []
    for method in by_healing():
        mine = finished(rows, method.name, last)
        if not mine:
            continue
        cells = []
        for key in ("settlement", "coordination", "deflection"):
            found = judged(rows, method.name, last, key)
            cells.append("-" if found is None else pm(found.error, 100, 0, " %", bold=True))
        computed = float(np.mean([row["computed"] for row in mine]))
        lines.append(
            [way_of(method), str(method.healing), str(len(mine)), f"{computed:.0f}",
             str(sum(len(row["lost"]) for row in mine)), f"{cheaper_even(mine, truth):.1f}", *cells]
        )  # fmt: skip
    return table(head, lines)


def way_of(method: Method) -> str:
    """The name without the number of healing cycles."""
    return method.name.removesuffix(f", {method.healing} healing")


def slope(sides: Row, cycles: tuple[int, int]) -> float:
    """Mean settlement a cycle times the cycle's number [m] in some cycles behind a jump, the first
    and the last of them counted from 1; nan where none is known."""
    first, last = cycles
    gains = np.array(sides["after"]["settlement"][first - 1 : last], float)
    numbers = sides["last"] + first + np.arange(len(gains))
    return float(np.mean(gains * numbers)) if len(gains) else float("nan")


def slopes(rows: Sequence[Row], name: str, last: int, cycles: tuple[int, int]) -> FloatArray:
    """`slope` of a method's jumps, mean over those of each packing [m]."""
    return mean_by_packing(
        (row["seed"], slope(sides, cycles))
        for row in finished(rows, name, last)
        for sides in row.get("sides", [])
    )


def table_transient(studies: Sequence[tuple[str, Sequence[Row], Sequence[str]]], last: int) -> str:
    """Settlement a cycle times the cycle's number, cycle by cycle behind jumps.

    ``studies``: words for the bed, rows with the sides of full runs beside those of jumps
    (`settlement_bars.sides_compared`), names of methods.
    """
    ends = [f"{first}" if first == end else f"{first} to {end}" for first, end in BEHIND]
    head = ["bed", "way", "jumps", *(f"cycle {end}, µm" for end in ends), "full runs, µm"]
    lines = []
    for bed, rows, names in studies:
        for name in names:
            jumps = jumps_of(rows, name, last)
            if not jumps:
                continue
            others = mean_by_packing(
                (number, slope(other, (1, 10)))
                for jump in jumps
                for number, other in enumerate(jump["others"])
            )
            cells = [pm(slopes(rows, name, last, cycles), 1e6, 0) for cycles in BEHIND]
            lines.append([bed, name, str(len(jumps)), *cells, f"{1e6 * others.mean():+.0f}"])
    return table(head, lines)
