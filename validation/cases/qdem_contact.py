"""Frictional contact between deformable bodies: closed forms, hard cases, and what it costs.

    trackbed validate qdem-contact            some minutes
    trackbed validate qdem-contact --quick    smaller meshes and packings

What the figures mean: ``docs/qdem-contact.md``.
"""

from __future__ import annotations

from validation.case import Check
from validation.qdem_contact_hard import hard_checks
from validation.qdem_contact_hertz import hertz_checks
from validation.qdem_contact_pressed import disc_checks, groove_checks, vertex_checks
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
    checks += hertz_checks(quick) + disc_checks(quick) + groove_checks() + vertex_checks()
    checks += hard_checks()
    if not quick:
        checks += slab_checks()
    return checks + cost_checks(quick)
