"""Beds along a line: drawn at random, changed in zones."""

from track_line.beds.fields import Scatter, Zone, draw_beds, draw_scores, renew_scores
from track_line.beds.state import Beds

__all__ = ["Beds", "Scatter", "Zone", "draw_beds", "draw_scores", "renew_scores"]
