"""Pictures, series and spectra of a run."""

from qdem_fem.report import figures
from qdem_fem.report.deformed import OUTLINED, draw_deformed
from qdem_fem.report.spectra import Mode, find_peak_frequencies
from qdem_fem.report.track import draw_track_pictures, list_track_facts

__all__ = [
    "OUTLINED", "Mode", "draw_deformed", "draw_track_pictures", "figures",
    "find_peak_frequencies", "list_track_facts",
]  # fmt: skip
