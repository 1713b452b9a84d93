"""A line settles: blocks of axles, the level that a recording car would see, when to tamp."""

from track_line.settling.blocks import BLOCKS, find_block, measure_gain
from track_line.settling.level import (
    LEVEL,
    Passband,
    find_alert_limit,
    find_crossings,
    measure_deviations,
    smooth_level,
)
from track_line.settling.line import Axle, Line, Traffic, make_line
from track_line.settling.march import Record, State, march_line, start_line

__all__ = [
    "BLOCKS", "LEVEL", "Axle", "Line", "Passband", "Record", "State", "Traffic",
    "find_alert_limit", "find_block", "find_crossings", "make_line", "march_line",
    "measure_deviations", "measure_gain", "smooth_level", "start_line",
]  # fmt: skip
