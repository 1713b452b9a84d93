"""Contact of surfaces: forces are the gradient of a potential; balance; faces, edges, vertices."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import qdem_fem as q
from qdem_fem.contact.surface.options import find_sharp_edges, place_points
from qdem_fem.contact.window import advance_contact
from qdem_fem.files import Floats
from qdem_fem.files.errors import ConditionError, ContactTooDeep
from qdem_fem.mesh.generation import make_box_mesh
from tests.qdem_restored import go_on
from tests.qdem_slopes import slope_gain

pytestmark = [
    pytest.mark.long,  # the loop of surfaces compiles for a minute
    pytest.mark.filterwarnings("ignore::qdem_fem.files.SceneWarning"),  # of overlaps that are meant
]
STONE = q.Material(30e9, 0.2, 2700.0)
SIDE = 0.03
MODULUS = 1e12
TETRAHEDRON = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])


def cube(cells: int = 1, place: Any = (0, 0, 0), turn: Any = None, name: str = "cube") -> q.Body:
    """A cube with its least corner at ``place``, turned about its middle."""
    mesh = make_box_mesh((SIDE,) * 3, (cells,) * 3, "five")
    arm = mesh.nodes - SIDE / 2
    if turn is not None:
        arm = turn.apply(arm)
    return q.Body((arm + SIDE / 2 + np.array(place), mesh.elements), STONE, name=name)


def touching(bodies: list[q.Body], friction: float = 0.0, **words: Any) -> q.Simulation:
    """A simulation of bodies that may be inside each other by 2 mm."""
    contact = q.SurfaceContact(MODULUS, friction, depth=2e-3, **words)
    return q.Simulation(bodies, threads=1, step=1e-7, contact=contact)


def forces_at(run: q.Simulation, displacement: Floats) -> tuple[Floats, float]:
    """Contact forces (c, 3) [N] and energy [J], what began to touch kept."""
    c, state = run.contacts, run.assembly.state
    flat = np.zeros((run.assembly.n_nodes, 4))
    flat[c.place, :3] = displacement
    advance_contact(c.kernel, None, flat.ravel(), np.zeros_like(np.asarray(state.velocity)), 0.0)
    return np.array(c.kernel.force), float(c.kernel.account[0])


def on_edges() -> list[q.Body]:
    """An edge of a cube across an edge of another, 20 um deep."""
    below = cube(turn=Rotation.from_euler("x", 45, degrees=True))
    above = cube(
        place=(0, 0, SIDE * np.sqrt(2) - 2e-5),
        turn=Rotation.from_euler("z", 9, degrees=True) * Rotation.from_euler("y", 45, degrees=True),
        name="above",
    )
    return [below, above]


def on_vertex() -> list[q.Body]:
    """A tetrahedron that stands on a vertex on a cube, 30 um deep."""
    upright = Rotation.align_vectors([[0, 0, -1.0]], TETRAHEDRON[:1] / np.sqrt(3))[0]
    nodes = 0.01 * upright.apply(TETRAHEDRON)
    nodes += np.array([0.013, 0.011, SIDE - 3e-5 - nodes[:, 2].min()])
    return [cube(2), q.Body((nodes, np.array([[0, 1, 2, 3]])), STONE, name="tetrahedron")]


def on_faces() -> list[q.Body]:
    """A cube on a cube, of other cells, moved, turned and tilted; 10 to 60 um deep."""
    turn = Rotation.from_rotvec([0.001, -0.0007, 0.3])
    return [cube(3), cube(2, (0.004, 0.005, SIDE - 3.5e-5), turn, "above")]


def on_edge_of_face() -> list[q.Body]:
    """A tilted cube that juts out over the edge of another one, 10 to 60 um deep."""
    turn = Rotation.from_rotvec([0.002, 0.001, 0.3])
    return [cube(2), cube(2, (0.013, 0.004, SIDE - 3.5e-5), turn, "above")]


CASES = {
    "edges": on_edges, "vertex": on_vertex, "faces": on_faces, "rim": on_edge_of_face,
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_forces_are_the_gradient_of_the_energy(case: str) -> None:
    """``f dx = -dW`` along random motions of all vertices, by central differences.

    W is quadratic in a depth of some 1e-5 m; over 1e-9 m the differences are exact to rounding of
    W, 1e-16 W/(f dx), and to the bend of normals, (1e-9/1e-5)^2.  No friction, so no history.
    """
    bodies = CASES[case]()
    wall = q.ContactPlane((0, 0, bodies[0].nodes[:, 2].min() + 2e-5), (0, 0.001, 1))
    run = touching(bodies, planes=[wall])
    run.contacts.refresh()
    random = np.random.default_rng(0)
    force, energy = forces_at(run, np.zeros((len(run.contacts.nodes), 3)))
    assert energy > 0
    for _ in range(12):
        way = 1e-9 * random.normal(size=force.shape)
        ahead, behind = (forces_at(run, sign * way)[1] for sign in (1, -1))
        work = float((force * way).sum())
        scale = np.linalg.norm(force) * np.linalg.norm(way)
        assert (behind - ahead) / 2 == pytest.approx(work, abs=2e-5 * scale)


@pytest.mark.parametrize("case", CASES)
def test_forces_are_balanced_in_force_and_moment(case: str) -> None:
    """To rounding; with friction the moment is that of the depth, which the springs lie apart."""
    run = touching(CASES[case](), friction=0.5)
    run.contacts.refresh()
    c = run.contacts
    size = np.abs(c.kernel.force).max()
    x = c.kernel.position
    assert np.abs(c.kernel.force.sum(axis=0)).max() < 1e-12 * size
    assert np.abs(np.cross(x, c.kernel.force).sum(axis=0)).max() < 1e-12 * size * SIDE
    body = run.bodies[1]
    body.velocity = np.tile([5.0, 3.0, 0.0], (len(body.nodes), 1))
    run.advance(4e-6)
    force = c.kernel.force
    assert np.abs(force.sum(axis=0)).max() < 1e-12 * np.abs(force).max()
    moment = np.abs(np.cross(c.kernel.position, force).sum(axis=0)).max()
    assert moment < np.abs(force).sum() * 1e-4  # depth of 1e-4 m at most
    assert np.abs(force[:, :2]).max() > 0.1 * np.abs(force).max()


def test_what_bears_in_each_case() -> None:
    """An edge across an edge bears by the pair, a vertex by itself, faces by points within them."""
    bearing = {}
    for case, made in list(CASES.items())[:3]:
        run = touching(made())
        run.contacts.refresh()
        near, surface = run.contacts.near, run.contacts.kernel.surface
        vertex = surface.point_face[near.point] < 0
        points = (surface.modulus[0] * near.weight)[near.weight > 0].sum()
        pointed = (surface.modulus[0] * near.weight)[(near.weight > 0) & vertex].sum()
        edges = (surface.modulus[0] * near.edge_weight)[near.edge_weight > 0].sum()
        bearing[case] = points - pointed, pointed, edges
    assert bearing["edges"][2] > 0
    assert bearing["edges"][:2] == (0, 0)
    assert bearing["vertex"][1] > 0
    assert bearing["vertex"][2] == 0
    assert bearing["faces"][0] > 0
    assert bearing["faces"][1] + bearing["faces"][2] < 1e-3 * bearing["faces"][0]


def test_faces_bear_the_pressure_of_their_depth() -> None:
    """A face within another: ``p g A``, whatever the two meshes; on a wall ``2 p g A``."""
    depth = 1e-5
    for below, above in ((1, 1), (2, 3)):
        inner = q.Body(
            make_box_mesh((0.6 * SIDE,) * 3, (above,) * 3, "five", (0.006, 0.005, SIDE - depth)),
            STONE,
        )
        run = touching([cube(below), inner])
        run.contacts.refresh()
        count = run.contacts.first_vertex[1]
        lifted = run.contacts.kernel.force[count:, 2].sum()
        own = MODULUS / 2 * depth * (0.6 * SIDE) ** 2
        # the smaller face bears its half exactly; of the larger one the points beneath it do
        assert own < lifted < 2.5 * own
    wall = q.ContactPlane((0, 0, depth), (0, 0, 1), 0.0)
    run = touching([cube(2)], planes=[wall])
    pressed = -2 * MODULUS * depth * SIDE**2
    assert run.contacts.plane_force(0)[2] == pytest.approx(pressed, rel=1e-9)


def test_edges_are_looked_at_before_they_touch() -> None:
    """Two cubes thrown on each other's edges: to the bit as if all pairs were looked at.

    Both come as fast, so that they near each other by twice the way of any vertex: the bound is
    sharp.  Some pairs are left out in every step, and some touch.
    """
    runs = []
    for every in (False, True):
        bodies = on_edges()
        moved = bodies[1].nodes + np.array([0.001, 0.002, 5e-5])
        bodies[1] = q.Body((moved, bodies[1].elements), STONE)
        run = touching(bodies, friction=0.3)
        for body, speed in zip(bodies, (1.0, -1.0), strict=True):
            body.velocity = np.tile([0.0, 0.0, speed], (len(moved), 1))
        left_out = touched = 0
        for _ in range(200):
            if every:
                run.contacts.near.edge_free[:] = -1.0
            run.advance(run.step)
            left_out += (run.contacts.near.edge_free > 0).sum()
            touched += (run.contacts.near.edge_weight > 0).sum()
        assert left_out > 0
        assert touched > 0
        runs.append(run)
    for field in ("displacement", "velocity"):
        assert np.array_equal(*(run.assembly.field(field) for run in runs))


def test_collision_keeps_momentum_moment_and_energy() -> None:
    """Cube on cube edge to edge at 0.2 m/s with friction; the bounds of rounding and of dt^2."""
    bodies = on_edges()
    moved = bodies[1].nodes + np.array([0.001, 0.002, 2.1e-5])
    bodies[1] = q.Body((moved, bodies[1].elements), STONE)
    run = touching(bodies, friction=0.3)
    bodies[1].velocity = np.tile([0.05, 0.0, -0.2], (len(bodies[1].nodes), 1))

    def state() -> tuple[Floats, Floats, float]:
        velocity = np.concatenate([body.velocity for body in run.bodies])
        place = np.concatenate([body.nodes + body.displacement for body in run.bodies])
        carried, e = run.assembly.mass[:, None] * velocity, run.energy()
        return (carried.sum(axis=0), np.cross(place, carried).sum(axis=0),
                e.kinetic + e.elastic + e.contact + e.friction)  # fmt: skip

    before = state()
    touched = 0.0
    for _ in range(60):
        run.advance(1e-5)
        touched = max(touched, run.energy().contact)
        assert state()[2] == pytest.approx(before[2], rel=1e-3)
    after = state()
    assert touched > 0.02 * before[2]
    assert run.energy().friction > 0
    assert run.energy().contact == 0
    assert np.abs(after[0] - before[0]).max() < 1e-12 * np.linalg.norm(before[0])
    # of p R, all that there is: the slider's force acts at one point of both bodies
    swing = float(np.linalg.norm(before[0]) * SIDE)
    assert np.abs(after[1] - before[1]).max() < 1e-12 * swing


@pytest.mark.parametrize(("turn", "cells"), [(None, 1), (None, 3), ((30, 50, 20), 2)])
def test_oblique_impact_with_friction_keeps_moment(turn: Any, cells: int) -> None:
    """Faces, edges and vertices of unequal meshes, mu = 1/2: moments to 1e-12 of p R."""
    rotation = None if turn is None else Rotation.from_euler("xyz", turn, degrees=True)
    below, above = cube(cells), cube(cells + 1, turn=rotation)
    gap = SIDE - float(above.nodes[:, 2].min()) + 1e-5
    above = q.Body((above.nodes + np.array([0.003, 0.002, gap]), above.elements), STONE)
    run = touching([below, above], friction=0.5)
    above.velocity = np.tile([0.5, 0.2, -1.0], (len(above.nodes), 1))
    moments = []
    for duration in (0.0, 3e-4):
        run.advance(duration)
        velocity = np.concatenate([body.velocity for body in run.bodies])
        place = np.concatenate([body.nodes + body.displacement for body in run.bodies])
        carried = run.assembly.mass[:, None] * velocity
        moments.append(np.cross(place, carried).sum(axis=0))
    swing = float(np.linalg.norm(carried.sum(axis=0)) * SIDE)
    assert run.energy().friction > 0
    assert np.linalg.norm(moments[1] - moments[0]) < 1e-12 * swing


@pytest.mark.parametrize("case", [3, 4])
def test_what_has_no_area_keeps_no_friction(case: int) -> None:
    """A block slides along a face that it just touches, turned so that rounding makes gaps of
    1e-18 m of both signs: nothing acts, no energy is lost and none is booked as friction."""
    rotation = Rotation.random(random_state=case)
    bodies = []
    for side, corner, cells in ((0.03, (0, 0, 0), 2), (0.02, (0.005, 0.004, 0.03), 1)):
        mesh = make_box_mesh((side,) * 3, (cells, cells, 2), "five")
        moved = rotation.apply(mesh.nodes + np.array(corner))
        bodies.append(q.Body((moved, mesh.elements), STONE, name=f"{side:g} m"))
    run = touching(bodies, friction=0.5)
    bodies[1].velocity = np.tile(rotation.apply([1.0, 0.3, 0.0]), (len(bodies[1].nodes), 1))
    before = run.energy().kinetic
    run.advance(0.02)
    after = run.energy()
    assert after.kinetic == pytest.approx(before, rel=1e-10)
    assert after.friction < 1e-10 * before


def test_an_overlap_at_the_start_is_named() -> None:
    """Half a millimetre: the energy of the springs is p A g^2 / 2 of the face, 1e12 x 9 cm^2."""
    bodies = [cube(2), cube(2, (0.0, 0.0, SIDE - 5e-4), name="above")]
    run = touching(bodies)
    with pytest.warns(q.SceneWarning, match=r"0.0005 m inside (cube|above).* hold 112 J"):
        held = run.energy().contact
    assert held == pytest.approx(MODULUS * SIDE**2 * 5e-4**2 / 2, rel=1e-9)


@pytest.mark.parametrize("share", [0.99, 1.01])
def test_block_on_a_slope(share: float) -> None:
    """``tan(alpha) = 1/2``, mu one per cent below: it slides as a rigid block; above: it rests."""
    gain, rigid, way = slope_gain(share, "surface")
    if share < 1:
        assert gain == pytest.approx(rigid, rel=0.1)
    else:
        assert abs(way) < 1e-7


def test_a_saved_run_goes_on_to_the_same_bits(tmp_path: Path) -> None:
    """Areas, springs and lists are in the checkpoint."""

    def made() -> q.Simulation:
        run = touching(on_faces(), friction=0.1)
        run.bodies[1].velocity = np.tile([0.5, 0.3, -0.1], (len(run.bodies[1].nodes), 1))
        return run

    whole, _ = go_on(made, tmp_path / "state.npz", 4e-6, 4e-6)
    assert whole.energy().friction > 0


@settings(max_examples=20)
@given(st.integers(1, 6), st.integers(0, 2**32 - 1))
def test_points_of_a_face_integrate_linear_functions(parts: int, seed: int) -> None:
    """Equal shares, inside, and their mean is the mean of the corners."""
    share = place_points(parts)
    corners = np.random.default_rng(seed).normal(size=3)
    assert share.shape == (parts**2, 3)
    assert share.min() > 0
    assert share.sum(axis=1) == pytest.approx(np.ones(parts**2), rel=1e-14)
    assert (share @ corners).mean() == pytest.approx(corners.mean(), abs=1e-14)


def test_sharp_edges_of_a_cube_are_twelve() -> None:
    """As many pieces each as it has cells; those of its flat faces are none."""
    body = cube(3)
    edges, opposite = find_sharp_edges(body.nodes, body.surface)
    assert len(edges) == 12 * 3
    ends = body.nodes[edges]
    on_rim = ((np.abs(ends) < 1e-12) | (np.abs(ends - SIDE) < 1e-12)).all(axis=1)
    assert (on_rim.sum(axis=1) >= 2).all()
    assert opposite.shape == edges.shape


def test_wrong_options_and_depths_are_named() -> None:
    """Before anything is computed, and at the start."""
    with pytest.raises(ConditionError, match="modulus"):
        q.SurfaceContact(0.0, 0.5)
    with pytest.raises(ConditionError, match="points"):
        q.SurfaceContact(1e12, 0.5, points=0)
    with pytest.raises(ContactTooDeep, match="inside another body"):
        touching([cube(2), cube(2, (0.001, 0.001, SIDE - 3e-3), name="above")]).advance(1e-7)
