"""What does speed cost?

Unevenness after 60 million gross tonnes on the same beds.  Unsprung masses roll over what has
settled, press hardest on its low places, and so make them lower.
"""

import sys

import numpy as np
from matplotlib import pyplot

from track_line.beam import Track
from track_line.beds import Scatter
from track_line.laws import get_law
from track_line.settling import Axle, make_line, march_line, start_line
from trackbed.report import STYLE

pyplot.rcParams.update(STYLE)
AXLES, SPEEDS = 3e6, np.array([0, 20, 40, 60, 80])  # -, m/s
MASSES = {0.0: "#0072B2", 600.0: "#E69F00", 1200.0: "#D55E00"}  # kg a wheel

figure, axes = pyplot.subplots(figsize=(6.4, 3.8))
for mass, colour in MASSES.items():
    d1 = []
    for speed in SPEEDS if mass else SPEEDS[:1]:
        axle = Axle(load=200e3, unsprung_mass=mass)
        line = make_line(
            400.0, Track(), get_law("shenton")(lift=0.02), [axle], Scatter(), lines=8,
            speed=float(speed),
        )  # fmt: skip
        *_, (_, record) = march_line(line, start_line(line), AXLES)
        d1.append(1e3 * np.median(record.deviation))
    axes.plot(3.6 * SPEEDS, d1 if mass else d1 * len(SPEEDS), "o-", color=colour,
              label=f"{mass:g} kg a wheel")  # fmt: skip
axes.set(xlabel="speed (km/h)", ylabel="standard deviation of D1 (mm)", ylim=(0, None))
axes.legend(loc="lower left", title="unsprung mass")
figure.savefig(sys.argv[1])
