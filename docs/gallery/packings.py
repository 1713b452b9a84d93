"""How many packings are enough?

A hundred rains of the same 150 grains, each loaded 500 times, from the record of the settlement
study.  One packing may settle half or twice as far as the next; the mean of ten is known to about
a quarter.
"""

import json
import sys
from pathlib import Path

import numpy as np
from matplotlib import pyplot
from scipy.stats import t

from trackbed.report import STYLE
from validation.studies.settlement.beds import EVERY, KINDS
from validation.studies.settlement.reading import LEVEL, select_rows

pyplot.rcParams.update(STYLE)
record = Path(__file__).parents[2] / "validation" / "studies" / "settlement" / "record.jsonl"
rows = [json.loads(line) for line in record.read_text().splitlines()]
full = select_rows(rows, KINDS["coarse"], EVERY).values()
gain = 1e3 * np.array([row["loaded_body"] for row in full])  # mm, cycle 50 to 500
count = np.arange(2, 31)
half = t.ppf((1 + LEVEL) / 2, count - 1) * gain.std(ddof=1) / np.sqrt(count)

figure, (each, mean) = pyplot.subplots(1, 2, figsize=(9, 3.4), sharey=True, width_ratios=(1, 2))
each.hist(gain, 20, orientation="horizontal", color="#0072B2")
each.set(xlabel="packings", ylabel="settlement, cycle 50 to 500 (mm)", ylim=(0, 3.3))
mean.fill_between(count, gain.mean() - half, gain.mean() + half, color="#E69F00", alpha=0.4, lw=0,
                  label=f"mean of so many, {LEVEL:.0%} band")  # fmt: skip
mean.axhline(gain.mean(), color="#D55E00", label=f"mean of {len(gain)}")
mean.set(xlabel="packings that are computed", xlim=(2, 30))
mean.legend(loc="upper right")
figure.savefig(sys.argv[1])
