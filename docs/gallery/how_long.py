"""How long must a laboratory test be?

The same test, stopped earlier and later, and what its readings then say of cycle 100,000.  The
forecast nears the truth with every decade; a test that is too short gets no answer.
"""

import sys

import numpy as np
from matplotlib import pyplot

from adapters.files import Series
from adapters.laws.fit import fit_auto
from trackbed.errors import TrackbedError
from trackbed.report import STYLE

pyplot.rcParams.update(STYLE)
LAST = 1e5
cycle = np.unique(np.geomspace(1, 3e4, 46).round())
random = np.random.default_rng(3)
settled = 1.2 * cycle**0.15 + 0.01 * random.normal(size=len(cycle))  # mm

figure, axes = pyplot.subplots(figsize=(7.2, 3.8))
axes.axhline(1.2 * LAST**0.15, color="#D55E00", label="true settlement at cycle 100,000")
axes.plot(cycle, settled, ".", color="0.6", label="readings")
for stop in (30, 100, 300, 1000, 3000, 10000, 30000):
    known = cycle <= stop
    try:
        found = fit_auto(Series(cycle[known], settled[known], unit="mm"), LAST)
    except TrackbedError:
        axes.plot(stop, 0.8, "x", color="#0072B2")
        axes.annotate("refused", (stop, 0.8), (0, 6), textcoords="offset points", ha="center")
        continue
    down, up = found.prediction - found.band[0], found.band[1] - found.prediction
    axes.errorbar(stop, found.prediction, [[down], [up]], fmt="o", color="#0072B2", capsize=3)
axes.errorbar([], [], [], fmt="o", color="#0072B2", capsize=3, label="forecast, 90 % band")
axes.set(xscale="log", xlabel="last cycle that was measured", ylabel="settlement (mm)")
axes.invert_yaxis()
axes.legend(loc="lower left")
figure.savefig(sys.argv[1])
