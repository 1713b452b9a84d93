"""A grading, and the grains that are drawn from it

EN 13450 31.5/50 between its limits, and the sizes of 550 grains of a scene: one from each of as
many slices of equal number, so that the curve is met as well as so many grains can.
"""

import sys

import numpy as np
from matplotlib import pyplot

from trackbed.report import STYLE
from trackbed.scene_files import GRADINGS, draw_sizes

pyplot.rcParams.update(STYLE)
grading = GRADINGS["EN 13450 31.5/50"]
sizes = np.sort(draw_sizes(grading, 550, np.random.default_rng(1)))
passing = np.cumsum(sizes**3) / np.sum(sizes**3)

figure, axes = pyplot.subplots(figsize=(6.4, 3.8))
low, high = (100 * one for one in grading.limits)
sieves = 1e3 * grading.sieves
axes.fill_between(sieves, low, high, color="#E69F00", alpha=0.25, lw=0, label="limits")
axes.plot(sieves, 100 * grading.passing, "--", color="#D55E00", label="asked for")
axes.plot(1e3 * sizes, 100 * passing, color="#0072B2", label="550 grains")
axes.set(xlabel="sieve (mm)", ylabel="passing (% by mass)", xlim=(20, 65), ylim=(0, 100))
axes.legend(loc="upper left")
figure.savefig(sys.argv[1])
