"""From grains to track geometry

A hundred packings of 150 grains, from the record of the settlement study, and a line whose beds
scatter as much, by the law of Shenton.  Beds of more grains scatter less.
"""

import json
import sys
from pathlib import Path

import numpy as np
from matplotlib import pyplot

from track_line.beam import Track
from track_line.beds import Scatter
from track_line.laws import get_law
from track_line.settling import Axle, make_line, march_line, start_line
from trackbed.report import STYLE
from validation.studies.settlement.beds import EVERY, KINDS
from validation.studies.settlement.reading import select_rows

pyplot.rcParams.update(STYLE)
study = Path(__file__).parents[2] / "validation" / "studies" / "settlement"
rows = map(json.loads, (study / "record.jsonl").read_text().splitlines())
tables = [row["table"] for row in select_rows(list(rows), KINDS["coarse"], EVERY).values()]
cycle = np.array(tables[0]["cycle"])
settled = 1e3 * np.array([table["loaded_body"] for table in tables])  # mm
settled -= settled[:, :1]
scatter = Scatter(settlement=settled[:, -1].std() / settled[:, -1].mean())
line = make_line(200.0, Track(), get_law("shenton")(lift=0.02), [Axle(load=200e3)], scatter)
figure, (beds, level) = pyplot.subplots(1, 2, figsize=(9, 3.4), width_ratios=(1, 1.6))
beds.plot(cycle, settled.T, color="#0072B2", lw=0.5, alpha=0.5)
beds.set(xlabel="load cycles", ylabel="settled since cycle 1 (mm)", xscale="log", ylim=(4.5, 0))
for axles, colour in ((5e4, "#009E73"), (5e5, "#E69F00"), (2e6, "#D55E00")):
    *_, (state, _) = march_line(line, start_line(line), axles)
    place, bed = line.beds.place[line.inside], 1e3 * state.settled[0, line.inside]
    level.plot(place, bed, color=colour, lw=1, label=f"{line.find_tonnage(axles):.0f} MGT")
level.set(xlabel="along the line (m)", ylabel="bed below tamping (mm)", xlim=(0, 200), ylim=(45, 0))
level.legend(loc="lower center", ncol=3)
figure.savefig(sys.argv[1])
