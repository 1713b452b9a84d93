"""A block on a slope, and a tetrahedron on its vertex, by all models of contact."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

import qdem_fem as q
from qdem_fem.mesh.generation import make_box_mesh
from validation.bench.qdem.contact import GRAVITY, SIDE, STONE


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
        contact = q.SurfaceContact(stiffness / SIDE**2, share / 2, planes=walls)
    body = q.Body(make_box_mesh((SIDE,) * 3, (2, 2, 2), "kuhn", (0, 0, height)), STONE, rigid=rigid)
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


def tetrahedron(model: str, friction: float) -> tuple[float, float]:
    """A tetrahedron let stand on its vertex, where spring and weight balance, for 2 ms.

    Greatest difference of the contact's force from the weight, over it, and the way aside [m].
    """
    corners = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    upright = Rotation.align_vectors([[0, 0, -1.0]], corners[:1] / np.sqrt(3))[0]
    nodes = 0.01 * upright.apply(corners)
    nodes[:, 2] -= nodes[:, 2].min()
    volume = 0.02**3 / 3
    weight = volume * 2700.0 * GRAVITY
    area = (
        np.sqrt(3) / 4 * (0.02 * np.sqrt(2)) ** 2
    )  # of a face; c = 1/3 of the three at the vertex
    if model == "spheres":
        stiffness, radius = 1e6, 0.004
        contact: q.SphereContact | q.SurfaceContact = q.SphereContact(radius, stiffness, friction)
        lift = 2 * radius - weight / stiffness
    else:
        contact = q.SurfaceContact(1e11, friction)
        bears = area / 3 * (1 - (1 / 3) ** 50)
        lift = -weight / (0.5 * 1e11 * bears)
    plate = q.Body(
        make_box_mesh((0.04, 0.04, 0.01), (4, 4, 1), "kuhn", (-0.02, -0.02, -0.01)),
        STONE,
        rigid=True,
    )
    nodes[:, 2] += lift
    if model != "spheres":  # within a face, away from where several meet
        nodes[:, :2] += np.array([0.003, 0.004]) - nodes[np.argmin(nodes[:, 2]), :2]
    body = q.Body((nodes, np.array([[0, 1, 2, 3]])), STONE, rigid=True, name="tetrahedron")
    run = q.Simulation([body, plate], threads=1, gravity=(0, 0, -GRAVITY), contact=contact)
    run.fix(plate, plate.nodes[:, 2] < np.inf)
    worst = 0.0
    for _ in range(40):
        run.advance(5e-5)
        assert run.contacts is not None
        force = run.contacts.kernel.force[:4, 2].sum()
        worst = max(worst, abs(force / weight - 1))
    return float(worst), float(np.abs(body.displacement[:, :2]).max())
