"""Pictures, series and spectra of a run."""

from qdem_fem.report import figures
from qdem_fem.report.deformed import OUTLINED, draw_deformed, find_bearing_spheres
from qdem_fem.report.series import draw_fields, draw_series
from qdem_fem.report.spectra import Mode, find_peak_frequencies
from qdem_fem.report.track import draw_track_pictures, list_track_facts
from qdem_fem.report.video import write_video

__all__ = [
    "OUTLINED", "Mode", "draw_deformed", "draw_fields", "draw_series", "draw_track_pictures",
    "figures", "find_bearing_spheres", "find_peak_frequencies", "list_track_facts", "write_video",
]  # fmt: skip
