"""Which stones carry the sleeper?

Fifty stones are poured between two walls, and a block is loaded on them.  Lines are contact
forces, as wide as the force; a few stones carry most of it.
"""

import sys

import numpy as np
from matplotlib import pyplot

from rigid_lcp.report.pictures import draw_bodies, draw_chain_legend, draw_chains
from rigid_lcp.scene import load_scene, make_simulation
from trackbed.report import STYLE
from trackbed.scenes import find_scene_file

pyplot.rcParams.update(STYLE)
LOADED = 0.75  # s, when the first cycle of the load is at its greatest
settings = ["run.step=2e-3", "run.tolerance=1e-6"]
scene, run = make_simulation(load_scene(find_scene_file("pile"), settings))
run.advance(LOADED)
force = run.contacts.normal_force
scale = np.quantile(force[force > 0], 0.98)

figure, axes = pyplot.subplots(figsize=(5.6, 4.8))
draw_bodies(axes, scene, run.motion, (0, 1))
draw_chains(axes, scene, run.motion, run.contacts, scale, (0, 1))
draw_chain_legend(axes, scale, "N/m")
axes.set(aspect="equal", xlabel="along the track (m)", ylabel="height (m)")
axes.set(xlim=(-0.27, 0.27), ylim=(-0.02, 0.46))
figure.savefig(sys.argv[1])
