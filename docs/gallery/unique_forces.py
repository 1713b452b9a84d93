"""Unique contact forces

A beam on five equal blocks has more contacts than equations.  A time step may return any forces
that balance; those of stiff elastic contacts are unique.
"""

import sys

import numpy as np
from matplotlib import pyplot

import rigid_lcp as r
from rigid_lcp.unique import find_unique_forces
from trackbed.report import STYLE

pyplot.rcParams.update(STYLE)
scene = r.Scene(2, gravity=(0, -9.81))
for x in range(5):
    scene.add(r.Polygon.rectangle(0.2, 0.2), density=2700, position=(x, 0.1), friction=0.0)
scene.add(r.Polygon.rectangle(4.8, 0.2), density=2700, position=(1.8, 0.3), friction=0.0)
scene.add(r.HalfSpace((0, 1)), friction=0.0)
run = r.Simulation(scene)
run.advance(0.01)
weight = 2700 * 4.8 * 0.2 * 9.81
ways = {"a time step": run.contacts, "unique": find_unique_forces(run.world, run.motion)}

figure, axes = pyplot.subplots(figsize=(6.4, 3.4))
for at, (label, contacts) in enumerate(ways.items()):
    block = np.where(contacts.point[:, 1] > 0.1, np.round(contacts.point[:, 0]), -1)
    force = [contacts.normal_force[block == x].sum() / weight for x in range(5)]
    colour = ("#E69F00", "#0072B2")[at]
    axes.bar(np.arange(5) + 0.4 * at - 0.2, force, 0.38, color=colour, label=label)
axes.plot(range(5), 0.24 - 0.02 * np.arange(5), "kD", label="a rigid beam on equal springs")
axes.set(xlabel="block", ylabel="force over the beam's weight", xticks=range(5))
axes.legend(loc="lower left", framealpha=1, frameon=True)
figure.savefig(sys.argv[1])
