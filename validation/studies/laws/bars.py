"""The bars of law auto on real ballast and on the families."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from validation.case import Check

PAGE = "docs/laws.md"
ERROR, ERROR_90, COVERAGE = 0.08, 0.2, 0.85
FALSE_ALARM, ALARM = 0.1, 0.95
"""Share refused: at most of the slow families, whose rates fall for good; at least of the fast.
Real ballast does ratchet for some hundred cycles, so a refusal there is no false alarm."""


def check_bars(rows: Sequence[dict[str, Any]]) -> list[Check]:
    """Error, band and refusals against what was asked before."""
    found = {row["part"]: row for row in rows}
    checks = []
    for source in ("ballast", "frequency", "families"):
        auto = found[source]["auto"]
        for text, key, bar in (
            ("median error", "error", ERROR),
            ("90th percentile of the error", "error_90", ERROR_90),
        ):
            value = auto[key]
            checks.append(Check(f"{source}: {text}", value, f"<= {bar:g}", value <= bar, page=PAGE))
        value = auto["coverage"]
        name = f"{source}: share of cases whose 90 % band holds the truth"
        checks.append(Check(name, value, f">= {COVERAGE:g}", value >= COVERAGE, page=PAGE))
    for rival in ("nothing", "hyperbolic", "log"):
        value, bar = (
            row["rms"] for row in (found["ballast"]["auto"], found["ballast"]["methods"][rival])
        )
        name = f"ballast: rms error beside {rival}"
        checks.append(Check(name, value, f"<= {bar:.3g}", value <= bar, page=PAGE))
    families, fast = found["families"]["auto"], found["fast"]
    alarms = families["refused"] / (families["cases"] + families["refused"])
    refused = fast["refused"] / fast["cases"]
    return [
        *checks,
        Check("families: share refused", alarms, f"<= {FALSE_ALARM:g}", alarms <= FALSE_ALARM,
              page=PAGE),
        Check("constant or growing rate: share refused", refused, f">= {ALARM:g}",
              refused >= ALARM, page=PAGE),
    ]  # fmt: skip
