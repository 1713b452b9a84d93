"""What the protocol judges: every run credible or named, the same work on every engine."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import Any

from validation.case import Check
from validation.studies.engines.reading import (
    ENGINES,
    FIGURES,
    JUDGED,
    LEVEL,
    TITLES,
    find_median_speed,
    group_by_way,
    pair,
)
from validation.study import estimate_mean

PAGE = "docs/engines.md"
SAME_WORK = 0.01
"""Greatest relative difference of the contacts a grain between two engines: the same bed."""


def check_bars(rows: Sequence[dict[str, Any]]) -> list[Check]:
    """Failed runs, differences that are real, contacts of the timed beds, speeds."""
    runs = group_by_way(rows)
    failed = [row for row in rows if not row.get("ok", True)]
    checks = [Check("runs that failed", len(failed), "<= 0", not failed)]
    for first, second in combinations(ENGINES, 2):
        for key in JUDGED:
            words, factor, _ = FIGURES[key]
            mean, half = estimate_mean(pair(runs, second, first, key) * factor, LEVEL)
            name = f"{TITLES[second]} less {TITLES[first]}: {words}"
            bar = f"<= {half:.3g}"
            checks.append(Check(name, abs(mean), bar, abs(mean) <= half, page=PAGE))
    for grains in sorted({row["grains"] for row in rows if "speed" in row}):
        timed = [row for row in rows if "speed" in row and row["grains"] == grains]
        contacts = [row["contacts_per_grain"] for row in timed]
        apart = max(contacts) / min(contacts) - 1
        name = f"{grains:,} grains: contacts a grain, greatest difference of two engines"
        checks.append(Check(name, apart, f"<= {SAME_WORK:g}", apart <= SAME_WORK, page=PAGE))
        for engine in ENGINES:
            speed = find_median_speed(rows, engine, grains)[0] / 1e6
            name = f"{TITLES[engine]}, {grains:,} grains: million grain-steps a CPU second"
            checks.append(Check(name, speed, "measured", speed > 0, page=PAGE))
    return checks
