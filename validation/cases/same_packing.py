"""One packing on every engine that is installed: settlement, coordination number, density.

    trackbed validate same-packing            the whole study, 40 CPU minutes with three engines
    trackbed validate same-packing --quick    one bed and five cycles on each engine, one minute

The study's own record and page are docs/engines.md; `validation.same_packing` says what is done.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from itertools import combinations
from pathlib import Path

import numpy as np

from adapters.overlaps import neighbours
from validation.case import Check
from validation.cases.engines import engines_present
from validation.same_packing import SEEDS, WAYS, Figures, bed_scene, rained
from validation.same_packing import (
    run as run_way,
)
from validation.same_packing_reading import FIGURES, JUDGED, LEVEL, by_way, paired
from validation.same_packing_runs import Row, plan, row_of
from validation.student import interval

QUICK_CYCLES = 5


def run(quick: bool) -> list[Check]:
    """The checks of the engines that are here; raises `EngineMissing` where LIGGGHTS is not."""
    present = engines_present()
    if quick:
        return quick_checks(present)
    ways = {way.name for way in WAYS if way.engine in present}
    return record_checks([row_of(way, seed) for way, seed in plan() if way.name in ways])


def quick_checks(present: Sequence[str]) -> list[Check]:
    """One bed, a few cycles: all engines start from one state and stay near one another."""
    found: dict[str, Figures] = {}
    with tempfile.TemporaryDirectory() as temporary:
        home = Path(temporary)
        start, radius = rained(SEEDS[0], home / "rain")
        for way in WAYS:
            if way.name in present:
                found[way.name], _ = run_way(
                    way, SEEDS[0], start, radius, home / way.name, QUICK_CYCLES
                )
    checks = [
        Check(f"{name}: settlement of {QUICK_CYCLES} cycles over the mean radius",
              figures.settlement / radius.mean(), "<= 1",
              abs(figures.settlement) <= radius.mean())
        for name, figures in found.items()
    ]  # fmt: skip
    scene = bed_scene(SEEDS[0], 'engine.name="liggghts"')
    touching = neighbours(start, radius, scene.container.walls()).second >= 0
    common = 2 * int(touching.sum()) / len(radius)
    for name, figures in found.items():
        share = figures.coordination / common
        checks.append(
            Check(f"{name}: coordination number over the common start's", share, "0.6 to 1.4",
                  0.6 <= share <= 1.4)
        )  # fmt: skip
    for first, second in combinations(found, 2):
        apart = abs(found[first].density - found[second].density)
        checks.append(
            Check(f"{second} less {first}: relative density", apart, "<= 0.02", apart <= 0.02)
        )
    return checks


def record_checks(rows: Sequence[Row]) -> list[Check]:
    """What the protocol judges, of the rows of a study; a difference has no bar of its own."""
    runs = by_way(rows)
    failed = sum(not row["ok"] for row in rows)
    checks = [Check("runs that failed", failed, "0", failed == 0)]
    names = [way.name for way in WAYS if runs[way.name]]
    engines = [way.name for way in WAYS if way.name == way.engine and way.name in names]
    for first, second in combinations(engines, 2):
        for key in JUDGED:
            values = paired(runs, second, first, key)
            words, factor, _ = FIGURES[key]
            mean, half = interval(values * factor, LEVEL)
            checks.append(
                Check(f"{second} less {first}: {words}, interval {half:.3g}", mean, "finite", True)
            )
    if "liggghts, twin" in names:
        noise = float(np.std(paired(runs, "liggghts, twin", "liggghts", "settlement"), ddof=1))
        checks.append(Check("twin: standard deviation of settlement", noise, "finite", True, "m"))
    return checks
