"""Error against cost

Ways to reach the last cycle of a bed, from the record of the settlement study: how far the loaded
body errs, with the 90 % interval of the mean, and what was paid, over computing every cycle.
"""

import json
import sys
from pathlib import Path

from matplotlib import pyplot

from trackbed.report import STYLE
from validation.studies.settlement.beds import KINDS, list_methods
from validation.studies.settlement.reading import LEVEL, find_errors, find_step_speedup
from validation.study import estimate_mean

pyplot.rcParams.update(STYLE)
record = Path(__file__).parents[2] / "validation" / "studies" / "settlement" / "record.jsonl"
rows = [json.loads(line) for line in record.read_text().splitlines()]
kind = KINDS["coarse"]
COLOURS = ["#0072B2", "#56B4E9", "#999999", "#E69F00", "#000000", "#009E73", "#D55E00", "#CC79A7"]

figure, axes = pyplot.subplots(figsize=(7.2, 4))
axes.axhline(0, color="0.5", lw=0.8)
for method, colour, mark in zip(list_methods(kind), COLOURS, "oshD^vPX", strict=True):
    errors = 100 * find_errors(rows, kind, method.name, "loaded_body")
    if len(errors) > 1:
        mean, half = estimate_mean(errors, LEVEL)
        cost = 1 / find_step_speedup(rows, kind, method.name)
        axes.errorbar(cost, mean, half, fmt=mark, color=colour, capsize=3, label=method.name)
axes.set(xlim=(0, 1), xlabel="cost over that of every cycle", ylabel="error (%)", title=kind.title)
axes.legend(loc="upper right")
figure.savefig(sys.argv[1])
