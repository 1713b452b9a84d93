"""The load of a passing train

The force on one rail seat while two cars roll by at 32 m/s, with a flat on a wheel of the third
axle: the rail spreads each axle over several sleepers, and lifts those farther away.
"""

import sys

from matplotlib import pyplot

from qdem_fem.track.loads import Track, Train, WheelFlat, make_train_record
from trackbed.report import STYLE

pyplot.rcParams.update(STYLE)
AREA = 0.13 * 0.17  # m^2, of a rail seat
flat = WheelFlat(axle=2, peak=60e3, duration=2e-3)
record = make_train_record(Train(cars=2), Track(), AREA, [flat])

figure, axes = pyplot.subplots(figsize=(9, 3.2))
axes.plot(record.time, 1e-3 * AREA * record.pressure[:, 0], color="#0072B2", lw=1)
axes.axhline(0, color="0.5", lw=0.8)
axes.set(xlabel="time (s)", ylabel="force on the rail seat (kN)")
figure.savefig(sys.argv[1])
