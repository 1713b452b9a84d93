"""Speed of the engines on one settled bed, and what trackbed adds to each.

    trackbed validate engine-speed            about 1,100 and 10,000 grains, half an hour
    trackbed validate engine-speed --quick    1,111 softer grains, two to four minutes

docs/engine-speed.md has the figures, errors beside them; `python -m validation.engine_speed_runs`
makes its record.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from validation.case import Check
from validation.engine_speed_page import medians, of_kind, share_at_paper, speeds
from validation.engine_speed_runs import (
    ADAPTER_YOUNG,
    REPEATS,
    SPEED,
    YOUNG,
    Row,
    adapter_rows,
    speed_rows,
)

SAME_WORK = 0.01
"""Greatest relative difference of the contacts per grain between two engines: the same bed."""


def run(quick: bool) -> list[Check]:
    """Measure, and judge; raises `EngineMissing` when there is no engine."""
    repeats = 3 if quick else REPEATS
    sizes = {(1, 1): (100, 1100)} if quick else SPEED
    with TemporaryDirectory() as temporary:
        work = Path(temporary)
        young = ADAPTER_YOUNG if quick else YOUNG
        rows = list(speed_rows(work, lambda row: False, sizes, repeats, young))
        rows += adapter_rows(work, lambda row: False, 1 if quick else repeats)
    return checks_of([row | {"ok": True} for row in rows])


def checks_of(rows: Sequence[Row]) -> list[Check]:
    """Checks of measured rows, as `validation.engine_speed_runs` has them."""
    checks = []
    for (engine, grains), (middle, *_) in speeds(rows).items():
        name = f"{engine}, {grains} grains: grain-steps a CPU second"
        checks.append(Check(name, middle, "> 0", middle > 0, "1/s"))
    contacts: dict[int, list[float]] = {}
    for row in of_kind(rows, "speed"):
        contacts.setdefault(row["setting"]["grains"], []).append(row["contacts_per_grain"])
    for grains, found in contacts.items():
        apart = max(found) / min(found) - 1
        name = f"{grains} grains: contacts per grain, greatest difference of two engines"
        checks.append(Check(name, apart, f"<= {SAME_WORK:g}", apart <= SAME_WORK))
    chosen = of_kind(rows, "adapter")
    alone = medians(chosen, [], lambda row: row["alone_s"])
    through = medians(chosen, [], lambda row: row["cost_s"])
    for (engine,), (middle, *_) in through.items():
        steps = next(row["steps_per_cycle"] for row in chosen if row["method"] == engine)
        name = f"{engine}: the engine alone over trackbed"
        bare = alone[engine,][0]
        why = f"none: a frame every {steps} steps"
        checks.append(Check(f"{name}, {steps} steps a cycle", bare / middle, why, ok=True))
        share = share_at_paper(bare, middle, steps)
        checks.append(Check(f"{name}, the paper's cycle", share, ">= 0.95", share >= 0.95))
    return checks
