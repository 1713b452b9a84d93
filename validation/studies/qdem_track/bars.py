"""The figures of 20 grains; of three packings, what the higher friction leaves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from validation.bench.qdem.checks import list_checks
from validation.case import Check
from validation.studies.qdem_track.bogie import FRICTIONS
from validation.study import Row

PAGE = "docs/qdem-track.md"
STALE = "made before grains were scattered as they begin to fall; not what the code does today"


def check_bars(rows: Sequence[Row]) -> list[Check]:
    """Every figure of the record against its bar."""
    checks = list_checks(rows, PAGE)
    for row in rows:
        for friction in FRICTIONS if "runs" in row else ():
            name = f"300 grains, friction {friction:g}: missing in the account of energies, worst"
            worst = max(run["imbalance"] for run in row["runs"] if run["friction"] == friction)
            checks.append(Check(name, worst, "<= 0.001", worst <= 1e-3, page=PAGE, why=STALE))
        for point in ("sleeper", "B2") if "runs" in row else ():
            for key in ("greatest", "lateral"):
                ratio = compare_frictions(row, point, key)
                name = f"300 grains, friction 1.73 over 0.577: {key} of {point}, mean of packings"
                checks.append(Check(name, ratio, "< 1", ratio < 1, page=PAGE, why=STALE))
    return checks


def compare_frictions(row: Row, point: str, key: str) -> float:
    """Mean over packings at the higher friction over that at the lower."""
    low, high = (
        np.mean([r["points"][point][key] for r in row["runs"] if r["friction"] == friction])
        for friction in FRICTIONS
    )
    return float(high / low)
