"""The ballasted track: bed, sleeper, bogie."""

from qdem_fem.track.enter import TrackPrepared, TrackScene, check_track, enter_track, preview_bed

__all__ = ["TrackPrepared", "TrackScene", "check_track", "enter_track", "preview_bed"]
