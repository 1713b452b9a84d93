"""Rigid bodies beside deformable ones: the limit of stiffness, and what a step costs.

python -m validation.qdem_bodies           measures, prints a line a figure, writes the record
python -m validation.qdem_bodies_page      writes docs/qdem-bodies.md and its figure from it
"""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import qdem_fem as q
from qdem_fem.mesh_generation import box_mesh

Floats = NDArray[np.float64]
RECORD = Path(__file__).parent / "results" / "qdem-bodies.jsonl"
BRICK, RADIUS = (0.02, 0.03, 0.05), 0.006
NORMAL, FRICTION = 1e6, 0.3
"""k_n of the spheres [N/m]: two in a row for the wall, as a mirror."""
BOUNCE = 1.5e-3
"""[s]: the fall of 1 um, the touch, and some way off."""
YOUNG = (0.3e9, 1e9, 3e9, 10e9, 30e9, 100e9, 300e9)


def bounce(kind: float | str, cells: int = 2, samples: int = 100) -> Floats:
    """Motion of a tilted brick that is thrown at a wall, spinning, (samples, 6) [m].

    ``kind``: Young's modulus [Pa] of a deformable brick, or ``"solid"`` or ``"lumped"`` of a rigid
    one.  The mean displacement, and the vector of rotation (best fit of all nodes) times 0.05 m.
    """
    mesh = box_mesh(BRICK, (cells,) * 3)
    nodes = Rotation.from_euler("xyz", [0.5, 0.3, 0.2]).apply(mesh.nodes)
    nodes[:, 2] += RADIUS + 1e-6 - nodes[:, 2].min()
    young = 30e9 if isinstance(kind, str) else float(kind)
    rigid: Any = False if not isinstance(kind, str) else (kind == "solid" or "lumped")
    body = q.Body((nodes, mesh.elements), q.Material(young, 0.2, 2700.0), rigid=rigid)
    spin = np.cross([20.0, 10.0, 30.0], nodes - body.rigid_mass.centre)
    body.velocity = np.array([0.3, 0.0, -1.0]) + spin
    wall = q.ContactPlane((0, 0, 0), (0, 0, 1))
    contact = q.SphereContact(RADIUS, NORMAL, FRICTION, planes=[wall])
    fastest = 2e-7 if rigid else None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", q.StepWarning)
        run = q.Simulation([body], contact=contact, threads=1, step=fastest)
        rows: list[Floats] = []
        for _ in range(samples):
            run.advance((len(rows) + 1) * BOUNCE / samples - run.time)
            rows.append(np.append(body.displacement.mean(axis=0), 0.05 * turn_of(body)))
    return np.array(rows)


def turn_of(body: q.Body) -> Floats:
    """Vector of the rotation that fits the nodes best [rad], (3,)."""
    arm, moved = body.nodes, body.nodes + body.displacement
    fit, _ = Rotation.align_vectors(moved - moved.mean(axis=0), arm - arm.mean(axis=0))
    return np.asarray(fit.as_rotvec())
