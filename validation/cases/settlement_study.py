"""The settlement study's verdict: every bar read from the committed records, no engine, seconds.

    trackbed validate settlement-study --json F      F, and F.html with work-precision pictures

Reference ensemble, the best way of jumping on three beds, laws, jump control, hard cases and
relaxation, each bar with its value and the page that shows it: ``docs/settlement-study.md``.  A bar
that is known to be missed is told as missed, with the reason where one is known; it does not make
the exit code non-zero, any other that is missed does.  ``--quick`` changes nothing.
"""

from __future__ import annotations

from validation.case import Check
from validation.settlement_study import study_checks
from validation.settlement_study_report import report_write

__all__ = ["report_write", "run"]


def run(quick: bool) -> list[Check]:
    """All checks, section after section."""
    return [check for _, checks in study_checks() for check in checks]
