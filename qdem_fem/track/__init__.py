"""The ballasted track: bed, sleeper, bogie."""

from qdem_fem.track.enter import TrackPrepared, TrackScene, enter_track, foresee_bed, track_load
from qdem_fem.track.recipe import SLEEPER

__all__ = [
    "SLEEPER", "TrackPrepared", "TrackScene", "enter_track", "foresee_bed", "track_load",
]  # fmt: skip
