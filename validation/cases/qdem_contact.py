"""Frictional contact between deformable bodies: faces, slopes, a heap, and what it costs.

    trackbed validate qdem-contact            some minutes
    trackbed validate qdem-contact --quick    smaller meshes and packings

What the figures mean: ``docs/qdem-contact.md``.
"""

from __future__ import annotations

from validation.case import Check
from validation.qdem_contact_trials import (
    cost_checks,
    faces_checks,
    heap_checks,
    slab_checks,
    slope_checks,
)


def run(quick: bool) -> list[Check]:
    """All checks, trial after trial."""
    checks = slope_checks() + faces_checks(quick) + heap_checks(quick)
    if not quick:
        checks += slab_checks()
    return checks + cost_checks(quick)
