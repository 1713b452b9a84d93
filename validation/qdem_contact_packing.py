"""A packing of round grains at the paper's size: what contact costs of a step.

Grains as in section 4 of Nishiura et al.: about 109 tetrahedra and 35 vertices, edges of 10 mm on
average, spheres of 24 mm at the vertices of the surface.  They stand on a simple cubic lattice,
turned at random, so near that every grain touches its six neighbours: about the number that a
grain of ballast has.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

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


def grain_mesh(seed: int) -> tuple[Floats, NDArray[np.int64]]:
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


def lattice(side: int, near: float) -> list[q.Body]:
    """``side**3`` grains; ``near``: distance over twice the radius of grain and sphere."""
    meshes = {}
    for i, place in enumerate(np.ndindex(side, side, side)):
        meshes[place] = grain_mesh(i)
    bodies = []
    span = 2 * (GRAIN + RADIUS)
    for place, (nodes, elements) in meshes.items():
        centre = span * near * np.array(place)
        bodies.append(q.Body((nodes + centre, elements), BALLAST, name="grain"))
    return bodies


@dataclass(frozen=True)
class PackingCost:
    """CPU seconds of one thread for a step, and what there was to do."""

    bodies: int
    elements: int
    spheres: int
    candidates: int
    touching: int
    step_without: float
    """[s]"""
    step_with: float
    """[s]"""
    search: float
    """One look for pairs [s]"""

    @property
    def share(self) -> float:
        """Of contact in the step."""
        return 1 - self.step_without / self.step_with


def seconds_a_step(run: q.Simulation, steps: int, rounds: int) -> float:
    """Least CPU time of a step in some rounds [s]."""
    run.advance(2 * run.step)
    least = np.inf
    for _ in range(rounds):
        started = time.process_time()
        run.advance(steps * run.step)
        least = min(least, (time.process_time() - started) / steps)
    return float(least)


def packing_cost(
    side: int = 6, near: float = 0.95, steps: int = 60, rounds: int = 5
) -> PackingCost:
    """Measure a packing of ``side**3`` grains with contact and without."""
    step = 1e-8  # far below the critical one: what overlaps at the start does not fly apart
    found = {}
    touch = q.SphereContact(RADIUS, STIFFNESS, FRICTION)
    for contact in (None, touch):
        bodies = lattice(side, near)
        run = q.Simulation(bodies, threads=1, step=step, contact=contact)
        found[contact is None] = run, seconds_a_step(run, steps, rounds)
    run, with_contact = found[False]
    contacts = run.contacts
    assert contacts is not None
    started = time.process_time()
    contacts.pairs_find()
    search = time.process_time() - started
    return PackingCost(
        bodies=len(run.bodies),
        elements=len(run.assembly.elements),
        spheres=len(contacts.nodes),
        candidates=len(contacts.pairs.second),
        touching=int(contacts.pairs.touching.sum()),
        step_without=found[True][1],
        step_with=with_contact,
        search=search,
    )


if __name__ == "__main__":
    cost = packing_cost()
    print(cost, f"share {100 * cost.share:.1f} %")
