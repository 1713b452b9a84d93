"""Loads of a passing train: rail, wheels, roughness, records."""

from qdem_fem.track.loads.rail import (
    Track,
    seat_share,
)
from qdem_fem.track.loads.record import (
    RATE,
    load_record_write,
)
from qdem_fem.track.loads.rolling import (
    find_rolling_forces,
)
from qdem_fem.track.loads.roughness import (
    RailKind,
    Roughness,
    WheelKind,
)
from qdem_fem.track.loads.train import (
    LONGEST,
    Train,
    WheelFlat,
    find_flat_forces,
    make_train_record,
)

__all__ = [
    "LONGEST",
    "RATE",
    "RailKind",
    "Roughness",
    "Track",
    "Train",
    "WheelFlat",
    "WheelKind",
    "find_flat_forces",
    "find_rolling_forces",
    "load_record_write",
    "make_train_record",
    "seat_share",
]
