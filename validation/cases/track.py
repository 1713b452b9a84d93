"""A slice of ballasted track: prepared to equilibrium, loaded, taken up again.

    trackbed validate track --quick    20 grains: equilibrium, energies, resume, two frictions
    trackbed validate track            also softer springs, and what rigid grains save in the fall

What the figures mean: ``docs/qdem-track.md``.
"""

from __future__ import annotations

from validation.case import Check
from validation.track_trials import all_checks


def run(quick: bool) -> list[Check]:
    """All checks."""
    return all_checks(quick)
