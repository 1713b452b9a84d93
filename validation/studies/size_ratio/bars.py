"""Below the wedge ratio every grain falls, and every roll is right."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from validation.case import Check

PAGE = "docs/size-ratio.md"
STEP = 0.2
"""Of our scenes, over the Rayleigh time."""
OFF = 0.01
"""Greatest error of a roll [-]."""


def check_bars(rows: Sequence[dict[str, Any]]) -> list[Check]:
    """Two bars for each engine."""
    checks = []
    for engine in dict.fromkeys(row["engine"] for row in rows):
        mine = [row for row in rows if row["engine"] == engine]
        held = sum(
            not row["falls"]
            for row in mine
            if row["ratio"] < row["wedge_ratio"] and row["share"] == STEP
        )
        off = max(abs(row["off"]) for row in mine)
        checks += [
            Check(f"{engine}: stuck below the wedge ratio", held, "<= 0", held == 0, "", PAGE),
            Check(f"{engine}: greatest error of a roll", off, f"<= {OFF}", off <= OFF, "", PAGE),
        ]
    return checks
