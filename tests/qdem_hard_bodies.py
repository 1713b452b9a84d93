"""One element, parts apart, inverted and left-handed elements, nodes of no element."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.linalg import eigh

from qdem_fem import Body, Simulation, ramp
from qdem_fem.files.errors import ElementInverted
from qdem_fem.mesh.generation import jitter, make_box_mesh
from qdem_fem.mesh.tetrahedra import TetMesh
from validation.bench.qdem import judge as qdem_judge
from validation.bench.qdem.checks import below, between, reported
from validation.bench.qdem.hard import CONCRETE
from validation.bench.qdem.judge import FloatArray, IntArray
from validation.bench.qdem.meshes import delaunay_mesh
from validation.case import Check

ONE_NODES = np.array([[0.0, 0, 0], [1, 0.1, 0], [0.2, 1, 0], [0.1, 0.3, 1.1]])
ONE_ELEMENT = np.array([[0, 1, 2, 3]])
GRAVITY = (0.0, 0.0, -9.81)


# --- one element ------------------------------------------------------------------------------


def single_element_checks() -> list[Check]:
    """Rigid motion without stress; free vibration in each of its six modes."""
    return [
        *rigid_checks(),
        below("one element: vibration in its six modes, linear law, to the 12 x 12 problem",
              vibration_error("small", 1e-3), 1e-9),
        below("one element: the same by the paper's law at strains of 1e-9",
              vibration_error("finger", 1e-9), 1e-7),
    ]  # fmt: skip


def rigid_checks() -> list[Check]:
    """Flight at 100 m/s is exact; turned by a right angle and let go, it stays at rest."""
    body = Body((ONE_NODES, ONE_ELEMENT), CONCRETE)
    run = Simulation([body], threads=1)
    velocity = np.array([100.0, -30.0, 7.0])
    body.velocity = np.tile(velocity, (4, 1))
    run.advance(1000 * run.step)
    off = np.abs(body.displacement - velocity * run.time).max() / (100 * run.time)

    turned = Body((ONE_NODES, ONE_ELEMENT), CONCRETE)
    run = Simulation([turned], threads=1)
    quarter = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    turned.displacement = ONE_NODES @ quarter.T - ONE_NODES
    run.advance(1000 * run.step)
    stress = np.abs(turned.stress()).max() / float(np.max(CONCRETE.young))
    return [
        below("one element: flight over 1000 steps, relative error", off, 1e-12),
        below("one element: stress after a right angle and 1000 steps, over E", stress, 1e-12),
    ]


def vibration_error(law: Any, strain: float, steps: int = 1000) -> float:
    """Worst of six modes over the run, as a share of the amplitude.

    Velocity Verlet from rest is u(k) = phi cos(k theta) with sin(theta/2) = omega dt/2; omega and
    phi are of the judge's 12 x 12 matrices.
    """
    stiffness = qdem_judge.stiffness(
        ONE_NODES, ONE_ELEMENT, CONCRETE.young, CONCRETE.poisson
    ).toarray()
    mass = np.repeat(qdem_judge.lumped_mass(ONE_NODES, ONE_ELEMENT, CONCRETE.density), 3)
    value, shape = eigh(stiffness, np.diag(mass))
    worst = 0.0
    for number in range(6, 12):
        phi = strain * shape[:, number] / np.abs(shape[:, number]).max()
        body = Body((ONE_NODES, ONE_ELEMENT), CONCRETE)
        run = Simulation([body], strain=law, threads=1)
        body.displacement = phi.reshape(4, 3)
        history = run.advance(steps * run.step, {str(k): k for k in range(4)}, sampling=run.step)
        found = np.hstack([history[str(k)] for k in range(4)])
        theta = 2 * np.arcsin(np.sqrt(value[number]) * run.step / 2)
        expected = np.outer(np.cos(theta * np.arange(len(found))), phi)
        worst = max(worst, float(np.abs(found - expected).max() / strain))
    return worst


# --- inverted elements ------------------------------------------------------------------------

PUSH_STEPS = 2000
"""Steps over which a node is pushed by 1 m."""


def inverted_checks(seeds: range) -> list[Check]:
    """A node is pushed through an element: stopped at the right step, the right element named."""
    wrong, late = 0, 0.0
    for seed in seeds:
        elements, shares = vanishing_volumes(seed)
        named, at = pushed_until_inverted(seed)
        # the first, or one that follows before the stop
        wrong += named not in elements[shares <= at]
        late = max(late, (at - shares.min()) * PUSH_STEPS)
    return [
        below(f"inverted: wrong elements named in {len(seeds)} pushes in random directions",
              wrong, 0.5),
        between("inverted: steps from the volume's zero to the stop, most", late, 0, 2),
        below("inverted: wrong element named after an impact, 0 is no", impact_names_wrong(), 0.5),
    ]  # fmt: skip


def _push(seed: int) -> tuple[TetMesh, int, FloatArray]:
    """An irregular cube, an inner node of it, and the way it is to go, 1 m."""
    mesh = jitter(make_box_mesh((1.0, 1.0, 1.0), (4, 4, 4)), 0.2, seed=seed)
    random = np.random.default_rng(seed)
    inner = np.flatnonzero(((mesh.nodes > 0.1) & (mesh.nodes < 0.9)).all(axis=1))
    direction = random.normal(size=3)
    return mesh, int(random.choice(inner)), direction / np.linalg.norm(direction)


def vanishing_volumes(seed: int) -> tuple[IntArray, FloatArray]:
    """Elements at the node, and at which share of the way each has no volume left.

    With one node a moved by s d and its neighbours at rest, J = 1 + s d . grad N_a.
    """
    mesh, node, way = _push(seed)
    elements, corner = np.nonzero(mesh.elements == node)
    rates = np.array([
        _gradient(mesh.nodes[mesh.elements[e]], int(a)) @ way
        for e, a in zip(elements, corner, strict=True)
    ])  # fmt: skip
    return elements, np.where(rates < 0, -1 / rates, np.inf)


def _gradient(vertices: FloatArray, corner: int) -> FloatArray:
    """grad N_a [1/m] of one tetrahedron (4, 3): from the inverse of (1, x, y, z) of its nodes."""
    return np.asarray(np.linalg.inv(np.column_stack([np.ones(4), vertices]))[1:, corner])


def pushed_until_inverted(seed: int) -> tuple[int, float]:
    """The element that QDEM names, and the share of the way at which it stops."""
    mesh, node, way = _push(seed)
    body = Body(mesh, CONCRETE)
    run = Simulation([body], threads=1)
    duration = PUSH_STEPS * run.step
    around = mesh.elements[(mesh.elements == node).any(axis=1)]
    run.fix(body, np.setdiff1d(around, node))
    for axis, letter in enumerate("xyz"):
        run.prescribe(body, node, letter, ramp(duration, way[axis]))
    try:
        run.advance(duration)
    except ElementInverted as error:
        return error.element, run.time / duration
    return -1, np.inf


def impact_names_wrong() -> float:
    """One half thrown at the other, which is held: is the element named one that has turned over?

    At the displacement before the last step, whose forces can not be right.
    """
    mesh = make_box_mesh((1.0, 1.0, 1.0), (4, 4, 4))
    body = Body(mesh, CONCRETE)
    run = Simulation([body], threads=1)
    run.fix(body, mesh.nodes[:, 0] < 0.01)
    body.velocity = np.where(mesh.nodes[:, :1] > 0.6, [-8000.0, 0.0, 0.0], 0.0)
    try:
        for _ in range(1000):
            before = body.displacement
            run.advance(run.step)
    except ElementInverted as error:
        corner = (body.nodes + before)[body.elements[error.element]]
        turned = np.linalg.det(corner[1:] - corner[0]) <= 0
        return float(not (turned and f"element {error.element} of {body.name}" in str(error)))
    return 1.0


# --- parts, loose nodes, left hands -----------------------------------------------------------


def fall(
    nodes: FloatArray, elements: IntArray, step: float, steps: int = 500
) -> tuple[Body, FloatArray]:
    """A body that hangs at nodes below z = 0.3 in gravity: it, and its displacement [m], (n, 3)."""
    body = Body((nodes, elements), CONCRETE)
    run = Simulation([body], step=step, gravity=GRAVITY, threads=1)
    run.fix(body, nodes[:, 2] < 0.3)
    run.advance(steps * run.step)
    return body, body.displacement


def step_of(nodes: FloatArray, elements: IntArray) -> float:
    """0.8 of a free body's critical step [s]."""
    run = Simulation([Body((nodes, elements), CONCRETE)], threads=1)
    return 0.8 * run.critical_step.value


def parts_checks(count: int = 200) -> list[Check]:
    """Two parts of one body, and two bodies, move as each alone.

    Not to the bit: in another order of elements the forces of a node are summed in another order.
    """
    pair = [delaunay_mesh(count, seed) for seed in (1, 2)]
    step = min(step_of(*part) for part in pair)
    alone = [fall(*part, step)[1] for part in pair]
    apart = pair[1][0] + [5.0, 0.0, 0.0]
    _, joined = fall(
        np.vstack([pair[0][0], apart]), np.vstack([pair[0][1], pair[1][1] + count]), step
    )
    scale = max(float(np.abs(each).max()) for each in alone)
    differences = [
        float(np.abs(joined[:count] - alone[0]).max() / scale),
        float(np.abs(joined[count:] - alone[1]).max() / scale),
    ]
    return [
        below("parts apart: motion of each to that alone", max(differences), 1e-11),
        reported("parts apart: numbers that differ in some bit", 100 * float(
            np.mean(joined != np.vstack(alone))), "%"),
    ]  # fmt: skip


def loose_nodes_checks() -> list[Check]:
    """Nodes of no element, between the others: listed, at rest, and felt by nobody."""
    nodes, elements = delaunay_mesh(200, 3)
    used = np.unique(elements)
    bare_nodes = nodes[used]
    bare = np.searchsorted(used, elements)
    # a loose node after every tenth
    place = np.arange(len(used)) + np.arange(len(used)) // 10
    loose = np.setdiff1d(np.arange(place[-1] + 3), place)
    more = np.full((place[-1] + 3, 3), 7.0)
    more[place] = bare_nodes
    step = step_of(bare_nodes, bare)
    _, expected = fall(bare_nodes, bare, step)
    body, found = fall(more, place[bare], step)
    critical = step_of(more, place[bare]) / step
    return [
        below("loose nodes: not listed by the mesh", len(np.setxor1d(body.mesh.unused, loose)),
              0.5),
        below("loose nodes: greatest displacement of one", np.abs(found[loose]).max(), 1e-300, "m"),
        below("loose nodes: numbers of the others that change in any bit",
              float((found[place] != expected).sum()), 0.5),
        between("loose nodes: critical step over that without", critical, 1 - 1e-6, 1 + 1e-6),
    ]  # fmt: skip


def left_handed_checks() -> list[Check]:
    """Half of the elements turned over by a swap of their last two nodes: mended and listed."""
    nodes, elements = delaunay_mesh(200, 4)
    nodes, elements = nodes[np.unique(elements)], np.searchsorted(np.unique(elements), elements)
    left = np.random.default_rng(0).random(len(elements)) < 0.5
    turned = elements.copy()
    turned[left] = turned[left][:, [0, 1, 3, 2]]
    other = elements.copy()
    other[left] = other[left][:, [1, 0, 2, 3]]
    step = step_of(nodes, elements)
    _, expected = fall(nodes, elements, step)
    body, found = fall(nodes, turned, step)
    _, swapped = fall(nodes, other, step)
    scale = float(np.abs(expected).max())
    listed = np.setxor1d(body.mesh.flipped, np.flatnonzero(left))
    return [
        below("left-handed: not listed by the mesh", len(listed), 0.5),
        below("left-handed, last two nodes swapped: numbers that change in any bit",
              float((found != expected).sum()), 0.5),
        below("left-handed, first two nodes swapped: motion to that of the right-handed mesh",
              float(np.abs(swapped - expected).max() / scale), 1e-11),
    ]  # fmt: skip
