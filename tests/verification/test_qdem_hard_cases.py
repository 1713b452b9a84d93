"""Hard cases of QDEM in their smallest forms, and proof that their checks can fail."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.linalg import eigh

import qdem_fem as q
from qdem_fem.files import Floats, Integers
from qdem_fem.files.errors import ElementInverted, StepWarning, Unstable
from qdem_fem.march import steps
from qdem_fem.mesh.generation import make_box_mesh
from qdem_fem.mesh.tetrahedra import TetMesh
from validation.bench.qdem import hard, judge
from validation.bench.qdem.hard import CONCRETE
from validation.bench.qdem.meshes import jitter_nodes, make_delaunay, make_slivers, measure_edges
from validation.bench.qdem.problem import make_cantilever
from validation.case import Check


def hold(checks: list[Check]) -> None:
    """All of them, or say which do not."""
    failing = [f"{check.name}: {check.value:.4g}, bar {check.bar}" for check in checks]
    assert all(check.holds for check in checks), "\n".join(failing)


def make_graded(ratio: float, cells: int) -> tuple[Floats, Integers]:
    """A unit cube whose cells shrink towards the corner at the origin.

    Shells ``max(x, y, z) = s`` of a regular mesh are moved to ``ratio^((s - 1)/(1 - 1/cells))``:
    from 1/ratio, the innermost cube, to 1, each by the same factor.  Kuhn's tetrahedra do not
    cross the planes between the sides of the shells, so none is turned over.
    """
    mesh = make_box_mesh((1.0, 1.0, 1.0), (cells, cells, cells))
    shell = mesh.nodes.max(axis=1)
    inside = shell > 0
    moved = np.zeros_like(shell)
    moved[inside] = ratio ** ((shell[inside] - 1) / (1 - 1 / cells)) / shell[inside]
    return mesh.nodes * moved[:, None], mesh.elements


# --- shapes ----------------------------------------------------------------------------------


def test_a_sliver_changes_nothing_but_the_step() -> None:
    """Altitude 0.004 of the longest edge: K u = f, 2/omega, the motion; named and warned of."""
    hold(hard.check_sliver())


def test_graded_box_fills_the_cube_and_turns_no_element() -> None:
    nodes, elements = make_graded(100.0, 6)
    volume = np.linalg.det(nodes[elements[:, 1:]] - nodes[elements[:, :1]]) / 6
    assert (volume > 0).all()
    assert volume.sum() == pytest.approx(1.0, rel=1e-12)
    edges = measure_edges(nodes, elements)
    assert edges.min() == pytest.approx(np.sqrt(3) / 100, rel=1e-12)


# --- materials -------------------------------------------------------------------------------


@pytest.mark.long
def test_locking_is_that_of_linear_tetrahedra() -> None:
    """Against K u = f on the same mesh, and against quadratic tetrahedra: Kuhn's cells lock."""
    hold(hard.check_locking(((12, 2, 2),), (12, 2, 2)))


@pytest.mark.parametrize("where", ["tip half", "core"])
def test_stiffness_jumps_of_a_thousand(where: str) -> None:
    """K u = f, 2/omega and the motion of scikit-fem, where stiff elements lie in soft ones."""
    problem = make_cantilever((6, 2, 2))
    mesh = problem.mesh
    middle, size = mesh.nodes[mesh.elements].mean(axis=1), mesh.nodes.max(axis=0)
    inside = (np.abs(middle / size - 0.5)[:, 1:] < 0.25).all(axis=1)
    stiff = middle[:, 0] > size[0] / 2 if where == "tip half" else inside
    material = replace(problem.material, young=np.where(stiff, 45e9, 45e6))
    jump = replace(problem, material=material, force=(0.0, 0.0, -2e-3))
    critical = jump.simulation()[1].critical_step
    assert stiff[critical.element]
    hold([
        *hard.check_static("jump", jump), hard.check_motion("jump", jump),
        hard.check_critical_step("jump", critical.value, hard.find_critical_step(jump)),
    ])  # fmt: skip


# --- steps -----------------------------------------------------------------------------------


@pytest.mark.long
def test_steps_near_the_critical_one() -> None:
    """H <= E <= H/(1 - s^2) at s = 0.99 and at the reported value."""
    hold(hard.check_near_critical(20_000))


def test_a_step_above_the_critical_one_is_named_with_its_element() -> None:
    """Far above, under a load, from rest: the message gives ratio, steps, element and remedy."""
    problem = make_cantilever((12, 2, 2))
    critical = problem.simulation()[1].critical_step
    body, run = problem.simulation(amplitude=1.0, step=1.05 * critical.value)
    named = f"element {critical.element} of {body.name}"
    with pytest.warns(StepWarning, match=named), pytest.raises(Unstable, match=named) as raised:
        run.advance(5000 * run.step)
    text = str(raised.value)
    assert "1.050 times the critical one" in text
    assert "safety 0.9" in text
    assert raised.value.exit_code == 6


def test_energy_bound_is_broken_above_the_critical_step(monkeypatch: pytest.MonkeyPatch) -> None:
    """At 1.001 of the judge's step energy grows by 1.09 each step: the check fails, not the run."""
    problem = hard.make_irregular_cube()
    share = 1.001 / hard.compare_steps(problem)
    monkeypatch.setattr(steps, "MARCH", replace(steps.MARCH, unstable_growth=1e30))
    energy = hard.sample_energy(problem, share, 600, 100)
    assert energy.max() / energy[0] > 1 / (1 - 0.99**2)


# --- one element ------------------------------------------------------------------------------

ONE_NODES = np.array([[0.0, 0, 0], [1, 0.1, 0], [0.2, 1, 0], [0.1, 0.3, 1.1]])
ONE_ELEMENT = np.array([[0, 1, 2, 3]])


def test_rigid_motion_of_one_element_makes_no_stress() -> None:
    """Flight at 100 m/s is exact; turned by a right angle and let go, it stays at rest."""
    body = q.Body((ONE_NODES, ONE_ELEMENT), CONCRETE)
    run = q.Simulation([body], threads=1)
    velocity = np.array([100.0, -30.0, 7.0])
    body.velocity = np.tile(velocity, (4, 1))
    run.advance(1000 * run.step)
    assert np.abs(body.displacement - velocity * run.time).max() < 1e-12 * 100 * run.time
    turned = q.Body((ONE_NODES, ONE_ELEMENT), CONCRETE)
    run = q.Simulation([turned], threads=1)
    quarter = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    turned.displacement = ONE_NODES @ quarter.T - ONE_NODES
    run.advance(1000 * run.step)
    assert np.abs(turned.stress()).max() < 1e-12 * np.max(CONCRETE.young)


def vibration_error(law: Any, strain: float) -> float:
    """Worst of six modes over the run, as a share of the amplitude.

    Velocity Verlet from rest is u(k) = phi cos(k theta) with sin(theta/2) = omega dt/2; omega and
    phi are of the judge's 12 x 12 matrices.
    """
    stiffness = judge.build_stiffness(
        ONE_NODES, ONE_ELEMENT, CONCRETE.young, CONCRETE.poisson
    ).toarray()
    mass = np.repeat(judge.lump_mass(ONE_NODES, ONE_ELEMENT, CONCRETE.density), 3)
    value, shape = eigh(stiffness, np.diag(mass))
    worst = 0.0
    for number in range(6, 12):
        phi = strain * shape[:, number] / np.abs(shape[:, number]).max()
        body = q.Body((ONE_NODES, ONE_ELEMENT), CONCRETE)
        run = q.Simulation([body], strain=law, threads=1)
        body.displacement = phi.reshape(4, 3)
        history = run.advance(1000 * run.step, {str(k): k for k in range(4)}, sampling=run.step)
        found = np.hstack([history[str(k)] for k in range(4)])
        theta = 2 * np.arcsin(np.sqrt(value[number]) * run.step / 2)
        expected = np.outer(np.cos(theta * np.arange(len(found))), phi)
        worst = max(worst, float(np.abs(found - expected).max() / strain))
    return worst


def test_one_element_vibrates_in_its_six_modes() -> None:
    """By the linear law to the 12 x 12 problem, and by the paper's at strains of 1e-9."""
    assert vibration_error("small", 1e-3) < 1e-9
    assert vibration_error("finger", 1e-9) < 1e-7


# --- inverted elements ------------------------------------------------------------------------

PUSH_STEPS = 2000  # steps over which a node is pushed by 1 m


def _push(seed: int) -> tuple[TetMesh, int, Floats]:
    """An irregular cube, an inner node of it, and the way it is to go, 1 m."""
    mesh = jitter_nodes(make_box_mesh((1.0, 1.0, 1.0), (4, 4, 4)), 0.2, seed=seed)
    random = np.random.default_rng(seed)
    inner = np.flatnonzero(((mesh.nodes > 0.1) & (mesh.nodes < 0.9)).all(axis=1))
    direction = random.normal(size=3)
    return mesh, int(random.choice(inner)), direction / np.linalg.norm(direction)


def vanishing_volumes(seed: int) -> tuple[Integers, Floats]:
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


def _gradient(vertices: Floats, corner: int) -> Floats:
    """grad N_a [1/m] of one tetrahedron (4, 3): from the inverse of (1, x, y, z) of its nodes."""
    return np.asarray(np.linalg.inv(np.column_stack([np.ones(4), vertices]))[1:, corner])


def pushed_until_inverted(seed: int) -> tuple[int, float]:
    """The element that QDEM names, and the share of the way at which it stops."""
    mesh, node, way = _push(seed)
    body = q.Body(mesh, CONCRETE)
    run = q.Simulation([body], threads=1)
    duration = PUSH_STEPS * run.step
    around = mesh.elements[(mesh.elements == node).any(axis=1)]
    run.fix(body, np.setdiff1d(around, node))
    for axis, letter in enumerate("xyz"):
        run.prescribe(body, node, letter, q.make_ramp(duration, way[axis]))
    try:
        run.advance(duration)
    except ElementInverted as error:
        return error.element, run.time / duration
    return -1, np.inf


@pytest.mark.parametrize("seed", range(8))
def test_a_node_pushed_through_an_element_stops_the_march(seed: int) -> None:
    """At the right step; the element named is the first, or one that follows before the stop."""
    elements, shares = vanishing_volumes(seed)
    named, at = pushed_until_inverted(seed)
    assert named in elements[shares <= at]
    assert 0 <= (at - shares.min()) * PUSH_STEPS <= 2


def test_an_element_inverted_by_an_impact_is_named() -> None:
    """One half thrown at the other: turned over at the displacement before the last step."""
    mesh = make_box_mesh((1.0, 1.0, 1.0), (4, 4, 4))
    body = q.Body(mesh, CONCRETE)
    run = q.Simulation([body], threads=1)
    run.fix(body, mesh.nodes[:, 0] < 0.01)
    body.velocity = np.where(mesh.nodes[:, :1] > 0.6, [-8000.0, 0.0, 0.0], 0.0)
    with pytest.raises(ElementInverted) as raised:
        run.advance(1000 * run.step)
    before = body.displacement - run.step * run.assembly.field("velocity")
    corner = (body.nodes + before)[body.elements[raised.value.element]]
    assert np.linalg.det(corner[1:] - corner[0]) <= 0
    assert f"element {raised.value.element} of {body.name}" in str(raised.value)


@pytest.mark.parametrize("share", [1.001, 1.3])
def test_an_element_inverted_from_the_start_is_named(share: float) -> None:
    """A state set by the user: one node beyond the opposite face of element 7, and so of 6."""
    nodes, elements = make_slivers(1.0)
    corner = nodes[elements[7]]
    normal = np.cross(corner[2] - corner[1], corner[3] - corner[1])
    height = (corner[0] - corner[1]) @ normal / (normal @ normal)
    body = q.Body((nodes, elements), CONCRETE, name="cube")
    run = q.Simulation([body], threads=1)
    field = np.zeros_like(nodes)
    field[elements[7, 0]] = -share * height * normal
    body.displacement = field
    with pytest.raises(ElementInverted) as raised:
        run.advance(run.step)
    assert raised.value.element in (6, 7)
    assert f"element {raised.value.element} of cube" in str(raised.value)


# --- parts, loose nodes, left hands -----------------------------------------------------------


def fall(nodes: Floats, elements: Integers, step: float, steps: int = 500) -> tuple[q.Body, Floats]:
    """A body that hangs at nodes below z = 0.3 in gravity: it, and its displacement [m], (n, 3)."""
    body = q.Body((nodes, elements), CONCRETE)
    run = q.Simulation([body], step=step, gravity=(0.0, 0.0, -9.81), threads=1)
    run.fix(body, nodes[:, 2] < 0.3)
    run.advance(steps * run.step)
    return body, body.displacement


def step_of(nodes: Floats, elements: Integers) -> float:
    """0.8 of a free body's critical step [s]."""
    run = q.Simulation([q.Body((nodes, elements), CONCRETE)], threads=1)
    return 0.8 * run.critical_step.value


@pytest.mark.filterwarnings("ignore::qdem_fem.files.SceneWarning")  # its parts are meant
def test_parts_apart_move_as_each_alone() -> None:
    """Not to the bit: in another order of elements the forces of a node are summed otherwise."""
    count, pair = 200, [make_delaunay(200, seed) for seed in (1, 2)]
    step = min(step_of(*part) for part in pair)
    alone = np.vstack([fall(*part, step)[1] for part in pair])
    apart = pair[1][0] + [5.0, 0.0, 0.0]
    _, joined = fall(
        np.vstack([pair[0][0], apart]), np.vstack([pair[0][1], pair[1][1] + count]), step
    )
    assert np.abs(joined - alone).max() < 1e-11 * np.abs(alone).max()


@pytest.mark.filterwarnings("ignore::qdem_fem.files.SceneWarning")  # its parts are meant
def test_nodes_of_no_element() -> None:
    """Between the others: listed, at rest, and felt by nobody to the bit."""
    nodes, elements = make_delaunay(200, 3)
    used = np.unique(elements)
    bare = np.searchsorted(used, elements)
    # a loose node after every tenth
    place = np.arange(len(used)) + np.arange(len(used)) // 10
    loose = np.setdiff1d(np.arange(place[-1] + 3), place)
    more = np.full((place[-1] + 3, 3), 7.0)
    more[place] = nodes[used]
    step = step_of(nodes[used], bare)
    _, expected = fall(nodes[used], bare, step)
    body, found = fall(more, place[bare], step)
    assert np.array_equal(body.mesh.unused, loose)
    assert not found[loose].any()
    assert np.array_equal(found[place], expected)
    assert step_of(more, place[bare]) == pytest.approx(step, rel=1e-6)


@pytest.mark.filterwarnings("ignore::qdem_fem.files.SceneWarning")  # its parts are meant
def test_left_handed_elements() -> None:
    """Half of the elements turned over by a swap of two nodes: mended and listed.

    The last two swapped: to the bit; the first two: forces are summed in another order.
    """
    nodes, elements = make_delaunay(200, 4)
    nodes, elements = nodes[np.unique(elements)], np.searchsorted(np.unique(elements), elements)
    left = np.random.default_rng(0).random(len(elements)) < 0.5
    turned, other = elements.copy(), elements.copy()
    turned[left] = turned[left][:, [0, 1, 3, 2]]
    other[left] = other[left][:, [1, 0, 2, 3]]
    step = step_of(nodes, elements)
    _, expected = fall(nodes, elements, step)
    body, found = fall(nodes, turned, step)
    assert np.array_equal(body.mesh.flipped, np.flatnonzero(left))
    assert np.array_equal(found, expected)
    _, swapped = fall(nodes, other, step)
    assert np.abs(swapped - expected).max() < 1e-11 * np.abs(expected).max()


@pytest.mark.parametrize("shared", [1, 2])
@pytest.mark.filterwarnings("ignore::qdem_fem.files.SceneWarning")  # its parts are meant
def test_hinges(shared: int) -> None:
    """Two elements that share a node or an edge only: a mesh like any other, free in flight."""
    one = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    # turned by half a turn about the x axis, and for a single node pushed beyond it
    other = one[shared:] * [1 if shared == 2 else -1, -1, -1]
    nodes = np.vstack([one, other])
    second = [*range(shared), *range(4, 8 - shared)]
    body = q.Body((nodes, [[0, 1, 2, 3], second]), q.Material(1e6, 0.3, 1000.0))
    run = q.Simulation([body], threads=1)
    velocity = np.tile([1.0, 2.0, 3.0], (len(nodes), 1))
    body.velocity = velocity
    run.advance(500 * run.step)
    np.testing.assert_allclose(body.displacement, velocity * run.time, rtol=1e-12)
