"""Soft, hard, deformable: one bed three ways

Hard and soft stones share the load of a stiff sleeper; one that bends leaves it to those below it.
"""

import sys

import numpy as np
import skfem
from matplotlib import pyplot

import qdem_fem as q
import rigid_lcp as r
from trackbed.report import STYLE

pyplot.rcParams.update(STYLE)
PLACES, LOAD = 0.36 * np.arange(-3, 4), 120e3  # of stones m, of two seats N
grids = [[at + np.linspace(-0.05, 0.05, 3) for at in (x, 0.12, 0.05)] for x in PLACES]
grids.append([np.linspace(-1.2, 1.2, 21), np.linspace(0, 0.24, 3), np.linspace(0.1, 0.32, 5)])
scene, push = r.Scene(2, gravity=(0, 0)), np.outer(np.eye(9)[7], [0, -LOAD, 0])
for x, _, z in grids:
    scene.add(r.Polygon.rectangle(np.ptp(x), np.ptp(z)), density=500, position=(x.mean(), z.mean()))
scene.add(r.HalfSpace((0, 1)), friction=0.6)
(hard := r.Simulation(scene, loads=lambda time, motion: push)).advance(1e-3)
ways = hard.contacts, r.unique.find_unique_forces(hard.world, hard.motion, push)
forces = [np.bincount(one.body_a, one.normal_force * (one.body_b == 8), 7) for one in ways]
concrete = q.Material(45e9, 0.167, 2350.0, shear_viscosity=3e5)
*stones, sleeper = bodies = [q.Body(skfem.MeshTet.init_tensor(*one), concrete) for one in grids]
contact = q.SurfaceContact(1e11, 0.6, [q.ContactPlane((0, 0, 0), (0, 0, 1))])  # Pa/m
run = q.Simulation(bodies, contact=contact)
seats = np.isclose(abs(sleeper.nodes[:, 0]), 0.72) & (sleeper.nodes[:, 2] > 0.31)
run.load(sleeper, seats, q.Series([0, 0.02], [[0, 0, 0], [0, 0, -LOAD]]))
run.advance(0.03)
forces.append(np.array([-one.stress()[:, 2, 2] @ one.gradients[1] / 0.1 for one in stones]))
figure, axes = pyplot.subplots(figsize=(7.2, 3.6))
for k, way in enumerate((("hard", "#E69F00"), ("soft", "#0072B2"), ("deformable", "#D55E00"))):
    axes.bar(PLACES + 0.09 * k - 0.09, 1e-3 * forces[k], 0.08, label=way[0], color=way[1])
axes.set(xlabel="along the sleeper (m)", ylabel="force on a stone (kN)", xticks=PLACES)
axes.legend(loc="upper center", ncol=3)
figure.savefig(sys.argv[1])
