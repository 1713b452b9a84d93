"""How fast does a blow travel through a sleeper?

A free concrete bar is struck at one end for 0.1 ms, as in an impact-echo test.  Each curve is the
speed of one cross-section; the dashed line is the wave of bar theory, there and back.
"""

import sys

import numpy as np
import skfem
from matplotlib import pyplot

import qdem_fem as q
from trackbed.report import STYLE

pyplot.rcParams.update(STYLE)
LENGTH, BLOW, PEAK = 2.4, 1e-4, 5e3  # m, s, N
x, y, z = (np.linspace(0, end, n + 1) for end, n in ((LENGTH, 48), (0.25, 5), (0.22, 5)))
concrete = q.Material(young=45e9, poisson=0.167, density=2350.0)
bar = q.Body(skfem.MeshTet.init_tensor(x, y, z), concrete)
run = q.Simulation([bar])

time = np.linspace(0, BLOW, 41)
blow = q.Series(time, np.outer(PEAK * np.sin(np.pi * time / BLOW), [1, 0, 0]))
run.load(bar, bar.nodes[:, 0] == 0, blow)
sections = {f"{at:.1f}": np.isclose(bar.nodes[:, 0], at) for at in x[::8]}
history = run.advance(1.3e-3, probes=sections, sampling=4e-6)
figure, axes = pyplot.subplots(figsize=(7.2, 4.2))
for at, name in zip(x[::8], sections, strict=True):
    speed = np.gradient(history[name][:, 0], history.time)
    axes.plot(1e3 * history.time, at + 50 * speed, color="#0072B2", lw=1.2)
there = LENGTH / np.sqrt(concrete.young / concrete.density) * 1e3
path = BLOW / 2 * 1e3 + there * np.arange(3)
axes.plot(path, [0, LENGTH, 0], "--", color="#D55E00", label="bar theory, middle of the blow")
axes.set(xlabel="time (ms)", ylabel="place (m), with the section's speed on it", xlim=(0, 1.3))
axes.legend(loc="upper right", frameon=True, framealpha=1)
figure.savefig(sys.argv[1])
