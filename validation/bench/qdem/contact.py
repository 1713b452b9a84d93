"""Hard cases of contact between bodies, with their account of energies.

The account: kinetic, elastic and contact energy and work of friction, less what was put in, over
the greatest that there was at a time; none of the bodies is viscous.

Stone as in Table 1 of Nishiura et al. (30 GPa, 0.2, 2700 kg/m^3), bodies of 3 cm.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

import qdem_fem as q
from qdem_fem.files.errors import StepWarning
from qdem_fem.mesh.generation import make_box_mesh
from validation.bench.qdem.grains import mesh_grain

Floats = NDArray[np.float64]
SIDE = 0.03
STONE = q.Material(30e9, 0.2, 2700.0)
GRAVITY = 9.81
MODELS = ("spheres", "surface")


def make_cube(
    cells: int, low: Any = (0, 0, 0), material: q.Material = STONE, name: str = "cube"
) -> q.Body:
    """A cube of ``cells**3 * 5`` tetrahedra with its least corner at ``low`` [m]."""
    return q.Body(make_box_mesh((SIDE,) * 3, (cells,) * 3, "five", tuple(low)), material, name=name)


Case = Callable[[str], tuple[q.Simulation, float]]
EDGE, RADIUS = SIDE / 2, 0.006


def make_contact(
    model: str, friction: float = 0.5, stiffness: float = 1e7, edge: float = EDGE, **words: Any
) -> q.SphereContact | q.SurfaceContact:
    """A contact of ``stiffness`` [N/m] of a vertex, for faces with edges of ``edge`` [m]."""
    if model == "spheres":
        return q.SphereContact(0.4 * edge, stiffness, friction, **words)
    modulus = stiffness / edge**2
    return q.SurfaceContact(modulus, friction, depth=0.2 * edge, **words)


def find_reach(model: str, *shift: float) -> float:
    """Height at which two cubes touch whose vertices are aside by ``shift`` [m]."""
    return float(np.sqrt((0.8 * EDGE) ** 2 - np.dot(shift, shift))) if model == "spheres" else 0.0


def throw_body(body: q.Body, velocity: Any, spin: Any = (0, 0, 0)) -> None:
    """Give a body a velocity [m/s] and a spin [rad/s]."""
    arm = body.nodes - body.nodes.mean(axis=0)
    body.velocity = np.asarray(velocity, float) + np.cross(spin, arm)


def overlap_cubes(model: str) -> tuple[q.Simulation, float]:
    """Two cubes that begin 1 mm in each other, and are driven apart."""
    bodies = [
        make_cube(2),
        make_cube(2, (0.004, 0.002, SIDE + find_reach(model, 0.004, 0.002) - 1e-3), name="above"),
    ]
    return q.Simulation(bodies, threads=1, contact=make_contact(model, stiffness=1e5)), 1e-3


def throw_grain(model: str) -> tuple[q.Simulation, float]:
    """A grain thrown between two blocks, one 1000 times as stiff as the other."""
    first, second = find_reach(model, 0.003, 0.004) + 1e-5, find_reach(model, 0.001, 0.003) + 1e-5
    soft = q.Material(30e6, 0.2, 2700.0)
    bodies = [
        make_cube(2),
        make_cube(2, (0.003, 0.004, SIDE + first), name="grain"),
        make_cube(2, (0.002, 0.001, 2 * SIDE + first + second), soft, "soft"),
    ]
    throw_body(bodies[1], (0.02, 0, -0.05))
    throw_body(bodies[2], (0, 0.02, -0.1))
    touch = make_contact(model, stiffness=1e6)
    return q.Simulation(bodies, threads=1, contact=touch), 2e-3


def drop_chip(model: str, safety: float = 0.5) -> tuple[q.Simulation, float]:
    """A chip of cells of 0.3 mm on a block of one cell of 30 mm, at that share of the step."""
    edge = SIDE / 100
    size = 4 * edge
    block, lift = make_cube(1), 0.8 * edge / 2 if model == "spheres" else 0.0
    chip = q.Body(
        make_box_mesh((size,) * 3, (4, 4, 4), "kuhn", (0.012, 0.009, SIDE + lift + 1e-7)), STONE,
        name="chip",
    )  # fmt: skip
    touch = make_contact(model, stiffness=1e6, edge=edge)
    if isinstance(touch, q.SphereContact):  # a vertex of the block for the chip to fall on
        chip.nodes[:] += np.array([-0.012, -0.009, lift]) - [size / 2, size / 2, 0]
    throw_body(chip, (0.05, 0, -0.2))
    return q.Simulation([block, chip], threads=1, contact=touch, safety=safety), 4e-5


def spin_grain(model: str) -> tuple[q.Simulation, float]:
    """A round grain that spins at 300 rad/s and meets a resting one without friction."""
    nodes, elements = mesh_grain(1)
    other, others = mesh_grain(2)
    edge = 0.01
    low = other[:, 2].max() - nodes[:, 2].min() + (2 * 0.4 * edge if model == "spheres" else 0.0)
    bodies = [
        q.Body((other, others), STONE, name="resting"),
        q.Body((nodes + np.array([0.002, 0.001, low]), elements), STONE, name="spinning"),
    ]
    throw_body(bodies[1], (0, 0, -0.5), (50.0, 0, 300.0))
    return q.Simulation(bodies, threads=1, contact=make_contact(model, 0.0, 1e6, edge)), 4e-3


def stack_plates(model: str) -> tuple[q.Simulation, float]:
    """Four plates that fall on a wall as a stack: more contacts than freedoms of rigid plates."""
    gap, bodies = find_reach(model, 0.001, 0.001) + 1e-6, []
    for k in range(4):
        place = (0.001 * k, -0.001 * k, k * (SIDE / 2 + gap))
        plate = make_box_mesh((2 * SIDE, 2 * SIDE, SIDE / 2), (4, 4, 1), "five", place)
        bodies.append(q.Body(plate, STONE, name=f"plate {k}"))
        throw_body(bodies[-1], (0.02, 0, -0.1))
    wall = q.ContactPlane((0, 0, -(gap if model != "spheres" else 0.5 * gap)), (0, 0, 1))
    touch = make_contact(model, stiffness=1e6, planes=[wall])
    return q.Simulation(bodies, threads=1, contact=touch, gravity=(0, 0, -9.81)), 3e-3


def release_cube(model: str) -> tuple[q.Simulation, float]:
    """A cube pressed on another one until both rest, nearly; then the load is gone in one step."""
    bodies = [
        make_cube(2),
        make_cube(2, (0.004, 0.002, SIDE + find_reach(model, 0.004, 0.002)), name="above"),
    ]
    run = q.Simulation(bodies, threads=1, contact=make_contact(model))
    run.fix(bodies[0], bodies[0].nodes[:, 2] == 0)
    top = bodies[1].nodes[:, 2] > bodies[1].nodes[:, 2].max() - 1e-9
    gone = 1e-3 + run.step / 2
    times = np.array([0, 5e-4, gone - run.step / 2, gone + run.step / 2, 1.0])
    press = np.array([0, 1e3, 1e3, 0, 0])[:, None] * np.array([0.2, 0, -1.0])
    run.load(bodies[1], top, q.Series(times, press))
    return run, 2e-3


CASES: dict[str, Case] = {
    "1 mm deep at the start": overlap_cubes,
    "between blocks of 1 : 1000": throw_grain,
    "meshes of 1 : 100": drop_chip,
    "spinning grain": spin_grain,
    "stack of four plates": stack_plates,
    "load gone in one step": release_cube,
}


def sum_momenta(run: q.Simulation) -> Floats:
    """Momentum and angular momentum of all bodies, (6,)."""
    velocity = np.concatenate([body.velocity for body in run.bodies])
    place = np.concatenate([body.nodes + body.displacement for body in run.bodies])
    carried = run.assembly.mass[:, None] * velocity
    return np.concatenate([carried.sum(axis=0), np.cross(place, carried).sum(axis=0)])


def audit_energy(run: q.Simulation, duration: float, parts: int = 20) -> tuple[float, float, float]:
    """Gap in the energy balance, energy of contact, loss by friction, over the greatest energy."""
    e = run.energy()
    start = e.kinetic + e.elastic + e.contact
    worst, greatest, stored = 0.0, start, e.contact
    for _ in range(parts):
        run.advance(duration / parts)
        e = run.energy()
        held = e.kinetic + e.elastic + e.contact
        worst = max(worst, abs(held + e.friction - e.external - start))
        greatest, stored = max(greatest, held), max(stored, e.contact)
    return worst / greatest, stored / greatest, e.friction / greatest


def collide_cubes(model: str, share: float) -> tuple[float, bool]:
    """A collision at a share of the critical step with contact: what energies lack; was it said."""
    bodies = [
        make_cube(2),
        make_cube(2, (0.004, 0.002, SIDE + find_reach(model, 0.004, 0.002) + 1e-7), name="above"),
    ]
    touch = make_contact(model, stiffness=1e9)
    step = share * q.Simulation(bodies, threads=1, contact=touch).critical_step.value
    bodies = [
        make_cube(2),
        make_cube(2, (0.004, 0.002, SIDE + find_reach(model, 0.004, 0.002) + 1e-7), name="above"),
    ]
    run = q.Simulation(bodies, threads=1, contact=touch, step=step)
    throw_body(bodies[1], (0, 0, -0.05))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", StepWarning)
        gap = audit_energy(run, 400 * step)[0]
    return gap, any("times the critical" in str(w.message) for w in caught)
