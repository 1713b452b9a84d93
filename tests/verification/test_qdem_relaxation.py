"""Dynamic relaxation against direct solutions, closed forms of large strain, and hard cases."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import qdem_fem as q
from qdem_fem.files.errors import ConditionError, ElementInverted, NotConverged
from qdem_fem.mesh.generation import make_box_mesh
from validation.bench.qdem import judge as qdem_judge

LOAD = np.array([0.0, 0.0, -200.0])
SIZE = (2.4, 0.25, 0.22)


def cantilever(cells: tuple[int, int, int], **options: Any) -> tuple[q.Simulation, q.Body, Any]:
    """The paper's beam (section 3.1), its simulation and the mask of its loaded face."""
    mesh = make_box_mesh(SIZE, cells)
    body = q.Body(mesh, q.Material(45e9, 0.167, 2350.0), name="beam")
    run = q.Simulation([body], threads=1, **options)
    run.fix(body, body.nodes[:, 0] == 0)
    end = np.isclose(body.nodes[:, 0], SIZE[0])
    run.load(body, end, LOAD)
    return run, body, end


def judged(body: q.Body, force: np.ndarray) -> tuple[np.ndarray, Any]:
    """scikit-fem's answer (n, 3) for the clamped beam under nodal forces, and its stiffness."""
    matrix = qdem_judge.build_stiffness(body.nodes, body.elements, 45e9, 0.167)
    free = body.nodes[:, 0] > 0
    return qdem_judge.solve_static(matrix, free, force, method="direct").displacement, matrix


@pytest.mark.long
@pytest.mark.parametrize(
    ("cells", "steps"), [((24, 4, 3), 500), ((48, 6, 4), 800), ((7, 2, 5), 500)]
)
def test_cantilever_is_the_direct_solution(cells: tuple[int, int, int], steps: int) -> None:
    """Small strain is linear: the answer is scikit-fem's, and the bound on the error is one.

    Kinetic damping needs 3,450 and 5,880 steps for a tip right to 1e-5 on the first two meshes.
    """
    run, body, end = cantilever(cells, strain="small")
    force = np.zeros_like(body.nodes)
    force[end] = LOAD / end.sum()
    direct, matrix = judged(body, force)
    tip = np.argmax(abs(direct).max(axis=1))
    for tolerance in (1e-2, 1e-4, 1e-8):
        body.displacement = np.zeros_like(body.nodes)
        answer = run.relax(tolerance)
        wrong = (body.displacement - direct).ravel()
        error = np.sqrt(wrong @ (matrix @ wrong) / (direct.ravel() @ (matrix @ direct.ravel())))
        assert answer.residual <= tolerance
        assert error <= answer.solver_bound
        residual = (force.ravel() - matrix @ body.displacement.ravel()).reshape(-1, 3)
        measured = np.linalg.norm(residual[body.nodes[:, 0] > 0])
        reactions = np.linalg.norm(residual[body.nodes[:, 0] == 0])
        scale = max(np.linalg.norm(force), reactions)
        assert measured / scale == pytest.approx(answer.residual, rel=1e-3)
    assert answer.solver_bound < 1e-5
    assert answer.steps < steps
    assert abs(body.displacement - direct)[tip].max() < 1e-9 * abs(direct).max()


def test_paper_strain_differs_by_its_nonlinearity_only() -> None:
    """Strains are 1e-6 and rotations 6e-5: the paper's answer is linear to about their size."""
    run, body, end = cantilever((24, 4, 3))
    force = np.zeros_like(body.nodes)
    force[end] = LOAD / end.sum()
    direct, _ = judged(body, force)
    answer = run.relax()
    assert abs(body.displacement - direct).max() < 5e-5 * abs(direct).max()
    assert answer.steps < 1500


def test_single_precision_relaxes_in_double() -> None:
    """The kernel's float32 has a residual of 1e-2 at best; the answer is the float64 one."""
    fields = []
    for precision in ("float64", "float32"):
        run, body, _ = cantilever((12, 3, 2), precision=precision)
        run.relax()
        fields.append(body.displacement)
    assert abs(fields[1] - fields[0]).max() <= 1e-7 * abs(fields[0]).max()


def bar(strain: Any, cells: tuple[int, int, int] = (4, 3, 2), poisson: float = 0.3) -> Any:
    """A soft bar along x, free to contract, held by symmetry planes."""
    body = q.Body(make_box_mesh((0.4, 0.1, 0.1), cells), q.Material(1e6, poisson, 1e3), name="bar")
    run = q.Simulation([body], strain=strain, threads=1)
    for c, name in enumerate("xyz"):
        run.fix(body, body.nodes[:, c] == 0, name)
    return run, body, np.isclose(body.nodes[:, 0], 0.4)


@pytest.mark.parametrize("stretch", [0.8, 1.3])
@pytest.mark.parametrize("strain", ["small", "svk", "finger"])
def test_large_uniaxial_stretch(strain: Any, stretch: float) -> None:
    """Force of a bar at a stretch s, homogeneous, so that any mesh is exact; F/A =

    small E (s - 1);  svk E s (s^2 - 1)/2;
    finger E e (1 - 2 nu e) with e = (s^2 - 1)/2: T_xx = E e on the section A (1 - 2 nu e).
    """
    run, body, end = bar(strain)
    e = (stretch**2 - 1) / 2
    nominal = {"small": stretch - 1, "svk": stretch * e, "finger": e * (1 - 2 * 0.3 * e)}[strain]
    area = 0.1 * 0.1
    faces = body.surface[end[body.surface].all(axis=1)]
    # a uniform traction loads the nodes of a linear mesh by a third of their faces
    edges = body.nodes[faces]
    third = np.linalg.norm(np.cross(edges[:, 1] - edges[:, 0], edges[:, 2] - edges[:, 0]), axis=1)
    share = np.bincount(faces.ravel(), np.repeat(third / 6, 3), len(body.nodes))
    for node in np.flatnonzero(end):
        run.load(body, node, (1e6 * nominal * share[node], 0, 0))
    assert share.sum() == pytest.approx(area)
    run.relax(1e-10)
    assert body.displacement[end, 0] == pytest.approx((stretch - 1) * 0.4, rel=1e-8)


def test_prescribed_displacement_gravity_roller_and_series() -> None:
    """A column under gravity and a given top, at the time reached; closed form rho g (2Hz - z^2)/2.

    Uniaxial strain, small: M u'' = rho g with M = E (1 - nu)/((1 + nu)(1 - 2 nu)), u(0) = 0,
    u(H) = given; nodal values are exact, since equal layers carry the load at their nodes.
    Two rollers at every node, not at right angles, leave it the z direction alone.
    """
    height, young, poisson, density = 0.5, 2e7, 0.3, 1800.0
    body = q.Body(make_box_mesh((0.1, 0.1, height), (2, 2, 8)), q.Material(young, poisson, density))
    modulus = young * (1 - poisson) / (1 + poisson) / (1 - 2 * poisson)
    run = q.Simulation([body], strain="small", threads=1, gravity=(0, 0, -9.81))
    z = body.nodes[:, 2]
    run.fix(body, z == 0)
    for normal in ((1, 0, 0), (1, 1, 0)):
        run.roller(body, np.ones(len(z), dtype=bool), normal)
    run.prescribe(body, z == height, "z", lambda t: 1e-5 * min(t, 1e-3) / 1e-3)
    run.advance(1e-3)
    when = run.time
    answer = run.relax(1e-11)
    assert run.time == when
    weight = density * 9.81 / modulus
    exact = 1e-5 * z / height - 0.5 * weight * z * (height - z)
    assert answer.residual <= 1e-11
    assert body.displacement[:, 2] == pytest.approx(exact, abs=1e-9 * abs(exact).max())
    assert abs(body.displacement[:, :2]).max() < 1e-12


def test_oblique_roller_is_the_fixed_component_turned() -> None:
    """Supports turned with the body by 30 degrees: the answer turns with them."""
    fields = []
    turn = np.array([[0.75**0.5, -0.5, 0], [0.5, 0.75**0.5, 0], [0, 0, 1.0]])
    for rotation in (np.eye(3), turn):
        mesh = make_box_mesh((1.0, 0.2, 0.2), (5, 2, 2))
        nodes = mesh.nodes @ rotation.T
        body = q.Body((nodes, mesh.elements), q.Material(1e7, 0.3, 1000.0))
        run = q.Simulation([body], threads=1, strain="svk")
        run.fix(body, mesh.nodes[:, 0] == 0)
        run.roller(body, mesh.nodes[:, 0] == 1.0, rotation @ [0, 1, 0])
        run.load(body, mesh.nodes[:, 0] == 1.0, rotation @ [0.0, 50.0, -80.0])
        run.relax(1e-11)
        fields.append(body.displacement @ rotation)
    assert abs(fields[0] - fields[1]).max() < 1e-8 * abs(fields[0]).max()


def test_large_bending_is_where_a_damped_march_comes_to_rest() -> None:
    """A soft cantilever bent by half its length: the explicit run from the answer stays there."""
    body = q.Body(make_box_mesh((1, 0.1, 0.1), (20, 2, 2)), q.Material(1e8, 0.3, 1e3), name="rod")
    run = q.Simulation([body], strain="svk", threads=1)
    run.fix(body, body.nodes[:, 0] == 0)
    end = np.isclose(body.nodes[:, 0], 1)
    run.load(body, end, (0, 0, -4000.0))
    answer = run.relax(1e-9)
    bent = body.displacement
    assert bent[end, 2].mean() < -0.5
    assert answer.steps < 5000
    energy = run.energy()
    assert energy.kinetic == 0
    assert energy.elastic == pytest.approx(energy.external)
    history = run.advance(0.02, probes={"end": end})  # a fifth of the first period
    assert abs(history["end"] - bent[end].mean(axis=0)).max() < 1e-6
    assert run.energy().kinetic < 1e-10 * energy.elastic


def test_two_bodies_and_periodic_partners() -> None:
    """Each body finds its own answer; partners move as one."""
    bodies = [
        q.Body(make_box_mesh((0.5, 0.1, 0.1), (5, 2, 2)), q.Material(young, 0.2, 1000.0), name=name)
        for name, young in (("soft", 1e6), ("stiff", 1e9))
    ]
    run = q.Simulation(bodies, strain="small", threads=1)
    run.periodic(bodies[0], bodies[0].nodes[:, 0] == 0, bodies[0].nodes[:, 0] == 0.5)
    for body in bodies:
        run.fix(body, body.nodes[:, 2] == 0)
        run.pressure(body, np.isclose(body.nodes[:, 2], 0.1), 1e3)
    run.relax(1e-10)
    soft, stiff = (body.displacement for body in bodies)
    left, right = (bodies[0].nodes[:, 0] == x for x in (0, 0.5))
    assert np.array_equal(soft[left], soft[right])
    # with periodic ends every section is alike: no motion along x but what bending would need
    assert np.ptp(soft[np.isclose(bodies[0].nodes[:, 2], 0.1), 2]) < 0.2 * abs(soft[:, 2]).max()
    assert abs(stiff).max() == pytest.approx(abs(soft).max() / 1000, rel=0.2)


@pytest.mark.filterwarnings("ignore:.*a body of 500 m is above 100")
def test_unit_invariance() -> None:
    """Lengths in mm, forces in mN, E in kPa: the same motion in the new unit, in as many steps."""
    found = []
    for unit in (1.0, 1e3):
        mesh = make_box_mesh((0.5, 0.1, 0.1), (5, 2, 2))
        body = q.Body((mesh.nodes * unit, mesh.elements), q.Material(1e9 / unit, 0.3, 1000.0))
        run = q.Simulation([body], threads=1)
        run.fix(body, body.nodes[:, 0] == 0)
        run.load(body, np.isclose(body.nodes[:, 0], 0.5 * unit), (0, 30.0 * unit, 0))
        found.append((run.relax(1e-10).steps, body.displacement / unit))
    assert abs(found[0][0] - found[1][0]) <= 5
    assert abs(found[0][1] - found[1][1]).max() < 1e-8 * abs(found[0][1]).max()


def test_nothing_to_do_and_going_on() -> None:
    """No load: nothing moves.  Relaxed twice: the second time costs two evaluations."""
    run, body, _ = bar("finger")
    answer = run.relax()
    assert (answer.residual, answer.solver_bound) == (0.0, 0.0)
    assert not body.displacement.any()
    run.load(body, body.nodes[:, 0] == 0.4, (1.0, 0, 0))
    first = run.relax()
    again = run.relax()
    assert again.steps <= 2 < first.steps
    assert np.isnan(again.solver_bound)


@pytest.mark.parametrize(
    ("held", "free"),
    [([], 6), ([(0, "xyz")], 3), ([(0, "xyz"), (4, "yz")], 1), ([(slice(None), "xy")], 1)],
)
def test_free_body_is_named(held: list[tuple[Any, str]], free: int) -> None:
    """Each rigid motion that is left is counted; node 4 is on the x axis through node 0."""
    body = q.Body(
        make_box_mesh((0.4, 0.1, 0.1), (4, 3, 2)), q.Material(1e6, 0.3, 1000.0), name="grain"
    )
    run = q.Simulation([body], threads=1)
    for nodes, components in held:
        run.fix(body, np.arange(len(body.nodes))[nodes], components)
    with pytest.raises(ConditionError, match=f"grain has no static answer: {free} of the 6"):
        run.relax()


@pytest.mark.filterwarnings("ignore::qdem_fem.files.SceneWarning")  # its parts are meant
def test_loose_part_of_a_mesh_is_named() -> None:
    """A body in two parts, one of them held."""
    mesh = make_box_mesh((0.4, 0.1, 0.1), (2, 1, 1))
    count = len(mesh.nodes)
    nodes = np.concatenate([mesh.nodes, mesh.nodes + np.array([1.0, 0, 0])])
    elements = np.concatenate([mesh.elements, mesh.elements + count])
    run = q.Simulation([body := q.Body((nodes, elements), q.Material(1e6, 0.3, 1000.0))], threads=1)
    run.fix(body, nodes[:, 0] == 0)
    with pytest.raises(
        ConditionError, match=f"6 of the 6 rigid motions of the part with node {count}"
    ):
        run.relax()


def test_not_converged_keeps_the_state_and_can_go_on() -> None:
    """Stopped after 100 steps; what was reached is closer, and the next call goes on from it."""
    run, body, _ = cantilever((12, 3, 2), strain="small")
    with pytest.raises(NotConverged, match="the most allowed"):
        run.relax(max_steps=100)
    assert abs(body.displacement).max() > 0
    assert run.relax().residual <= 1e-8


def test_rounding_is_distinguished_from_slowness() -> None:
    """A tolerance that double precision can not reach ends soon, with the reason."""
    run, _, _ = cantilever((12, 3, 2), strain="small")
    with pytest.raises(NotConverged, match="where rounding keeps it") as caught:
        run.relax(1e-16)
    steps = int(str(caught.value).split(" after ")[1].split()[0])
    assert steps < 5000


def test_jump_that_inverts_elements_is_named() -> None:
    """The remedy of the message works: in parts it goes."""
    run, body, end = bar("svk")
    held = run.prescribe(body, end, "x", -0.15)
    with pytest.raises(ElementInverted, match="in parts"):
        run.relax()
    for part in np.linspace(0, -0.1, 6)[1:]:
        run.remove(held)
        held = run.prescribe(body, end, "x", part)
        run.relax()
    assert body.displacement[end, 0] == pytest.approx(-0.1)


def test_bad_tolerance() -> None:
    """Zero can not be reached."""
    run, _, _ = bar("small")
    with pytest.raises(ConditionError, match="tolerance"):
        run.relax(0.0)
