"""Two cubes face to face, pressed: stress of all elements by all models and meshes."""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray

import qdem_fem as q
from validation.bench.qdem.contact import SIDE, make_cube
from validation.case import Check

Floats = NDArray[np.float64]
PRESSURE = 1e6
STIFFNESS, MODULUS = 1.613e9, 3e12
"""k_n of Table 1 [N/m]; p [Pa/m], as stiff as a layer of the stone of 1 cm."""
FACES = (  # cells below and above, radius of spheres [m] or points of a face's edge
    ("spheres", 2, 2, 0.006), ("spheres", 4, 4, 0.006), ("spheres", 3, 4, 0.012),
    ("surface", 2, 2, 2), ("surface", 4, 4, 2),
    ("surface", 3, 4, 1), ("surface", 3, 4, 2), ("surface", 3, 4, 4), ("surface", 3, 4, 6),
)  # fmt: skip


def make_contact(model: str, detail: float, friction: float) -> q.SphereContact | q.SurfaceContact:
    """Spheres of radius ``detail`` [m], or surfaces of ``detail`` squared points a face."""
    if model == "spheres":
        return q.SphereContact(detail, STIFFNESS, friction)
    return q.SurfaceContact(MODULUS, friction, points=int(detail))


def average_stress(
    model: str, below: int, above: int, detail: float
) -> tuple[Floats, float, float]:
    """Stress of all elements over the pressure, (m,), force carried over the load, and [s] a step.

    The upper cube lies on the lower one and is pressed at 1 MPa until both rest; the exact answer
    is one everywhere.
    """
    damped = q.Material(30e9, 0.2, 2700.0, shear_viscosity=3e4, bulk_viscosity=3e4)
    gap = 2 * detail if model == "spheres" else 0.0
    bodies = [make_cube(below, material=damped), make_cube(above, (0, 0, SIDE + gap), damped)]
    run = q.Simulation(bodies, threads=1, contact=make_contact(model, detail, 0.5))
    run.fix(bodies[0], bodies[0].nodes[:, 2] == 0, "z")
    run.fix(bodies[0], 0)
    top = bodies[1].nodes[:, 2] > 2 * SIDE + gap - 1e-9
    run.pressure(bodies[1], top, q.make_ramp(3e-4, PRESSURE))
    run.advance(1e-5)
    started, before = time.process_time(), run.steps_done
    run.advance(1.5e-3)
    seconds = (time.process_time() - started) / (run.steps_done - before)
    stress = np.concatenate([body.stress()[:, 2, 2] for body in bodies]) / -PRESSURE
    assert run.contacts is not None
    of_lower = run.contacts.nodes < len(bodies[0].nodes)
    carried = -run.contacts.kernel.force[of_lower, 2].sum() / (PRESSURE * SIDE**2)
    return stress, float(carried), seconds


def name_faces(model: str, below: int, above: int, detail: float) -> str:
    """How the names of the checks of one pair of meshes begin."""
    words = {
        "spheres": f"spheres of {2000 * detail:.0f} mm",
        "surface": f"surface, {detail:.0f} squared points",
    }[model]
    return f"faces, {below} on {above} cells, {words}"


def check_faces() -> list[Check]:
    """Vertices on vertices, and between them, on two sizes of mesh, by both models."""
    checks = []
    for model, below, above, detail in FACES:
        stress, carried, seconds = average_stress(model, below, above, detail)
        name, worst = name_faces(model, below, above, detail), float(np.abs(stress - 1).max())
        same = model == "surface" and below == above
        checks += [
            Check(f"{name}: force carried less load", abs(carried - 1), "<= 0.001",
                  abs(carried - 1) <= 1e-3),
            Check(f"{name}: stress, greatest error", worst, "<= 0.01" if same else "reported",
                  worst <= 0.01 or not same),
            Check(f"{name}: step", seconds, "reported", True, "s"),
        ]  # fmt: skip
    return checks
