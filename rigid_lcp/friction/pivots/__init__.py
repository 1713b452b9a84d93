"""Pivoting: states, updates of factors, drives."""

from rigid_lcp.friction.pivots.drive import (
    DONE,
    NORMAL,
    SINGULAR,
    TANGENTIAL,
    TOO_MANY,
    drive,
    move_contact,
    settle_values,
)
from rigid_lcp.friction.pivots.shift import SHIFT_LEAST, remove_shift, set_lists
from rigid_lcp.friction.pivots.state import (
    Pivots,
    drive_offset,
    judge_pivots,
    read_pivots_force,
    start_pivots,
)
from rigid_lcp.friction.pivots.updates import (
    BREAKING,
    LIST_NAMES,
    SLIDING_DOWN,
    SLIDING_UP,
    STATIC,
    TURNING,
    Geometry,
    Ints,
    Reduced,
    multiply_geometry,
    refresh_reduced,
    scatter_column,
    slide_sign,
    solve_reduced,
)

__all__ = [
    "BREAKING", "DONE", "LIST_NAMES", "NORMAL", "SHIFT_LEAST", "SINGULAR", "SLIDING_DOWN",
    "SLIDING_UP", "STATIC", "TANGENTIAL", "TOO_MANY", "TURNING", "Geometry", "Ints", "Pivots",
    "Reduced", "drive", "drive_offset", "judge_pivots", "move_contact", "multiply_geometry",
    "read_pivots_force", "refresh_reduced", "remove_shift", "scatter_column", "set_lists",
    "settle_values", "slide_sign", "solve_reduced", "start_pivots",
]  # fmt: skip
