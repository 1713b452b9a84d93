"""Bodies pressed on others, with closed forms: a Brazilian disc, an edge in a groove, a vertex."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import qdem_fem as q
from qdem_fem.mesh_generation import box_mesh, gmsh_model, gmsh_tetrahedra
from validation.case import Check
from validation.qdem_contact_hertz import DENSITY, STONE, YOUNG, rest
from validation.qdem_contact_trials import FACES_OF, GRAVITY, SIDE

Floats = NDArray[np.float64]
RADIUS, THICKNESS = 0.02, 0.01
"""Of the disc [m]."""
MODELS = ("spheres", "surface", "overlaps")


def reported(name: str, value: float, most: float | None = None) -> Check:
    """A check of a value, that it is at most ``most`` where that is given."""
    bar = "reported" if most is None else f"<= {most:g}"
    return Check(name, value, bar, most is None or value <= most)


def disc_mesh(edge: float) -> tuple[Floats, NDArray[np.int64]]:
    """A disc about the y axis of tetrahedra with edges of ``edge`` [m]."""
    with gmsh_model("disc_mesh", edge, "take a shorter edge") as gmsh:
        gmsh.model.occ.addCylinder(0, -THICKNESS / 2, 0, 0, THICKNESS, 0, RADIUS)
        gmsh.model.occ.synchronize()
        gmsh.option.setNumber("Mesh.MeshSizeMin", edge)
        gmsh.option.setNumber("Mesh.MeshSizeMax", edge)
        gmsh.model.mesh.generate(3)
        mesh = gmsh_tetrahedra(gmsh, "disc_mesh")
    return mesh.nodes, mesh.elements


def disc_closed(x: Floats, z: Floats) -> Floats:
    """Stress along x of a disc under line loads along z, over 2 P/(pi D t), at points (n,) [m]."""
    above, below = x**2 + (RADIUS - z) ** 2, x**2 + (RADIUS + z) ** 2
    sums = (RADIUS - z) * x**2 / above**2 + (RADIUS + z) * x**2 / below**2
    return np.asarray(1 - 2 * RADIUS * sums)


def disc_stress(model: str, edge: float) -> float:
    """Tensile stress about the centre of a pressed disc, over that of `disc_closed`."""
    nodes, elements = disc_mesh(edge)
    cells = (6, max(2, round(2 * THICKNESS / edge)), 2)
    size = np.array([0.02, 2 * THICKNESS, 0.005])
    top = nodes[:, 2].max()
    gap = edge if model == "spheres" else 0.0
    plates = []
    for sign in (1, -1):
        corner = -size / 2
        corner[2] = top + gap if sign > 0 else nodes[:, 2].min() - gap - size[2]
        box = box_mesh((size[0], size[1], size[2]), cells, "kuhn", tuple(corner))
        plates.append(q.Body(box, STONE, rigid=True, name="plate"))
    disc = q.Body((nodes, elements), STONE, name="disc")
    if model == "spheres":
        contact: q.SphereContact | q.SurfaceContact = q.SphereContact(
            edge / 2, 10 * YOUNG * edge, 0.0
        )
    else:
        contact = q.SurfaceContact(10 * YOUNG / edge, 0.0, faces=FACES_OF[model], depth=edge / 5)
    run = q.Simulation([disc, *plates], threads=1, strain="small", contact=contact)
    period = 8 * RADIUS / np.sqrt(YOUNG / DENSITY)
    for plate, sign in zip(plates, (1, -1), strict=True):
        run.fix(plate, plate.nodes[:, 2] < np.inf, "xy")
        way = q.ramp(2 * period, -sign * 2e-5 - sign * (0.3 * gap))
        run.prescribe(plate, plate.nodes[:, 2] < np.inf, "z", way)
    run.advance(2 * period)
    rest(run, period, most=200)
    assert run.contacts is not None
    own = run.contacts.nodes < len(nodes)
    force = run.contacts.kernel.force[own, 2]
    load = np.abs(force).sum() / 2
    corners = nodes[elements]
    centre = corners.mean(axis=1)
    volume = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6
    inner = np.hypot(centre[:, 0], centre[:, 2]) < 0.2 * RADIUS
    closed = 2 * load / (np.pi * 2 * RADIUS * THICKNESS)
    expected = closed * disc_closed(centre[inner, 0], centre[inner, 2])
    found = disc.stress()[inner, 0, 0]
    return float((volume[inner] * found).sum() / (volume[inner] * expected).sum())


def disc_checks(quick: bool) -> list[Check]:
    """On two meshes; of linear elements and a load as wide as an edge, so without a bar."""
    checks = []
    for edge in (0.004,) if quick else (0.004, 0.0025):
        for model in MODELS:
            error = abs(disc_stress(model, edge) - 1)
            name = f"Brazilian disc, edges of {1e3 * edge:g} mm, {model}: stress at the centre"
            checks.append(reported(f"{name}, error", error))
    return checks


def groove(model: str, friction: float) -> tuple[float, float]:
    """A cube on its edge in a groove of 90 degrees that leans along itself, ``tan = 1/2``.

    Force across both flanks over ``2 W cos(alpha)/sqrt 2``, and acceleration along the groove over
    ``g (sin alpha - sqrt 2 mu cos alpha)``.  Flanks: rigid boxes, for spheres rigid walls.
    """
    alpha, stiffness, ramp, edge = np.arctan(0.5), 9e5, 13e-3, 0.006
    mesh = box_mesh((SIDE,) * 3, (2, 2, 2), "kuhn", (-SIDE / 2,) * 3)
    weight = SIDE**3 * DENSITY * GRAVITY * np.cos(alpha)
    sink = weight / np.sqrt(2) / stiffness * (0.5 if model == "spheres" else 1.0)
    turn = Rotation.from_euler("y", 45, degrees=True)
    nodes = turn.apply(mesh.nodes)
    nodes[:, 2] += np.sqrt(2) * (SIDE / 2 - sink + (edge if model == "spheres" else 0.0))
    cube = q.Body((nodes, mesh.elements), STONE, name="cube")
    flanks = []
    if model == "spheres":
        normals = [(s / np.sqrt(2), 0, 1 / np.sqrt(2)) for s in (1, -1)]
        walls = [q.ContactPlane((0, 0, 0), n, friction) for n in normals]
        contact: q.SphereContact | q.SurfaceContact = q.SphereContact(
            edge, stiffness / 9, friction, planes=walls
        )
    else:
        contact = q.SurfaceContact(stiffness / SIDE**2, friction, faces=FACES_OF[model])
        for s in (1, -1):
            box = box_mesh((0.05, 0.07, 0.01), (3, 5, 1), "kuhn", (0.0, -0.035, -0.01))
            if s < 0:
                box = box_mesh((0.05, 0.07, 0.01), (3, 5, 1), "kuhn", (-0.05, -0.035, -0.01))
            lean = Rotation.from_euler("y", -45 * s, degrees=True)
            flanks.append(q.Body((lean.apply(box.nodes), box.elements), STONE, rigid=True))
    run = q.Simulation([cube, *flanks], threads=1, contact=contact)
    for flank in flanks:
        run.fix(flank, flank.nodes[:, 2] < np.inf)
    times = np.linspace(0, ramp, 200)
    along = GRAVITY * np.sin(alpha) * 0.5 * (1 - np.cos(np.pi * times / ramp))
    mass = run.assembly.mass[: len(nodes)]
    pull = mass.sum() * np.column_stack(
        [0 * along, along, np.full(200, -GRAVITY * np.cos(alpha))]
    )  # fmt: skip
    run.load(cube, mass > 0, q.Series(times, pull), profile=mass / mass.sum())
    run.advance(2 * ramp)
    speed, across = cube.velocity.mean(axis=0)[1], []
    for _ in range(50):
        run.advance(ramp / 50)
        assert run.contacts is not None
        force = run.contacts.kernel.force[: len(run.contacts.outside[0].node)]
        across.append(force[:, 2].sum() * np.sqrt(2))
    gain = (cube.velocity.mean(axis=0)[1] - speed) / ramp
    expected = GRAVITY * (np.sin(alpha) - np.sqrt(2) * friction * np.cos(alpha))
    return float(np.mean(across) / (np.sqrt(2) * weight)), float(gain / expected)


def groove_checks() -> list[Check]:
    """With and without friction, by all models."""
    checks = []
    for model in MODELS:
        for friction in (0.0, 0.2):
            across, gain = groove(model, friction)
            name = f"edge in a groove, {model}, mu {friction:g}"
            checks += [
                reported(f"{name}: force of the flanks, error", abs(across - 1), 0.01),
                reported(f"{name}: acceleration, error", abs(gain - 1), 0.01),
            ]
    return checks


def tetrahedron(model: str, friction: float) -> tuple[float, float]:
    """A tetrahedron let stand on its vertex, where spring and weight balance, for 2 ms.

    Greatest difference of the contact's force from the weight, over it, and the way aside [m].
    """
    corners = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    upright = Rotation.align_vectors([[0, 0, -1.0]], corners[:1] / np.sqrt(3))[0]
    nodes = 0.01 * upright.apply(corners)
    nodes[:, 2] -= nodes[:, 2].min()
    volume = 0.02**3 / 3
    weight = volume * DENSITY * GRAVITY
    area = (
        np.sqrt(3) / 4 * (0.02 * np.sqrt(2)) ** 2
    )  # of a face; c = 1/3 of the three at the vertex
    if model == "spheres":
        stiffness, radius = 1e6, 0.004
        contact: q.SphereContact | q.SurfaceContact = q.SphereContact(radius, stiffness, friction)
        lift = 2 * radius - weight / stiffness
    else:
        contact = q.SurfaceContact(1e11, friction, faces=FACES_OF[model])
        bears = area / 3 * (1 - (1 / 3) ** 50)
        lift = -weight / (0.5 * 1e11 * bears)
    plate = q.Body(box_mesh((0.04, 0.04, 0.01), (4, 4, 1), "kuhn", (-0.02, -0.02, -0.01)), STONE,
                   rigid=True)  # fmt: skip
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


def vertex_checks() -> list[Check]:
    """With and without friction; the force is the weight within a thousandth."""
    checks = []
    for model in MODELS:
        for friction in (0.0, 0.5):
            worst, aside = tetrahedron(model, friction)
            name = f"tetrahedron on its vertex, {model}, mu {friction:g}"
            checks += [
                reported(f"{name}: force less weight", worst, 1e-3),
                Check(f"{name}: way aside in 2 ms", aside, "<= 1e-08", aside <= 1e-8, "m"),
            ]
    return checks
