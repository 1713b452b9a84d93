"""Rigid bodies beside deformable ones: the limit of stiffness, and what a step costs.

python -m validation.qdem_bodies           measures, prints a line a figure, writes the record
python -m validation.qdem_bodies_page      writes docs/qdem-bodies.md and its figure from it
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import qdem_fem as q
from qdem_fem.advise import compliance_of
from qdem_fem.advise_check import advice_check, advise_scene
from qdem_fem.grain_form import GrainRecipe
from qdem_fem.grain_grading import PAPER_SIZE
from qdem_fem.grain_set import grains_make
from qdem_fem.mesh_generation import box_mesh
from validation.parts_record import parts_measure
from validation.qdem_contact_packing import GRAIN, lattice, seconds_a_step
from validation.qdem_contact_packing import RADIUS as RADIUS_PAPER
from validation.qdem_contact_packing import STIFFNESS as SOFT

Floats = NDArray[np.float64]
Row = dict[str, Any]
STONE = q.Material(30e9, 0.2, 2700.0)
STONES = Path(__file__).with_name("qdem_bodies_stones.toml")
"""A soft pad and two stones; the second one falls."""
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


def stiffness_part() -> Row:
    """Error of the rigid brick against the deformable one by Young's modulus."""
    rows = []
    for cells in (2, 3):
        limits = {kind: bounce(kind, cells) for kind in ("lumped", "solid")}
        size = {kind: float(np.linalg.norm(limit)) for kind, limit in limits.items()}
        for young in YOUNG:
            moved = bounce(young, cells)
            errors = {
                kind: float(np.linalg.norm(moved - limit)) / size[kind]
                for kind, limit in limits.items()
            }
            rows.append({"cells": cells, "young": young, **errors})
    return {"rows": rows}


def inertia_part() -> Row:
    """Excess of the lumped inertia over the solid's: a cube by its cells, and grains as made."""
    bodies = [
        (f"cube, {cells} cells", q.Body(box_mesh((0.03,) * 3, (cells,) * 3), STONE))
        for cells in (1, 2, 4, 8)
    ]
    made = grains_make(8, 1, GrainRecipe(), PAPER_SIZE, 1)
    bodies += [(f"grain {i}", q.Body(made.mesh(i), STONE)) for i in range(8)]
    rows = []
    for name, body in bodies:
        lumped = q.Body(body.mesh, STONE, rigid="lumped").rigid_mass.inertia
        excess = lumped / body.rigid_mass.inertia - 1
        rows.append(
            {"body": name, "elements": len(body.elements), "least": float(excess.min()),
             "greatest": float(excess.max())}
        )  # fmt: skip
    return {"rows": rows}


def cost_part() -> Row:
    """A step of 216 grains of the paper's size, all deformable and all rigid, one thread."""
    rows = []
    for model, size, near in (
        ("none", GRAIN, 1.0), ("spheres", GRAIN + RADIUS_PAPER, 0.87), ("surface", GRAIN, 0.96)
    ):  # fmt: skip
        runs = []
        for rigid in (False, True):
            bodies = [
                q.Body(b.mesh, b.material, name="grain", rigid=rigid)
                for b in lattice(6, 2 * near * size)
            ]
            contact = {
                "none": None,
                "spheres": q.SphereContact(RADIUS_PAPER, SOFT, 0.577),
                "surface": q.SurfaceContact(SOFT, 0.577),
            }[model]
            runs.append(q.Simulation(bodies, threads=1, step=1e-8, contact=contact))
        soft, hard = seconds_a_step(runs, 200, 5)
        rows.append({"contact": model, "deformable_s": soft, "rigid_s": hard})
    return {"grains": 216, "elements": len(runs[0].assembly.elements), "rows": rows}


def top_part() -> Row:
    """A free brick that spins about no axis of its own: error of its turn by the time step."""
    answers, rows = {}, []
    for step in (1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5, 1e-6):
        body = q.Body(box_mesh(BRICK, (1, 1, 1)), STONE, rigid=True)
        body.velocity = np.cross([60.0, 5.0, 25.0], body.nodes - body.rigid_mass.centre)
        run = q.Simulation([body], step=step, threads=1)
        energy = run.energy().kinetic
        run.advance(0.2)
        answers[step] = body.displacement
        drift = abs(run.energy().kinetic / energy - 1)
        rows.append({"step": step, "energy": float(drift)})
    for row in rows[:-1]:
        apart = abs(answers[row["step"]] - answers[1e-6]).max()
        row["error"] = float(apart / abs(answers[1e-6]).max())
    return {"rows": rows[:-1]}


def advise_part() -> Row:
    """Predicted and measured error of two rigid stones on a soft pad, by their modulus.

    ``paper``: compliance of a grain's softest vertex over that of a contact of Table 1.
    """
    rows = []
    for young in (1e9, 3e9, 10e9, 30e9, 100e9, 300e9):
        marks = [f"body.{i}.material.young={young!r}" for i in (1, 2)]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", q.StepWarning)
            advice = advise_scene(STONES, marks, 0.9)
            chosen = [replace(one, rigid=one.body != "pad") for one in advice]
            checked = advice_check(STONES, marks, chosen)
        rows.append({"young": young, "predicted": checked.predicted, "measured": checked.measured})
    grain = q.Body(grains_make(1, 1, GrainRecipe(), PAPER_SIZE, 1).mesh(0), STONE)
    return {"rows": rows, "paper": compliance_of(grain).vertex * 1.613e9}


PARTS: dict[str, Callable[[], Row]] = {
    "stiffness": stiffness_part,
    "inertia": inertia_part,
    "top": top_part,
    "advise": advise_part,
    "cost": cost_part,
}


if __name__ == "__main__":
    parts_measure(PARTS, RECORD, "validation.qdem_bodies", __doc__)
