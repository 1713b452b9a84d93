"""What a hanging sleeper does to its neighbours

A bogie stands over a sleeper whose bed lies lower than the others.  The rail carries the load past
the void, so the two neighbours press harder on their beds, which settle faster for it.
"""

import sys

import numpy as np
from matplotlib import pyplot

from track_line.beam import Track, assemble_rail, make_support, rest_wheels
from trackbed.report import STYLE

pyplot.rcParams.update(STYLE)
track = Track()
place = track.spacing * np.arange(-40, 41)
rail = assemble_rail(place, track)
support = make_support(track, np.full((1, len(place)), track.bed))
load = np.zeros(len(place))
load[[40, 43]] = 100e3  # N: wheels of a bogie, 1.8 m apart

figure, (bent, pressed) = pyplot.subplots(2, 1, figsize=(7.2, 4.6), sharex=True)
for k, (void, colour) in enumerate(((0.0, "#0072B2"), (1e-3, "#E69F00"), (3e-3, "#D55E00"))):
    settled = np.zeros((1, len(place)))
    settled[0, 40] = void
    rest = rest_wheels(rail, support, settled, load)
    bent.plot(place, 1e3 * rest.rail[0], "o-", ms=3, color=colour, label=f"{1e3 * void:g} mm")
    pressed.bar(place + 0.15 * (k - 1), 1e-3 * rest.force[0], 0.14, color=colour)
bent.set(ylabel="rail sinks (mm)")
bent.invert_yaxis()
bent.legend(title="void under the sleeper at 0", loc="lower left")
pressed.set(xlabel="along the line (m)", ylabel="force on the bed (kN)", xlim=(-3.2, 5))
figure.savefig(sys.argv[1])
