"""Fit your laboratory series

Ten readings, and what several laws together say up to ten times the last cycle.  The band holds the
truth in nine such cases of ten.
"""

import sys
from pathlib import Path

import numpy as np

from adapters.files import Series
from adapters.laws.fit import draw_forecast, fit_auto
from trackbed.report import save_figure

cycle = np.array([1, 2, 5, 10, 20, 50, 100, 200, 500, 1000.0])
settlement = np.array([1.10, 1.31, 1.63, 1.84, 2.08, 2.41, 2.62, 2.85, 3.15, 3.36])  # mm
series = Series(cycle, settlement, unit="mm")

save_figure(
    lambda: draw_forecast(series, lambda later: fit_auto(series, later), 1e4), Path(sys.argv[1])
)
