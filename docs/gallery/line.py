"""Unevenness against tonnage

A kilometre of line under 10 million axles: where bad beds stay bad, and where they forget.  Bands
hold nine sections of 200 m in ten; the line is the limit at which tamping is due at 40 m/s.
"""

import sys

import numpy as np
from matplotlib import pyplot

from track_line.beam import Track
from track_line.beds import Scatter
from track_line.laws import get_law
from track_line.settling import Axle, find_alert_limit, make_line, march_line, start_line
from trackbed.report import STYLE

pyplot.rcParams.update(STYLE)
KINDS = {"bad beds stay bad": (None, "#D55E00"), "forgotten after 2 mm": (2e-3, "#0072B2")}

figure, axes = pyplot.subplots(figsize=(7.2, 4))
for label, (memory, colour) in KINDS.items():
    line = make_line(
        1000.0, Track(), get_law("shenton")(lift=0.02), [Axle(load=200e3)],
        Scatter(memory=memory), lines=20,
    )  # fmt: skip
    records = [record for _, record in march_line(line, start_line(line), 1e7)]
    tonnage = line.find_tonnage(np.array([one.cycle for one in records]))
    d1 = 1e3 * np.array([one.deviation for one in records])
    low, median, high = np.quantile(d1, (0.05, 0.5, 0.95), axis=(1, 2))
    axes.fill_between(tonnage, low, high, color=colour, alpha=0.2, lw=0)
    axes.plot(tonnage, median, color=colour, label=label)
axes.axhline(1e3 * find_alert_limit(40.0), color="0.3", ls="--", lw=1, label="limit")
axes.set(xlabel="MGT", ylabel="standard deviation of D1 (mm)", xlim=(0, None), ylim=(0, None))
axes.legend(loc="upper left")
figure.savefig(sys.argv[1])
