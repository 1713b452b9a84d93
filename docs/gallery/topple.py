"""Slides, topples or stands?

A box on a slope with friction 0.5, from slim to flat and from gentle to steep.  Lines are closed
form: flat boxes slide above the level one, slim boxes topple above the dashed one.
"""

import sys

import numpy as np
from matplotlib import pyplot

import rigid_lcp as r
from trackbed.report import STYLE

pyplot.rcParams.update(STYLE)
FRICTION, HEIGHT, G, AFTER, MOVES = 0.5, 0.1, 9.81, 0.01, 1e-4  # -, m, m/s^2, s, m/s
KINDS = {
    (False, False): ("stands", "o", "#0072B2"), (True, False): ("slides", "s", "#E69F00"),
    (False, True): ("topples", "^", "#009E73"), (True, True): ("both", "D", "#CC79A7"),
}  # fmt: skip
found = {kind: [] for kind in KINDS}
for shape in np.arange(0.13, 1, 0.08):
    for slope in np.arange(0.1, 1, 0.08):
        down = np.arctan(slope)
        scene = r.Scene(2, gravity=(G * np.sin(down), -G * np.cos(down)))
        box = r.Polygon.rectangle(shape * HEIGHT, HEIGHT)
        scene.add(box, density=2700, position=(0, HEIGHT / 2), friction=FRICTION)
        scene.add(r.HalfSpace((0, 1)), friction=FRICTION)
        run = r.Simulation(scene)
        run.advance(AFTER)
        along, _, turn = run.motion.rates[0] * (1, 1, HEIGHT)
        found[abs(along + turn / 2) > MOVES, abs(turn) > MOVES].append((shape, slope))

figure, axes = pyplot.subplots(figsize=(5.6, 4.4))
axes.plot([0, 1.05], [FRICTION, FRICTION], "k", [0, 1.05], [0, 1.05], "k--", lw=1)
for kind, (label, mark, colour) in KINDS.items():
    axes.plot(*np.array(found[kind]).T, mark, color=colour, label=label, ms=6)
axes.set(xlabel="width over height", ylabel="slope (tangent)", xlim=(0, 1.05), ylim=(0, 1.05))
figure.legend(loc="outside upper center", ncol=4)
figure.savefig(sys.argv[1])
