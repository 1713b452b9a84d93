"""A line settles: blocks of axles, the level that a recording car would see, when to tamp."""

from track_line.settling.blocks import BLOCKS
from track_line.settling.level import BANDS, find_alert_limit, find_crossings
from track_line.settling.line import Axle, Line, make_line
from track_line.settling.march import Record, State, march_line, start_line

__all__ = [
    "BANDS", "BLOCKS", "Axle", "Line", "Record", "State", "find_alert_limit", "find_crossings",
    "make_line", "march_line", "start_line",
]  # fmt: skip
