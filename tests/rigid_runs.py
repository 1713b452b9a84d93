"""Short rigid scenes that are run from their files, and what their frames hold."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from rigid_lcp.scene.run import RunFolder

SLIDING_BLOCK = """\
title = "A block slides and stops"
dimensions = 2

[run]
duration = 0.06
step = 2e-3
frames = 3

[surface]
friction = 0.5

[[ground]]
normal = [0, 1]

[[body]]
name = "block"
box = [0.2, 0.1]
density = 2000.0
position = [0.0, 0.05]
velocity = [0.1, 0.0]
"""

WORN_AND_BROKEN = """\
dimensions = 2
[run]
duration = 0.06
step = 2e-3
frames = 6
[surface]
friction = 0.4
[[ground]]
normal = [0, 1]
[[body]]
name = "lower"
vertices = [[0, -0.1], [0.1, 0], [0, 0.1], [-0.1, 0]]
density = 2700.0
position = [0, 0.1]
[[body]]
name = "upper"
box = [0.3, 0.05]
density = 1000.0
position = [0, 0.2255]
velocity = [0.5, 0]
[[load]]
body = "upper"
force = [0, -3000]
[wear]
coefficient = 1e-7
every = 2
[strength]
tension = 1.2e4
every = 4
smallest = 1e-2
"""

WORN_IN_SPACE = """\
dimensions = 3
[run]
duration = 0.06
step = 2e-3
frames = 3
[surface]
friction = 0.4
[[ground]]
normal = [0, 0, 1]
[[body]]
name = "slider"
box = [0.2, 0.1, 0.1]
density = 2700.0
position = [0, 0, 0.05]
velocity = [1.0, 0.2, 0]
[[body]]
name = "upper"
box = [0.1, 0.1, 0.1]
density = 2700.0
position = [0, 0, 0.19]
angle = [0.9, 0.3, 0.2, 0.1]
[wear]
coefficient = 1e-7
every = 4
[strength]
tension = 1e5
every = 10
"""


def frame_bits(folder: Path) -> list[dict[str, Any]]:
    """Every frame of a run folder to the last bit, all but the processor time."""
    frames = []
    for path in RunFolder(folder).frames():
        with path.open("rb") as stream, np.load(stream) as file:
            frames.append({name: file[name].tobytes() for name in file.files if name != "cpu"})
    return frames
