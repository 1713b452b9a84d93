"""Loads of a passing train: rail, wheels, roughness, records."""

from qdem_fem.track.loads.rail import Track, find_seat_share
from qdem_fem.track.loads.rolling import find_rolling_forces
from qdem_fem.track.loads.roughness import RailKind, Roughness, WheelKind
from qdem_fem.track.loads.train import (
    MOST_SAMPLES,
    RATE,
    Train,
    WheelFlat,
    find_flat_forces,
    make_train_record,
    write_load_record,
)

__all__ = [
    "MOST_SAMPLES", "RATE", "RailKind", "Roughness", "Track", "Train", "WheelFlat", "WheelKind",
    "find_flat_forces", "find_rolling_forces", "find_seat_share", "make_train_record",
    "write_load_record",
]  # fmt: skip
