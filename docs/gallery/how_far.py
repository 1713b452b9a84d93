"""How far will it settle?

Three members of one bed: the same packing of 150 grains, moved by 1e-10 m.  They differ by chance
alone, and their spread is the least uncertainty of any single run.  Straight pieces are jumps.
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from matplotlib import pyplot

import trackbed
from trackbed.report import STYLE
from trackbed.scenes import find_scene_file

pyplot.rcParams.update(STYLE)
with TemporaryDirectory() as folder:
    settled = trackbed.settle(
        find_scene_file("karrech-coarse"), members=3, run_folder=Path(folder) / "run",
        total_cycles=100, **{"engine.rayleigh_share": "fast"},
    )  # fmt: skip

figure, axes = pyplot.subplots(figsize=(7.2, 4))
settled.plot(axes)
axes.set(xlabel="load cycles", ylabel="settlement of the loaded body (µm)")
axes.invert_yaxis()
figure.savefig(sys.argv[1])
