"""Voids under a line

Sixty metres after three million axles, at rest.  Where the bed lies below the underside of its
sleeper, the sleeper hangs from the rail and hits the bed under each axle.
"""

import sys

import numpy as np
from matplotlib import pyplot

from track_line.beam import Track, rest_wheels
from track_line.beds import Scatter
from track_line.laws import get_law
from track_line.settling import Axle, make_line, march_line, start_line
from trackbed.report import STYLE

pyplot.rcParams.update(STYLE)
line = make_line(
    60.0, Track(), get_law("shenton")(lift=0.02), [Axle(load=200e3)], Scatter(settlement=0.4)
)
*_, (state, _) = march_line(line, start_line(line), 3e6)
rest = rest_wheels(line.rail, line.support, state.settled, np.zeros(len(line.beds.place)))
place, bed, gap = (one[line.inside] for one in (line.beds.place, *state.settled, *rest.gap))
bed, gap = 1e3 * bed, 1e3 * gap  # mm
under, hangs = bed - gap, gap > 0.1

figure, axes = pyplot.subplots(figsize=(9, 3.6))
axes.fill_between(place, bed, bed.max() + 2, color="#c9b79c", lw=0, step="mid", label="ballast")
axes.plot(place, under, color="0.2", lw=1, label="undersides of sleepers")
ends = place[hangs], under[hangs], bed[hangs]
axes.vlines(*ends, color="#D55E00", lw=3, label="void above 0.1 mm")
axes.set(xlabel="along the line (m)", ylabel="below the tamped level (mm)", xlim=(0, 60))
axes.set_ylim(bed.max() + 2, under.min() - 4)
axes.legend(loc="upper right", ncol=3)
figure.savefig(sys.argv[1])
