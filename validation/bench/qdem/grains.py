"""Round grains of the paper's size on a lattice, and what a step of them costs.

Grains as in section 4 of Nishiura et al.: about 109 tetrahedra and 35 vertices, edges of 10 mm on
average, spheres of 24 mm at the vertices of the surface.  They stand on a simple cubic lattice,
turned at random, so near that every grain touches its six neighbours: about the number that a
grain of ballast has.
"""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay
from scipy.spatial.transform import Rotation

import qdem_fem as q

Floats = NDArray[np.float64]
BALLAST = q.Material(30e9, 0.2, 2700.0, shear_viscosity=1e4)
RADIUS, FRICTION = 0.012, 0.577
"""Table 1."""
STIFFNESS = 1.0
"""[N/m], so soft that grains that begin in each other stay there while time is taken."""
SHELL, CORE = 26, 9
"""Vertices on the surface of a grain and within it: 35, as in the paper on average."""
GRAIN = 0.0125
"""Radius of the mesh of a grain [m]: then edges are 10 mm long on average."""


def mesh_grain(seed: int) -> tuple[Floats, NDArray[np.int64]]:
    """Vertices (35, 3) [m] on a sphere and within it, evenly, and the tetrahedra between them."""
    random = np.random.default_rng(seed)
    k = np.arange(SHELL) + 0.5
    height, turn = 1 - 2 * k / SHELL, np.pi * (1 + 5**0.5) * k
    flat = np.sqrt(1 - height**2)
    shell = np.column_stack([flat * np.cos(turn), flat * np.sin(turn), height])
    k = np.arange(CORE - 1) + 0.5
    height, turn = 1 - 2 * k / (CORE - 1), np.pi * (1 + 5**0.5) * k
    flat = np.sqrt(1 - height**2)
    core = 0.45 * np.column_stack([flat * np.cos(turn), flat * np.sin(turn), height])
    nodes = GRAIN * np.concatenate([shell, core, np.zeros((1, 3))])
    nodes = Rotation.random(random_state=random).apply(nodes)
    return nodes, Delaunay(nodes).simplices.astype(np.int64)


def lay_lattice(side: int, distance: float) -> list[q.Body]:
    """``side**3`` grains on a cubic lattice, neighbours ``distance`` apart [m]."""
    meshes = {}
    for i, place in enumerate(np.ndindex(side, side, side)):
        meshes[place] = mesh_grain(i)
    bodies = []
    for place, (nodes, elements) in meshes.items():
        centre = distance * np.array(place)
        bodies.append(q.Body((nodes + centre, elements), BALLAST, name="grain"))
    return bodies


def time_steps(runs: list[q.Simulation], steps: int, rounds: int) -> list[float]:
    """Least CPU time of a step of each in some rounds, one after the other in each [s]."""
    least = [np.inf] * len(runs)
    for run in runs:
        run.advance(2 * run.step)
    for _ in range(rounds):
        for k, run in enumerate(runs):
            started = time.process_time()
            run.advance(steps * run.step)
            least[k] = min(least[k], (time.process_time() - started) / steps)
    return least
