"""How far to jump: slopes, forecasts, bands, control; pure functions of what was computed."""

from adapters.jumps.band import BAND_PROBABILITY, Band, estimate_band
from adapters.jumps.check import accept, judge, reject
from adapters.jumps.control import JUMP, Control, Decision, Settings, decide, join_stretch, observe
from adapters.jumps.forecast import fit_forecast
from adapters.jumps.rates import Stretch, find_rates
from adapters.jumps.slopes import (
    LOADED_BODY,
    SLOPES,
    Jumped,
    Landing,
    SlopeNumbers,
    estimate_slopes,
    find_asked_gain,
    remove_moves,
)

__all__ = [
    "BAND_PROBABILITY", "JUMP", "LOADED_BODY", "SLOPES", "Band", "Control", "Decision", "Jumped",
    "Landing", "Settings", "SlopeNumbers", "Stretch", "accept", "decide", "estimate_band",
    "estimate_slopes", "find_asked_gain", "find_rates", "fit_forecast", "join_stretch", "judge",
    "observe", "reject", "remove_moves",
]  # fmt: skip
