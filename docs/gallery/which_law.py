"""Which law?

The same readings up to cycle 100, extrapolated by each law alone.  All fit what is known; at ten
times the cycles they differ by more than the readings can decide.
"""

import sys

import numpy as np
from matplotlib import pyplot

from adapters.laws import get_law
from trackbed.report import STYLE

pyplot.rcParams.update(STYLE)
cycle = np.array([1, 2, 5, 10, 20, 50, 100.0])
settlement = np.array([1.10, 1.31, 1.63, 1.84, 2.08, 2.41, 2.62])  # mm
later = np.geomspace(100, 1000, 50)
colours = {
    "log": "#0072B2", "power": "#D55E00", "hyperbolic": "#009E73",
    "stretched-exponential": "#CC79A7", "inverse-log": "#E69F00",
}  # fmt: skip

figure, axes = pyplot.subplots(figsize=(7.2, 4))
axes.plot(cycle, settlement, "ko", label="readings")
for name, colour in colours.items():
    law = get_law(name)
    parameters = law.fit(cycle, settlement[:, None])
    ahead = settlement[-1] + [law.increment(parameters, 100, to)[0] for to in later]
    axes.plot(later, ahead, color=colour, label=f"{name}: {law.formula}")
axes.set(xscale="log", xlabel="load cycles", ylabel="settlement (mm)", ylim=(3.6, 0.9))
axes.legend(loc="lower left")
figure.savefig(sys.argv[1])
