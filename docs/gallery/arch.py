"""An arch at its limit

A semicircular arch of 31 rigid stones stands if it is thicker than 0.1075 mean radii (Milankovitch,
Heyman).  Near that, the line of thrust touches both faces, where hinges will open.
"""

import sys

import numpy as np
from matplotlib import pyplot
from matplotlib.patches import Polygon as Patch

import rigid_lcp as r
from trackbed.report import STYLE

pyplot.rcParams.update(STYLE)
STONES = 31
angle = np.pi * np.arange(STONES + 1) / STONES
ray = np.column_stack([np.cos(angle), np.sin(angle)])

figure = pyplot.figure(figsize=(9, 2))
for axes, thickness in zip(figure.subplots(1, 3), (0.15, 0.11, 0.10), strict=True):
    inner, outer = (1 - thickness / 2) * ray, (1 + thickness / 2) * ray
    scene = r.Scene(2, gravity=(0, -9.81))
    for k in range(STONES):
        corners = [inner[k], outer[k], outer[k + 1], inner[k + 1]]
        scene.add(r.Polygon(corners), density=2700, friction=2.0)
        axes.add_patch(Patch(corners, facecolor="#d9d2c5", edgecolor="0.5", lw=0.5))
    scene.add(r.HalfSpace((0, 1)), friction=2.0)
    run = r.Simulation(scene)
    run.advance(0.005)
    push, speed = run.contacts.normal_force, np.linalg.norm(run.motion.velocity, axis=1).max()
    joint = np.round(abs(np.arctan2(*run.contacts.point.T[::-1])) / np.pi * STONES)
    total = [push[joint == k].sum() for k in range(STONES + 1)]
    thrust = [push[joint == k] @ run.contacts.point[joint == k] for k in range(STONES + 1)]
    axes.plot(*(np.array(thrust).T / total), color="#D55E00", lw=2)
    axes.set(aspect="equal", xlim=(-1.15, 1.15), ylim=(-0.05, 1.15))
    axes.set_title(f"{thickness:g} radii: {'falls' if speed > 1e-4 else 'stands'}")
    axes.set_axis_off()
figure.savefig(sys.argv[1])
