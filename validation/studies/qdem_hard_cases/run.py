"""The parts: a sliver, locking, steps near the critical one."""

from __future__ import annotations

from validation.bench.qdem.checks import figures_row
from validation.bench.qdem.hard import locking_checks, near_critical_checks, sliver_checks
from validation.study import Row

LOCKING, QUADRATIC = ((12, 2, 2), (24, 4, 4), (48, 8, 8)), (36, 6, 6)
"""Cells of the linear meshes, and of the quadratic one that they are compared with."""


def sliver() -> Row:
    """A cube with four elements flattened to a hundredth of their altitude."""
    return figures_row(sliver_checks())


def locking() -> Row:
    """Tip of the paper's cantilever at three Poisson's ratios."""
    return figures_row(locking_checks(LOCKING, QUADRATIC))


def steps() -> Row:
    """0.99 and 1 times the critical step."""
    return figures_row(near_critical_checks(1_000_000))


PARTS = {"sliver": sliver, "locking": locking, "steps": steps}
