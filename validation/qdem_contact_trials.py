"""Trials of contact between bodies: faces on faces, slopes, a collision, a heap; each a few checks.

Stone as in Table 1 of Nishiura et al. (30 GPa, 0.2, 2700 kg/m^3), bodies of 3 cm.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import qdem_fem as q
from qdem_fem.mesh_generation import box_mesh
from validation.case import Check
from validation.qdem_contact_packing import packing_cost

Floats = NDArray[np.float64]
SIDE = 0.03
STONE = q.Material(30e9, 0.2, 2700.0)
GRAVITY = 9.81


def cube(
    cells: int, place: Any = (0, 0, 0), material: q.Material = STONE, name: str = "cube"
) -> q.Body:
    """A cube of ``cells**3 * 5`` tetrahedra with its least corner at ``place`` [m]."""
    return q.Body(box_mesh((SIDE,) * 3, (cells,) * 3, "five", tuple(place)), material, name=name)


# --- two cubes face to face ----------------------------------------------------------------------

PRESSURE = 1e6
FACES_OF = {"surface": "points", "overlaps": "overlaps"}
"""What of a face bears, by the name of the model here."""
STIFFNESS, MODULUS = 1.613e9, 3e12
"""k_n of Table 1 [N/m]; p [Pa/m], as stiff as a layer of the stone of 1 cm."""
FACES = (  # cells below and above, radius of spheres [m] or points of a face's edge
    ("spheres", 2, 2, 0.006), ("spheres", 4, 4, 0.006), ("spheres", 3, 4, 0.012),
    ("surface", 2, 2, 2), ("surface", 4, 4, 2),
    ("surface", 3, 4, 1), ("surface", 3, 4, 2), ("surface", 3, 4, 4), ("surface", 3, 4, 6),
    ("overlaps", 2, 2, 1), ("overlaps", 4, 4, 1), ("overlaps", 3, 4, 1),
)  # fmt: skip


def contact_made(model: str, detail: float, friction: float) -> q.SphereContact | q.SurfaceContact:
    """Spheres of radius ``detail`` [m], or surfaces of ``detail`` squared points a face."""
    if model == "spheres":
        return q.SphereContact(detail, STIFFNESS, friction)
    return q.SurfaceContact(MODULUS, friction, points=int(detail), faces=FACES_OF[model])


def faces_stress(model: str, below: int, above: int, detail: float) -> tuple[Floats, float, float]:
    """Stress of all elements over the pressure, (m,), force carried over the load, and [s] a step.

    The upper cube lies on the lower one and is pressed at 1 MPa until both rest; the exact answer
    is one everywhere.
    """
    damped = q.Material(30e9, 0.2, 2700.0, shear_viscosity=3e4, bulk_viscosity=3e4)
    gap = 2 * detail if model == "spheres" else 0.0
    bodies = [cube(below, material=damped), cube(above, (0, 0, SIDE + gap), damped)]
    run = q.Simulation(bodies, threads=1, contact=contact_made(model, detail, 0.5))
    run.fix(bodies[0], bodies[0].nodes[:, 2] == 0, "z")
    run.fix(bodies[0], 0)
    top = bodies[1].nodes[:, 2] > 2 * SIDE + gap - 1e-9
    run.pressure(bodies[1], top, q.ramp(3e-4, PRESSURE))
    run.advance(1e-5)
    started, before = time.process_time(), run.steps_done
    run.advance(1.5e-3)
    seconds = (time.process_time() - started) / (run.steps_done - before)
    stress = np.concatenate([body.stress()[:, 2, 2] for body in bodies]) / -PRESSURE
    assert run.contacts is not None
    of_lower = run.contacts.nodes < len(bodies[0].nodes)
    carried = -run.contacts.kernel.force[of_lower, 2].sum() / (PRESSURE * SIDE**2)
    return stress, float(carried), seconds


def faces_name(model: str, below: int, above: int, detail: float) -> str:
    """How the names of the checks of one pair of meshes begin."""
    words = {
        "spheres": f"spheres of {2000 * detail:.0f} mm",
        "surface": f"surface, {detail:.0f} squared points",
        "overlaps": "overlaps",
    }[model]
    return f"faces, {below} on {above} cells, {words}"


def faces_checks(quick: bool) -> list[Check]:
    """Vertices on vertices, and between them, on two sizes of mesh, by both models."""
    checks = []
    for model, below, above, detail in FACES[::3] if quick else FACES:
        stress, carried, seconds = faces_stress(model, below, above, detail)
        name, worst = faces_name(model, below, above, detail), float(np.abs(stress - 1).max())
        same = model == "overlaps" or (model == "surface" and below == above)
        checks += [
            Check(f"{name}: force carried less load", abs(carried - 1), "<= 0.001",
                  abs(carried - 1) <= 1e-3),
            Check(f"{name}: stress, greatest error", worst, "<= 0.01" if same else "reported",
                  worst <= 0.01 or not same),
            Check(f"{name}: step", seconds, "reported", True, "s"),
        ]  # fmt: skip
    return checks


# --- a block on a slope --------------------------------------------------------------------------


def slope_gain(
    share: float, model: str = "spheres", *, rigid: bool = False
) -> tuple[float, float, float]:
    """A cube, deformable or rigid, on a wall, ``tan(alpha) = 1/2``, friction that share of it.

    Gravity turns to the slope in 13 ms from an equilibrium.  Acceleration along the slope in the
    last 13 of 39 ms [m/s^2], that of a rigid block, and the way in that time [m].
    """
    alpha, stiffness, ramp, radius = np.arctan(0.5), 9e5, 13e-3, 0.006
    weight = SIDE**3 * 2700 * GRAVITY * np.cos(alpha)
    height = -weight / (2 * stiffness) + (radius if model == "spheres" else 0.0)
    walls = [q.ContactPlane((0, 0, 0), (0, 0, 1))]
    contact: q.SphereContact | q.SurfaceContact
    if model == "spheres":
        contact = q.SphereContact(radius, stiffness / 9, share / 2, planes=walls)
    else:
        contact = q.SurfaceContact(
            stiffness / SIDE**2, share / 2, planes=walls, faces=FACES_OF[model]
        )
    body = q.Body(box_mesh((SIDE,) * 3, (2, 2, 2), "kuhn", (0, 0, height)), STONE, rigid=rigid)
    times = np.linspace(0, ramp, 200)
    along = GRAVITY * np.sin(alpha) * 0.5 * (1 - np.cos(np.pi * times / ramp))
    across = np.full(200, -GRAVITY * np.cos(alpha))
    run = q.Simulation([body], threads=1, contact=contact)
    # a load by mass: no kernel with gravity has to be compiled for it
    nodes = len(body.nodes)
    mass = np.full(nodes, body.rigid_mass.mass / nodes) if rigid else run.assembly.mass
    weights = mass.sum() * np.column_stack([along, 0 * along, across])
    run.load(body, mass > 0, q.Series(times, weights), profile=mass / mass.sum())
    run.advance(2 * ramp)
    speed, place = body.velocity.mean(axis=0)[0], body.displacement.mean(axis=0)[0]
    run.advance(ramp)
    gain = (body.velocity.mean(axis=0)[0] - speed) / ramp
    coulomb = GRAVITY * (np.sin(alpha) - share / 2 * np.cos(alpha))
    return float(gain), float(coulomb), float(body.displacement.mean(axis=0)[0] - place)


def slope_checks() -> list[Check]:
    """One per cent below and above the angle of friction, and at it, by both models."""
    checks = []
    for model in ("spheres", "surface", "overlaps"):
        gain, rigid, _ = slope_gain(0.99, model)
        rest, creep = (slope_gain(share, model)[2] for share in (1.01, 1.0))
        name = f"slope, {model}"
        checks += [
            Check(f"{name}, mu 1 % below tan alpha: acceleration to the rigid block's",
                  abs(gain / rigid - 1), "<= 0.1", abs(gain / rigid - 1) <= 0.1),
            Check(f"{name}, mu 1 % above tan alpha: way in 13 ms", abs(rest),
                  "reported" if model == "overlaps" else "<= 1e-07",
                  model == "overlaps" or abs(rest) <= 1e-7, "m"),
            Check(f"{name}, mu at tan alpha: way in 13 ms", abs(creep), "reported", True, "m"),
        ]  # fmt: skip
    return checks


def slab_threshold(model: str, radius: float, cells: int) -> float:
    """Friction that a cube has on a held slab of the same mesh, over Coulomb's coefficient.

    Gravity leans over by 45 degrees in 50 ms; friction is that of a rigid block which has gone
    0.1 mm by the same time.  Vertices begin over the hollows between vertices: the block is moved
    by half a cell both ways.  One that has not gone so far at 45 degrees: the bound is given.
    """
    friction, stiffness, pitch = 0.2, 1e6, SIDE / cells
    weight = SIDE**3 * 2700 * GRAVITY
    contact: q.SphereContact | q.SurfaceContact
    if model == "spheres":
        contact = q.SphereContact(radius, stiffness, friction)
        gap = np.sqrt((2 * radius) ** 2 - pitch**2 / 2) - weight / (
            4 * (cells + 1) ** 2 * stiffness
        )
    else:
        modulus = stiffness * (cells + 1) ** 2 / SIDE**2
        contact = q.SurfaceContact(modulus, friction, faces=FACES_OF[model])
        gap = -weight / (stiffness * (cells + 1) ** 2)
    slab = q.Body(box_mesh((2 * SIDE, SIDE + pitch, pitch), (2 * cells, cells + 1, 1)), STONE)
    place = (pitch / 2, pitch / 2, pitch + gap)
    body = q.Body(box_mesh((SIDE,) * 3, (cells,) * 3, "kuhn", place), STONE)
    duration = 0.05

    def turned(t: float) -> Floats:
        alpha = np.pi / 4 * t / duration
        return GRAVITY * np.array([np.sin(alpha), 0, -np.cos(alpha)])

    run = q.Simulation([slab, body], threads=1, gravity=turned, contact=contact)
    run.fix(slab, slab.nodes[:, 2] < np.inf)
    times = np.arange(1, 501) * duration / 500
    alpha = np.pi / 4 * times / duration
    for _ in times:
        run.advance(duration / 500)
        if body.displacement.mean(axis=0)[0] > 1e-4:
            break
    best = 1 / friction
    for factor in np.arange(0.5, 1 / friction, 0.01):
        pull = GRAVITY * np.maximum(np.sin(alpha) - factor * friction * np.cos(alpha), 0)
        way = np.cumsum(np.cumsum(pull)) * (duration / 500) ** 2
        if np.searchsorted(way, 1e-4) * duration / 500 >= run.time - 1.5 * duration / 500:
            best = float(factor)
            break
    return best


def slab_checks() -> list[Check]:
    """Vertices 10 mm apart: spheres of 24 mm as in the paper, spheres of 18 mm, surfaces."""
    checks = []
    for model, radius in (
        ("spheres", 0.012),
        ("spheres", 0.009),
        ("surface", 0.0),
        ("overlaps", 0.0),
    ):
        words = f"spheres of {2000 * radius:.0f} mm" if radius else model
        slides = slab_threshold(model, radius, 3)
        checks.append(
            Check(
                f"slope, on a slab of vertices 10 mm apart, {words}: friction over mu",
                slides, "reported" if model == "spheres" else "<= 1.01",
                model == "spheres" or slides <= 1.01,
            )
        )  # fmt: skip
    return checks


# --- many bodies ---------------------------------------------------------------------------------


def heap_checks(quick: bool) -> list[Check]:
    """Cubes turned at random fall into a box of walls: the account of energies at all times."""
    side, radius = (2 if quick else 3), 0.006
    random, bodies = np.random.default_rng(1), []
    span = 0.065
    for place in np.ndindex(side, side, side):
        mesh = box_mesh((SIDE,) * 3, (2, 2, 2))
        arm = Rotation.random(random_state=random).apply(mesh.nodes - SIDE / 2)
        bodies.append(q.Body((arm + span * np.array(place), mesh.elements), STONE, name="cube"))
    low, high = -0.033, span * (side - 1) + 0.033
    walls = [q.ContactPlane((0, 0, low), (0, 0, 1))]
    for axis in (0, 1):
        for at, way in ((low, 1.0), (high, -1.0)):
            walls.append(q.ContactPlane(tuple(at * np.eye(3)[axis]), tuple(way * np.eye(3)[axis])))
    contact = q.SphereContact(radius, 1e7, 0.577, planes=walls)
    run = q.Simulation(bodies, threads=1, gravity=(0, 0, -GRAVITY), contact=contact)
    for body in bodies:
        spin = 30 * random.normal(size=3)
        arm = body.nodes - body.nodes.mean(axis=0)
        body.velocity = np.cross(spin, arm) + np.array([0, 0, -1.0]) + random.normal(size=3)
    start = run.energy().kinetic
    worst, greatest, lost = 0.0, start, 0.0
    for _ in range(10 if quick else 40):
        run.advance(1e-3)
        e = run.energy()
        stored = e.kinetic + e.elastic + e.contact
        worst = max(worst, abs(stored + e.friction - e.external - start))
        greatest, lost = max(greatest, stored), e.friction
    assert run.contacts is not None
    words = f"heap of {side**3} cubes"
    return [
        Check(f"{words}: energies do not close, over the greatest", worst / greatest, "<= 0.001",
              worst / greatest <= 1e-3),
        Check(f"{words}: work of friction, over the energy at the start", lost / start,
              "reported", True),
        Check(f"{words}: looks for pairs", float(run.contacts.renewals), "reported", True),
        Check(f"{words}: time steps", float(run.steps_done), "reported", True),
    ]  # fmt: skip


def cost_checks(quick: bool) -> list[Check]:
    """A packing of 216 grains of the paper's size: share of contact in a step, one thread."""
    checks = []
    spheres = (0.95,) if quick else (0.99, 0.95, 0.93)
    for model, near in [("spheres", near) for near in spheres] + [("surface", 0.96)]:
        cost = packing_cost(model, 4 if quick else 6, near)
        words = f"packing of {cost.bodies} grains, {model}, {cost.touching / cost.bodies:.1f} "
        words += "pairs a grain" if model == "spheres" else "points a grain"
        bar = near == 0.95
        checks += [
            Check(f"{words}: share of contact in a step", cost.share, "<= 0.3" if bar else
                  "reported", cost.share <= 0.3 or not bar),
            Check(f"{words}: step", cost.step_with, "reported", True, "s"),
            Check(f"{words}: one look for pairs, over a step", cost.search / cost.step_with,
                  "reported", True),
        ]  # fmt: skip
    return checks
