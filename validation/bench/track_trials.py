"""A track of 20 grains: its scene, as tests and the study of tracks take it."""

from __future__ import annotations

from pathlib import Path

from qdem_fem.scene.checks import load_scene
from qdem_fem.track.enter import TrackPrepared

SCENE = """
[track]
length = 0.13
width = 0.42
below = 14
beside = 6
cells = [3, 6, 4]
share = 0.13
ballast = { young = 30e9, poisson = 0.2, density = 2700.0, shear_viscosity = 1e4 }
sleeper = { young = 45e9, poisson = 0.167, density = 2350.0, shear_viscosity = 1e4 }
bed = "bed.npz"
unbalanced = 0.1
prepared_friction = 0.577
pressure = { times = [0.0, 0.005, 0.010], values = [0.0, 750e3, 0.0] }
[contact]
model = "spheres"
contacts = "near"
radius = 0.012
normal_stiffness = { ballast = 1.613e9, sleeper = 2.39e9 }
friction = 0.577
[simulation]
duration = 0.015
gravity = [0, 0, -9.81]
threads = 1
[output]
sampling = 1e-4
energy_interval = 1e-4
audit = 1e-3
"""
"""A track of 20 grains under one blow of 10 ms, with the stiffness, viscosity and spheres of
Table 1; the peak is the pressure of `qdem_fem.track.loads.train` under an axle of 100 kN."""


def load_track(folder: Path, *overrides: str) -> TrackPrepared:
    """The track of 20 grains, its files in a folder."""
    path = folder / "scene.toml"
    path.write_text(SCENE, encoding="utf-8")
    prepared = load_scene(path, overrides)
    assert isinstance(prepared, TrackPrepared)
    return prepared
