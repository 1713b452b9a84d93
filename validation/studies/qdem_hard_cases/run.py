"""The parts: a sliver, locking, steps near the critical one."""

from __future__ import annotations

from validation.bench.qdem.checks import make_row
from validation.bench.qdem.hard import check_locking, check_near_critical, check_sliver
from validation.study import Row

LOCKING, QUADRATIC = ((12, 2, 2), (24, 4, 4), (48, 8, 8)), (36, 6, 6)
"""Cells of the linear meshes, and of the quadratic one that they are compared with."""


def run_sliver() -> Row:
    """A cube with four elements flattened to a hundredth of their altitude."""
    return make_row(check_sliver())


def run_locking() -> Row:
    """Tip of the paper's cantilever at three Poisson's ratios."""
    return make_row(check_locking(LOCKING, QUADRATIC))


def run_steps() -> Row:
    """0.99 and 1 times the critical step."""
    return make_row(check_near_critical(1_000_000))


PARTS = {"sliver": run_sliver, "locking": run_locking, "steps": run_steps}
