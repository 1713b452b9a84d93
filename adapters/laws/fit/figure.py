"""The picture of a fit: readings, what is predicted behind them, and where that is refused."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from adapters.errors import JumpRefused
from adapters.laws.fit.prediction import Prediction, Series

if TYPE_CHECKING:
    from matplotlib.figure import Figure

POINTS = 12
"""Cycles behind the last reading at which a prediction is drawn, evenly spaced in ln N."""


def draw_forecast(
    series: Series, predict: Callable[[float], Prediction], to_cycle: float
) -> Figure:
    """Settlement against the user's load cycles; ``predict`` gives it at cycles of the series."""
    from matplotlib.figure import Figure

    begin, last = series.counted_from, float(series.cycle[-1])
    cycles, found, refused = [last], [], None
    for cycle in np.geomspace(last, to_cycle, POINTS)[1:] if to_cycle > last else ():
        try:
            found.append(predict(float(cycle)))
        except JumpRefused as refusal:
            refused = refusal.regime
            break
        cycles.append(float(cycle))
    ahead, anchor = np.array(cycles) + begin, float(series.settlement[-1])
    low, high = np.array([(anchor, anchor), *(one.band for one in found)]).T
    figure = Figure(figsize=(7.2, 4.0))
    axis = figure.subplots()
    axis.plot(series.cycle + begin, series.settlement, "ko", ms=3, label="readings")
    axis.fill_between(ahead, low, high, color="#0b5fa5", alpha=0.15, lw=0, label="band")
    joint = [anchor, *(one.prediction for one in found)]
    axis.plot(ahead, joint, color="#0b5fa5", label=f"predicted: {found[-1].law}" if found else None)
    for name, said in found[-1].laws.items() if found else ():
        own = np.array([anchor, *(one.laws[name].prediction for one in found)], float)
        style, label = ("--", f"{name}, agrees") if said.agrees else (":", name)
        axis.plot(ahead, own, style, lw=0.9, label=label)
    if refused:
        axis.axvspan(ahead[-1], to_cycle + begin, color="#e07b00", alpha=0.2, lw=0,
                     label=f"refused: {refused}")  # fmt: skip
    axis.set(xscale="log", xlabel="load cycles", ylabel=f"settlement ({series.unit})")
    axis.invert_yaxis()
    axis.legend(loc="lower left")
    return figure
