"""Rates against what was published, and errors at the settings that scenes have."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from validation.bench.qdem.checks import check_between, check_near, report
from validation.case import Check

PADS = "pads also spare stones and spread the load on more of them; our laws know the force alone"
SPREAD = "neighbours that are alike decide it, and over which length they are was not measured"
USUAL = "variation 0.2"


def check_bars(rows: Sequence[dict[str, Any]]) -> list[Check]:
    """What is in the record, and no more."""
    found = {row["part"]: row for row in rows}
    rates = {name.removeprefix("rate, "): row for name, row in found.items() if "rate" in row}
    checks = []
    if USUAL in rates:
        usual, pads = rates[USUAL], rates["sleeper pads: beds of 14 MN/m"]
        checks += [
            check_between("rate of D1, variation 0.2", 1e5 * usual["rate"], 0.5, 3.0, "mm/100 MGT"),
            explain(check_between("rate with sleeper pads, over that without",
                                  pads["rate"] / usual["rate"], 0.4, 0.6), PADS),
            explain(check_between("D1 over mean settlement",
                                  usual["d1"] / usual["settlement"], 0.1, 0.2), SPREAD),
            report("unsprung mass at 40 m/s, over the wheel load", 100 * usual["added"], "%"),
        ]  # fmt: skip
    for name, row in found.items():
        if name.startswith("soft ground"):
            more = row["worst_poor"] / row["poor"]
            checks.append(check_between(f"{row['law']}: worst windows on soft, uneven ground, over "
                                        "their share", more, 1.5, 5.0))  # fmt: skip
        if "blocks" in row:
            (_, _, taken), comb = row["blocks"][1], row["comb"][-1][2]
            checks.append(check_between(f"{row['law']}: error by blocks", 100 * taken, 0, 1, "%"))
            checks.append(check_between(f"{row['law']}: error by wheels of the comb", 100 * comb,
                                        0, 0.01, "%"))  # fmt: skip
    if "rose" in found:
        checks.append(check_near("ROSE: settlement by 12,288 axles", 1e3 * found["rose"]["last"],
                                 3.053204, 1e-5, "mm"))  # fmt: skip
    return checks


def explain(check: Check, why: str) -> Check:
    """A bar that may be missed, with the reason for it."""
    return check if check.holds else Check(**vars(check) | {"why": why})
