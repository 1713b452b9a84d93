"""The rail on pads, sleepers and beds that only push: wheels rest on it or roll over it."""

from track_line.beam.contact import Passage, Rest, Support, make_support, rest_wheels, roll_axle
from track_line.beam.rail import GRAVITY, Rail, Track, assemble_rail

__all__ = [
    "GRAVITY", "Passage", "Rail", "Rest", "Support", "Track", "assemble_rail",
    "make_support", "rest_wheels", "roll_axle",
]  # fmt: skip
