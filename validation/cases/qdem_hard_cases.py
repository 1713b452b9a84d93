"""Hard cases of QDEM: slivers, nearly incompressible bodies, jumps, steps near the critical one.

    trackbed validate qdem-hard-cases            five million elements among them: some minutes
    trackbed validate qdem-hard-cases --quick    meshes to 10,368 elements: under a minute

What happens in each, and the figures: ``docs/qdem-hard-cases.md``.
"""

from __future__ import annotations

from collections.abc import Callable

from validation.case import Check
from validation.qdem_hard_bodies import (
    inverted_checks,
    left_handed_checks,
    loose_nodes_checks,
    parts_checks,
    single_element_checks,
)
from validation.qdem_hard_materials import Property, Where, jump_checks, locking_checks
from validation.qdem_hard_shapes import graded_checks, sliver_checks
from validation.qdem_hard_size import large_body_checks
from validation.qdem_hard_steps import near_critical_checks

Part = Callable[[], list[Check]]

JUMPS: list[tuple[Property, Where]] = [
    ("young", "tip half"), ("young", "core"), ("young", "random"),
    ("density", "tip half"), ("density", "core"), ("density", "random"),
]  # fmt: skip

SHARED: list[Part] = [
    sliver_checks,
    graded_checks,
    single_element_checks,
    parts_checks,
    loose_nodes_checks,
    left_handed_checks,
]


def run(quick: bool) -> list[Check]:
    """All checks, hard case after hard case."""
    checks = [check for part in SHARED for check in part()]
    checks += inverted_checks(range(5 if quick else 40))
    checks += near_critical_checks(100_000 if quick else 1_000_000)
    cells = (8, 2, 2) if quick else (12, 4, 4)
    for name, where in JUMPS:
        checks += jump_checks(name, where, cells, 20_000 if quick else 100_000)
    if quick:
        return checks + locking_checks(((12, 2, 2), (24, 4, 4)), (24, 4, 4))
    checks += locking_checks(((12, 2, 2), (24, 4, 4), (48, 8, 8)), (36, 6, 6))
    return checks + large_body_checks()
