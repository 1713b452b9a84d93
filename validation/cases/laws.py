"""Laws of settlement: what law auto says of ten times the last known cycle, against its bars.

Real ballast (12 cyclic triaxial tests, cut at 300, 1,000, 3,000 and 10,000 cycles) where
TRACKBED_DATA names the folder; series made from twelve families of the literature, read off with
noise and as few digits as a published curve; five families that must be refused; and the mean
settlement of full engine runs, one doubling and ten times ahead: measured, no bar.

    trackbed validate laws            a minute
    trackbed validate laws --quick    what has bars alone

Both draw all members of the families: the 90th percentile of fewer is off by several per cent.
"""

from __future__ import annotations

from collections.abc import Sequence

from validation.case import Check
from validation.cases.jump_without_engine import data_folder, skipped
from validation.law_series import fast_cases
from validation.law_study import MEMBERS, Row, auto_rows, auto_summary, sources

ERROR_BAR, ERROR_90_BAR, COVERAGE_BAR = 0.08, 0.2, 0.85
FALSE_ALARM_BAR = 0.1
"""Share refused of made series, whose rates fall for good: one cut short of its bend still grows.
Real ballast does ratchet for some hundred cycles, so a refusal there is no false alarm."""
ALARM_BAR = 0.95
JUDGED = ("ballast", "families")


def source_checks(
    source: str, found: Row, total: int, judged: Sequence[str] = JUDGED, where: str = ""
) -> list[Check]:
    """Error, band and refusals on one source, against its bars where it is among the ``judged``.

    ``where``: what the names begin with, if not with the source and its cases.
    """
    barred = source in judged
    where = where or f"{source} ({found['cases']} of {total} cases, others refused)"

    def at_most(name: str, value: float, bar: float, barred: bool = barred) -> Check:
        said = f"<= {bar}" if barred else "measured"
        return Check(f"{where}: {name}", value, said, value <= bar or not barred)

    covered = found["coverage"]
    return [
        at_most("median error", found["error"], ERROR_BAR),
        at_most("90th percentile of the error", found["error_90"], ERROR_90_BAR),
        Check(
            f"{where}: coverage of the 90 % band",
            covered,
            f">= {COVERAGE_BAR}" if barred else "measured",
            covered >= COVERAGE_BAR or not barred,
        ),
        Check(f"{where}: median half-width", found["half_width"], "measured", True),
        at_most("refused", found["refused"] / total, FALSE_ALARM_BAR, source == "families"),
        Check(f"{where}: CPU time of a prediction", found["cost_s"], "measured", True, "s"),
    ]


def run(quick: bool) -> list[Check]:
    """Checks on every source that is here; ``quick`` leaves out those that have no bars."""
    folder = data_folder()
    checks = [] if folder else skipped()
    for source, cases in sources(MEMBERS, folder).items():
        if source in JUDGED or not quick:
            checks += source_checks(source, auto_summary(auto_rows(cases)), len(cases))
    fast = auto_rows(fast_cases(MEMBERS))
    refused = sum(not row["allowed"] for row in fast) / len(fast)
    name = f"constant or growing rate ({len(fast)} series): share refused"
    return [*checks, Check(name, refused, f">= {ALARM_BAR}", refused >= ALARM_BAR)]
