"""The margins of the design, from the record as far as it goes."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, inf
from typing import Any

from adapters.bed.state import FloatArray
from validation.case import Check
from validation.studies.settlement.beds import COARSE, CONFINED, FAR, UNSEEN, Kind
from validation.studies.settlement.reading import find_errors, find_interval, find_step_speedup

GROWING, DOUBLED = "growing", "growing, step x 2"
MARGINS = (
    (CONFINED, GROWING, 10, 5), (CONFINED, DOUBLED, 10, 10), (COARSE, GROWING, 5, None),
    (UNSEEN, GROWING, 15, None), (FAR, GROWING, 10, 30),
)  # fmt: skip
"""Bed, way, margin of the loaded body's mean error [%], and by how much cheaper it is to be."""
STIFFNESS = 5.0
"""Margin of the mean error of the stiffness [%]."""
PAGE = "docs/settlement.md"


def check_bars(rows: Sequence[dict[str, Any]]) -> list[Check]:
    """Error, cost and stiffness of each judged way, on the packings that are in the record."""
    checks: list[Check] = []
    for kind, way, margin, cheaper in MARGINS:
        name = f"{kind.name}, {way}"
        errors = find_errors(rows, kind, way, "loaded_body")
        if len(errors) < 2:
            continue  # not measured yet, as the page says
        low, high = find_interval(errors)
        why = describe_reach(errors, kind, margin)
        checks.append(
            check_most(f"{name}: bound of the 90 % interval of the mean error",
                       100 * max(-low, high), margin, why)
        )  # fmt: skip
        stiffness = find_errors(rows, kind, way, "stiffness")
        value = 100 * abs(float(stiffness.mean())) if len(stiffness) else inf
        checks.append(check_most(f"{name}: mean stiffness", value, STIFFNESS, why))
        if cheaper is not None:
            value = find_step_speedup(rows, kind, way)
            holds = value >= cheaper
            checks.append(
                Check(f"{name}: cheaper by, at equal cost a step", value, f">= {cheaper}", holds,
                      "", PAGE, "" if holds else "jumps need their windows")
            )  # fmt: skip
    return checks


def check_most(name: str, value: float, bar: float, why: str) -> Check:
    """A value in % that may not exceed its bar; one that does says why."""
    holds = value <= bar
    return Check(name, value, f"<= {bar:g}", holds, "%", PAGE, "" if holds else why)


def describe_reach(errors: FloatArray, kind: Kind, margin: float) -> str:
    """How many packings there are, and how many an unbiased way of this scatter would need."""
    words = f"{len(errors)} of {len(kind.seeds)} packings measured"
    if len(errors) < 3:
        return words
    mean, spread = 100 * float(errors.mean()), 100 * float(errors.std(ddof=1))
    room = margin - abs(mean)
    need = f"{ceil((1.65 * spread / room) ** 2):,} would do" if room > 0 else "no number would do"
    return f"{words}; mean {mean:+.0f} %, scatter {spread:.0f} % a packing: {need}"
