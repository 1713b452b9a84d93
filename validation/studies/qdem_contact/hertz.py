"""Hertz contact of two meshed caps, by all models of contact, against the closed form and a rival.

Two blocks with paraboloid tops, of different meshes, graded towards the contact, are pressed by a
given approach d without friction:

    F = 4/3 E* R^1/2 d^3/2,   a = (R d)^1/2,   1/E* = 2 (1 - nu^2)/E,   R = R_one/2.

What holds them at sides and top moves as half-spaces do under that force (Boussinesq); so the
closed form is theirs too, to the square of a over their size.  The rival has the same blocks:
linear tetrahedra of scikit-fem, and an active set of nodes at the plane of symmetry.
"""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

import qdem_fem as q
from qdem_fem.files.errors import NotConverged
from qdem_fem.mesh.generation import make_box_mesh
from validation.bench.qdem.checks import fit_order, report
from validation.bench.qdem.judge import build_stiffness
from validation.case import Check

Floats = NDArray[np.float64]
YOUNG, POISSON, DENSITY = 30e9, 0.2, 2700.0
STONE = q.Material(YOUNG, POISSON, DENSITY)
SIZE = 0.03
"""Half the width and the height of a block [m]."""
CURVATURE = 1.5
"""Radius of a cap [m]: strains stay below half a per cent."""
APPROACH = (0.2 * SIZE) ** 2 / (CURVATURE / 2)
"""d [m]; the contact's radius is a fifth of the size by the closed form."""
GRADE = 3.0
"""Cells at the sides are ``1 + 2 GRADE`` times those at the contact."""
CELLS = (3, 4, 6)
"""Cells from the middle to the side; `SIZE / (4 cells)` is the size of those at the contact."""
CLOSED_RADIUS = np.sqrt(CURVATURE / 2 * APPROACH)
CLOSED_FORCE = (
    4 / 3 * YOUNG / (2 * (1 - POISSON**2)) * np.sqrt(CURVATURE / 2) * APPROACH**1.5
)  # fmt: skip


def mesh_cap(cells: int, across: int) -> tuple[Floats, NDArray[np.int64]]:
    """A block over the paraboloid ``z = r^2/(2 R)``, ``across`` cells from side to side; [m]."""
    mesh = make_box_mesh((2.0, 2.0, 1.0), (across, across, cells), "kuhn", (-1.0, -1.0, 0.0))
    s = mesh.nodes
    graded = s * (1 + GRADE * np.abs(s)) / (1 + GRADE)
    nodes = SIZE * graded
    low = (nodes[:, 0] ** 2 + nodes[:, 1] ** 2) / (2 * CURVATURE)
    nodes[:, 2] = low * (1 - graded[:, 2]) + SIZE * graded[:, 2]
    return nodes, mesh.elements


def find_outer(nodes: Floats) -> NDArray[np.intp]:
    """Nodes at the sides and the top of a block."""
    far = np.abs(nodes).max(axis=1)
    return np.flatnonzero(far > SIZE * (1 - 1e-9))


def find_outer_motion(nodes: Floats) -> Floats:
    """Displacement of one block far from the contact (n, 3) [m]: Boussinesq, half of d less."""
    x, y, z = nodes.T
    r, far = np.hypot(x, y), np.linalg.norm(nodes, axis=1)
    far = np.maximum(far, 1e-3 * SIZE)
    size = (1 + POISSON) * CLOSED_FORCE / (2 * np.pi * YOUNG)
    across = size * (r * z / far**3 - (1 - 2 * POISSON) * r / (far * (far + z)))
    along = size * (z**2 / far**3 + 2 * (1 - POISSON) / far)
    unit = np.divide([x, y], r, out=np.zeros((2, len(x))), where=r > 0)
    return np.column_stack([*(across * unit), along - APPROACH / 2])


def measure(force: Floats, place: Floats) -> tuple[float, float]:
    """Total of forces (n,) [N], and the radius of a Hertz pressure with their second moment [m]."""
    total = float(force.sum())
    moment = float((force * (place[:, :2] ** 2).sum(axis=1)).sum())
    return total, float(np.sqrt(2.5 * moment / total))


def solve_rival(cells: int) -> tuple[float, float]:
    """F [N] and a [m]: nodes of one block that a plane pushes up, by an active set."""
    nodes, elements = mesh_cap(cells, 2 * cells)
    matrix = build_stiffness(nodes, elements, YOUNG, POISSON).tocsc()
    held_far = find_outer(nodes)
    near = np.flatnonzero(nodes[:, 2] <= (nodes[:, :2] ** 2).sum(axis=1) / (2 * CURVATURE) + 1e-9)
    near = np.setdiff1d(near, held_far)
    wanted = -nodes[near, 2]
    held = wanted > -APPROACH / 4
    motion = find_outer_motion(nodes)
    for _ in range(50):
        known = np.zeros(nodes.size, dtype=bool)
        known.reshape(-1, 3)[held_far] = True
        known[3 * near[held] + 2] = True
        u = np.where(known, motion.ravel(), 0.0)
        u[3 * near[held] + 2] = wanted[held]
        u[~known] = splu(matrix[~known][:, ~known]).solve(-(matrix @ u)[~known])
        reaction = (matrix @ u)[3 * near + 2]
        again = np.where(held, reaction > 0, u[3 * near + 2] < wanted)
        if (again == held).all():
            break
        held = again
    return measure(np.where(held, reaction, 0.0), nodes[near])


def find_first_touch(lower: Floats, upper: Floats, diameter: float) -> float:
    """Lift of the upper block [m] at which the first two spheres touch."""
    a, b = (n[(n[:, :2] ** 2).sum(axis=1) < (3 * diameter) ** 2] for n in (lower, upper))
    apart = ((a[:, None, :2] - b[:, :2]) ** 2).sum(axis=2)
    reach = np.sqrt(np.maximum(diameter**2 - apart, 0.0)) - a[:, None, 2] - b[:, 2]
    return float(np.where(apart < diameter**2, reach, 0.0).max())


def make_contact(model: str, edge: float) -> q.SphereContact | q.SurfaceContact:
    """Ten times as stiff as a layer of the size ``edge`` [m] of the faces in contact."""
    if model.startswith("spheres"):
        return q.SphereContact(edge / 2, 10 * YOUNG * edge, 0.0)
    return q.SurfaceContact(10 * YOUNG / edge, 0.0, depth=0.2 * edge)


def settle(run: q.Simulation, period: float, tolerance: float = 1e-6, most: int = 600) -> None:
    """March until kinetic energy is a share of all; velocities go to zero at its peaks.

    Looks are unevenly spaced (golden section), so that no vibration is at rest at each of them.
    Raises `NotConverged` after the ``most`` looks.
    """
    before = 0.0
    for look in range(most):
        run.advance(period / 20 * (0.5 + 0.618 * look % 1.0))
        e = run.energy()
        if e.kinetic < before:
            if before < tolerance * (e.elastic + e.contact):
                return
            for body in run.bodies:
                if not body.rigid:
                    body.velocity = np.zeros_like(body.velocity)
            before = 0.0
        else:
            before = e.kinetic
    raise NotConverged(
        f"the kinetic energy is {e.kinetic / (e.elastic + e.contact):.1e} of the others",
        where=f"the trial after {most} looks",
        remedy="look at its step and damping: without rest no force is that of equilibrium",
    )


def press_blocks(model: str, cells: int) -> tuple[float, float, float, float]:
    """F [N], a [m], CPU of a step and of all [s]; ``spheres, matching``: vertex on vertex."""
    edge, period = SIZE / (4 * cells), 8 * SIZE / np.sqrt(YOUNG / DENSITY)
    same = model.endswith("matching")
    lower, elements = mesh_cap(cells, 2 * cells)
    upper, others = (lower, elements) if same else mesh_cap(cells, 2 * cells + 2)
    gap = find_first_touch(lower, upper, edge) if model.startswith("spheres") else 0.0
    bodies = [
        q.Body((lower * [1, 1, -1], elements[:, [0, 2, 1, 3]]), STONE, name="lower"),
        q.Body((upper + np.array([0, 0, gap]), others), STONE, name="upper"),
    ]
    run = q.Simulation(bodies, threads=1, strain="small", contact=make_contact(model, edge))
    for body, nodes, sign in ((bodies[0], lower, -1), (bodies[1], upper, 1)):
        far, motion = find_outer(nodes), find_outer_motion(nodes) * [1, 1, sign]
        for k, component in enumerate("xyz"):
            run.prescribe(body, far, component, q.make_ramp(2 * period, 1.0), profile=motion[:, k])
    run.advance(1e-7)
    started, before = time.process_time(), run.steps_done
    run.advance(2 * period)
    settle(run, period)
    spent = time.process_time() - started
    assert run.contacts is not None
    own = run.contacts.nodes < len(lower)
    force = -run.contacts.kernel.force[own, 2]
    return *measure(force, lower[run.contacts.nodes[own]]), spent / (run.steps_done - before), spent


MODELS = ("spheres", "spheres, matching", "points")


def check_hertz() -> list[Check]:
    """Force and radius of all models on three meshes, beside the rival on the same and a finer."""
    fine = solve_rival(14)
    name = "Hertz, rival on a fine mesh"
    checks = [
        report(f"{name}: force less the closed form", fine[0] / CLOSED_FORCE - 1),
        report(f"{name}: radius less the closed form", fine[1] / CLOSED_RADIUS - 1),
    ]
    for cells in CELLS:
        started, name = time.process_time(), f"Hertz, rival, {cells} cells"
        force, radius = solve_rival(cells)
        spent = time.process_time() - started
        checks += [report(f"{name}: solved", spent, "s"), *report_errors(name, force, radius)]
    for model in MODELS:
        errors = []
        for cells in CELLS:
            force, radius, step, spent = press_blocks(model, cells)
            errors.append(abs(force / CLOSED_FORCE - 1))
            name = f"Hertz, {model}, {cells} cells"
            checks += [
                *report_errors(name, force, radius),
                report(f"{name}: step", step, "s"),
                report(f"{name}: until it rests", spent, "s"),
            ]
        order = -fit_order(CELLS, errors)
        checks.append(report(f"Hertz, {model}: order of the force", order))
    return checks


def report_errors(name: str, force: float, radius: float) -> list[Check]:
    """Of force and radius to the closed form."""
    return [
        report(f"{name}: force error", abs(force / CLOSED_FORCE - 1)),
        report(f"{name}: radius error", abs(radius / CLOSED_RADIUS - 1)),
    ]
