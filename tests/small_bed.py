"""A bed of sixty grains that the fake engine loads."""

from __future__ import annotations

import csv
from pathlib import Path


def read_rows(run: Path) -> list[dict[str, str]]:
    """Rows of a run's ``settlement.csv``."""
    with (run / "settlement.csv").open() as stream:
        return list(csv.DictReader(stream))


BY_HAND = ("procedure.k_i=20", "procedure.k=20", "procedure.h=20", "procedure.total_cycles=100")
"""A procedure of its keys alone, in place of a scene's by name."""


def small_bed(k: int, h: int, total_cycles: int) -> str:
    """Its scene file: windows of 2 cycles, then of ``k``, jumps of ``h``, so many in all."""
    return f"""\
[sample]
container = "cylinder"
radius = 0.02
symmetry = ["x", "y"]
count = 60
grain_radius = {{ distribution = "uniform", mean = 2e-3, standard_deviation = 2e-4 }}

[material]
grain = {{ young = 1e9, poisson = 0.25, density = 2710.0, viscous_alpha = 0.4, friction = 0.5 }}
wall = {{ young = 1e10, poisson = 0.3, friction = 0.5 }}

[loading]
amplitude = 14150.0
mean = 7075.0
frequency = 50.0
piston_mass = 0.005

[procedure]
k_i = 2
k = {k}
h = {h}
healing_cycles = 1
total_cycles = {total_cycles}

[engine]
name = "fake"
rayleigh_share = 0.2
"""
