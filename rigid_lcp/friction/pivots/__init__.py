"""Pivoting: states, updates of factors, drives."""

from rigid_lcp.friction.pivots.covering import follow_from_forces, follow_from_nothing
from rigid_lcp.friction.pivots.drive import DONE, consider_contacts
from rigid_lcp.friction.pivots.shift import SHIFT, remove_shift
from rigid_lcp.friction.pivots.state import drive_offset, judge_pivots, read_pivots, start_pivots

__all__ = [
    "DONE", "SHIFT", "consider_contacts", "drive_offset", "follow_from_forces",
    "follow_from_nothing", "judge_pivots", "read_pivots", "remove_shift", "start_pivots",
]  # fmt: skip
