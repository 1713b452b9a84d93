"""Beds as they were measured, by a sweep of grain simulations or in a track: what a scene takes."""

from track_line.measured.ensemble import Ensemble
from track_line.measured.fit import BedFit, fit_beds
from track_line.measured.tables import read_beds
from track_line.measured.words import format_figures, format_settings, list_doubts, summarise_fit

__all__ = [
    "BedFit", "Ensemble", "fit_beds", "format_figures", "format_settings", "list_doubts",
    "read_beds", "summarise_fit",
]  # fmt: skip
