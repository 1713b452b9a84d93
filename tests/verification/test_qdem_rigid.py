"""Rigid bodies: six freedoms against closed forms, conservation, a peer, and deformable bodies."""

from __future__ import annotations

import json
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import eigh
from scipy.spatial.transform import Rotation
from scipy.special import ellipj

import qdem_fem as q
from qdem_fem.bodies.rigid_mass import compute_rigid_mass, make_cross_matrix
from qdem_fem.contact.bounds import bound_spring_network
from qdem_fem.files import Floats
from qdem_fem.files.errors import (
    CheckpointError,
    ConditionError,
    ContactTooDeep,
    SceneError,
    Unstable,
)
from qdem_fem.mesh.generation import make_box_mesh
from qdem_fem.scene.build import make_simulation
from qdem_fem.scene.checks import load_scene
from tests.qdem_restored import go_on
from tests.qdem_slopes import slope_gain
from trackbed import command

STONE = q.Material(30e9, 0.2, 2700.0)
SIDE, RADIUS = 0.03, 0.006
BRICK = (0.02, 0.03, 0.05)
FAR = q.SphereContact(RADIUS, 1.0, 0.0, skin=1.0)
"""Of bodies that meet nothing: the same compiled loop serves all tests."""


def brick(
    name: str = "brick", size: Any = BRICK, origin: Any = (0, 0, 0), rigid: Any = True
) -> q.Body:
    """A block of stone of 2 x 2 x 2 cells."""
    return q.Body(
        make_box_mesh(size, (2, 2, 2), "kuhn", tuple(origin)), STONE, name=name, rigid=rigid
    )


def spun(body: q.Body, omega: Any, velocity: Any = (0, 0, 0)) -> q.Body:
    """The body, set in motion."""
    body.velocity = np.cross(omega, body.nodes - body.rigid_mass.centre) + velocity
    return body


def momenta(run: q.Simulation) -> tuple[Floats, Floats]:
    """Momentum [kg m/s] and angular momentum about the origin [kg m^2/s] of all bodies."""
    linear, angular = np.zeros((2, 3))
    for body in run.bodies:
        if body.rigid:
            continue
        start = run._offset(body)
        mass = run.assembly.mass[start : start + len(body.nodes), None]
        linear += (mass * body.velocity).sum(axis=0)
        angular += np.cross(body.nodes + body.displacement, mass * body.velocity).sum(axis=0)
    rigid = run.rigid
    assert rigid is not None
    now, centre = (
        rigid.find_motion(run.find_acting()),
        np.array([own.centre for own in rigid.own]) + rigid.kernel.shift,
    )
    carried = rigid.mass[:, None] * now.velocity
    return linear + carried.sum(axis=0), angular + (np.cross(centre, carried) + now.spin).sum(
        axis=0
    )


def total(run: q.Simulation) -> float:
    """Energy less the work done from outside [J]."""
    e = run.energy()
    return e.kinetic + e.elastic + e.contact + e.friction - e.external


# --- mass ----------------------------------------------------------------------------------------


def test_mass_centre_and_inertia_are_those_of_the_solid() -> None:
    """A brick's are known, whatever its mesh, wherever it lies and however it is turned."""
    turn = Rotation.from_rotvec([0.3, -1.1, 0.7])
    for cells in ((1, 1, 1), (3, 2, 4)):
        mesh = make_box_mesh(BRICK, cells)
        nodes = np.array([5.0, -3, 2]) + turn.apply(mesh.nodes)
        body = q.Body((nodes, mesh.elements), STONE, rigid=True)
        own, mass = body.rigid_mass, 2700 * np.prod(BRICK)
        x, y, z = np.array(BRICK) ** 2
        assert own.mass == pytest.approx(mass, rel=1e-12)
        centre = np.array([5.0, -3, 2]) + turn.apply(np.array(BRICK) / 2)
        np.testing.assert_allclose(own.centre, centre, rtol=1e-13)
        exact = mass / 12 * np.diag([y + z, x + z, x + y])
        exact = turn.as_matrix() @ exact @ turn.as_matrix().T
        np.testing.assert_allclose(own.tensor, exact, atol=1e-11 * mass * z)
        np.testing.assert_allclose(own.axes @ own.axes.T, np.eye(3), atol=1e-14)
        assert np.linalg.det(own.axes) == pytest.approx(1.0)


def test_lumped_inertia_is_that_of_the_deformable_mesh() -> None:
    """It exceeds the solid's by a share of the square of the mesh size."""
    excess = []
    for cells in (2, 4):
        body = brick(rigid="lumped")
        body = q.Body(make_box_mesh(BRICK, (cells,) * 3), STONE, rigid="lumped")
        soft = q.Body(body.mesh, STONE)
        mass, own = q.Simulation([soft]).assembly.mass, body.rigid_mass
        arm = make_cross_matrix(body.nodes - own.centre)
        tensor = np.einsum("n,nki,nkj->ij", mass, arm, arm)
        np.testing.assert_allclose(own.tensor, tensor, atol=1e-13 * tensor.max())
        weight = np.asarray(body.material.density) * body.gradients[1]
        solid = compute_rigid_mass(body.nodes, body.elements, weight)
        excess.append(own.inertia / solid.inertia - 1)
    np.testing.assert_allclose(np.log2(excess[0] / excess[1]), 2.0, atol=0.2)


# --- free motion ---------------------------------------------------------------------------------


def top(step: float, omega: Any, duration: float) -> tuple[q.Simulation, q.Body, Floats]:
    """A brick that spun freely, and the angular momentum it began with."""
    body = spun(brick(), omega)
    run = q.Simulation([body], step=step, contact=FAR, threads=1)
    assert run.rigid is not None
    started = run.rigid.kernel.spin[0].copy()
    run.advance(duration)
    return run, body, started


def turned_by(body: q.Body) -> Floats:
    """The rotation of a body, (3, 3), from its nodes."""
    arm = body.nodes - body.nodes.mean(axis=0)
    moved = body.nodes + body.displacement
    return np.linalg.lstsq(arm, moved - moved.mean(axis=0), rcond=None)[0].T


@pytest.mark.long
def test_torque_free_top_against_the_closed_form() -> None:
    """Euler's asymmetric top in Jacobi's functions; the turn itself against an ODE solver.

    Axes of BRICK by moment: z, y, x.  With ``L^2 > 2 E I_2`` (Landau and Lifshitz, section 37).
    Errors of second order: halving the step divides them by four; L to the bit.
    """
    first, second, third = moments = brick().rigid_mass.inertia
    omega = np.array([60.0, 0.0, 25.0])  # about x (moment 3) and z (moment 1)
    twice = third * omega[0] ** 2 + first * omega[2] ** 2
    square = (third * omega[0]) ** 2 + (first * omega[2]) ** 2
    assert square > twice * second
    duration = 0.2
    rate = np.sqrt((third - second) * (square - twice * first) / moments.prod())
    below = (third - second) * (square - twice * first)
    sn, cn, dn, _ = ellipj(rate * duration, (second - first) * (twice * third - square) / below)
    aside = np.sqrt((twice * third - square) / (second * (third - second)))
    # x, y, z is a left-handed order of moments 3, 2, 1: y runs the other way round
    exact = np.array([omega[0] * dn, -aside * sn, omega[2] * cn])

    tensor = np.diag([third, second, first])
    spin = tensor @ omega

    def rates(_: float, turn: Floats) -> Floats:
        turn = turn.reshape(3, 3)
        own = np.linalg.solve(tensor, turn.T @ spin)
        return np.asarray(turn @ make_cross_matrix(own)).ravel()

    peer = solve_ivp(rates, (0, duration), np.eye(3).ravel(), "DOP853", rtol=1e-12, atol=1e-12)
    errors = []
    for step in (2e-4, 1e-4):
        run, body, started = top(step, omega, duration)
        turn = turned_by(body)
        own = np.linalg.solve(tensor, turn.T @ spin)
        errors.append([abs(own - exact).max(), abs(turn - peer.y[:, -1].reshape(3, 3)).max()])
        assert run.rigid is not None
        assert (run.rigid.kernel.spin[0] == started).all()
        np.testing.assert_allclose(started, spin, rtol=1e-12, atol=1e-15)
        length = np.linalg.norm(body.nodes + body.displacement - np.array(BRICK) / 2, axis=1)
        np.testing.assert_allclose(
            length, np.linalg.norm(body.nodes - np.array(BRICK) / 2, axis=1), atol=1e-15
        )
    assert errors[1][0] < 1e-3 * 60
    assert errors[1][1] < 1e-3
    np.testing.assert_allclose(np.log2(np.divide(*errors)), 2.0, atol=0.1)


def test_energy_of_a_tumbling_top_does_not_drift() -> None:
    """About its middle axis it turns over again and again: energies stay in a band, reversibly."""
    body = spun(brick(), [0.01, 100.0, 0.0])
    run = q.Simulation([body], step=2e-4, contact=FAR, threads=1)
    energies = []
    for _ in range(40):
        run.advance(0.05)
        energies.append(run.energy().kinetic)
    early, late = np.array(energies).reshape(2, 20)
    band = np.ptp(early)
    assert band < 1e-3 * early.mean()
    assert abs(late.mean() - early.mean()) < band
    body.velocity = -body.velocity  # and back
    run.advance(2.0)
    assert abs(body.displacement).max() < 1e-6 * SIDE


def test_free_flight_under_a_force_and_a_turning_one() -> None:
    """A constant force: the parabola, exactly.  A couple on the axis: a quarter of it, exactly."""
    body = spun(brick(), [0, 0, 0], [1.0, -2, 3])
    run = q.Simulation([body], step=1e-4, contact=FAR, threads=1)
    mass, moment = body.rigid_mass.mass, body.rigid_mass.inertia[0]  # about z
    run.load(body, body.nodes[:, 0] > -1, [0.0, 0.0, -9.81 * mass])
    run.advance(0.05)
    assert run.steps_done == 500
    way = np.array([1.0, -2, 3]) * 0.05 - [0, 0, 9.81 * 0.05**2 / 2]
    np.testing.assert_allclose(body.displacement, np.tile(way, (27, 1)), atol=1e-13)
    np.testing.assert_allclose(body.velocity[0], [1, -2, 3 - 9.81 * 0.05], rtol=1e-12)
    assert total(run) == pytest.approx(mass * 14 / 2, rel=1e-12)

    body = brick()
    run = q.Simulation([body], step=1e-4, contact=FAR, threads=1)
    for side, push in ((0.0, -1.0), (BRICK[1], 1.0)):  # two forces along x, a couple about z
        edge = np.isclose(body.nodes[:, 1], side) & np.isclose(body.nodes[:, 0], BRICK[0] / 2)
        run.load(body, edge, [push * 1e-2, 0.0, 0.0])
    run.advance(1e-3)
    angle = -1e-2 * BRICK[1] / moment * 1e-3**2 / 2
    assert turned_by(body)[1, 0] == pytest.approx(np.sin(angle), rel=1e-6)
    assert run.energy().kinetic == pytest.approx(run.energy().external, rel=1e-9)


def test_without_contact_and_under_gravity() -> None:
    """The loop without contact and with gravity does the same, and a far body changes no bit."""
    fields = []
    for others in ([], [spun(brick("far", origin=(1, 0, 0)), [9.0, 5, 1])]):
        soft = q.Body(make_box_mesh(BRICK, (2, 2, 2)), STONE, name="soft")
        run = q.Simulation([soft, *others], step=1e-6, gravity=[0, 0, -9.81], threads=1)
        run.fix(soft, soft.nodes[:, 2] == 0)
        run.advance(1e-3, {str(i): (body, [i]) for i, body in enumerate(run.bodies)})
        fields.append(soft.displacement)
    np.testing.assert_allclose(fields[1], fields[0], atol=1e-12 * abs(fields[0]).max())
    np.testing.assert_allclose(run.rigid.kernel.shift[0], [0, 0, -9.81 * 1e-3**2 / 2], atol=1e-16)  # type: ignore[union-attr]
    # energy of the falling one: its fall is work of gravity
    assert total(run) == pytest.approx(
        spun(brick(), [9.0, 5, 1]).rigid_mass.inertia @ (np.array([1.0, 5, 9]) ** 2) / 2, rel=1e-9
    )


# --- contact -------------------------------------------------------------------------------------


def test_sliding_block_at_the_angle_of_friction() -> None:
    """Rigid on a slope: a per cent below tan(alpha) it slides as Coulomb says, above it rests."""
    gain, rigid, _ = slope_gain(0.99, rigid=True)
    assert gain == pytest.approx(rigid, rel=0.02)
    assert abs(slope_gain(1.01, rigid=True)[2]) < 1e-9
    gain, _, _ = slope_gain(1.0, rigid=True)
    assert abs(gain) < 1e-3 * rigid


def collide(
    rigid: Sequence[Any], step: float | None = None, contact: Any = None, velocity: Any = (1, 0, 0)
) -> q.Simulation:
    """A cube thrown at another, face to face but for a gap of 1 um of the spheres."""
    contact = contact or q.SphereContact(RADIUS, 1e8, 0.0)
    gap = (2 * RADIUS if isinstance(contact, q.SphereContact) else 0.0) + 1e-6
    one = brick("one", (SIDE,) * 3, rigid=rigid[0])
    other = brick("other", (SIDE,) * 3, (SIDE + gap, 0, 0), rigid=rigid[1])
    one.velocity = np.tile(np.asarray(velocity, float), (27, 1))
    return q.Simulation([one, other], step=step, contact=contact, threads=1)


def test_head_on_collision_of_two_rigid_cubes() -> None:
    """Nine springs between two masses: velocities change places in half a period of them."""
    run = collide((True, True), step=1e-7)
    mass, stiffness = run.bodies[0].rigid_mass.mass, 9e8
    period = 2 * np.pi / np.sqrt(2 * stiffness / mass)
    run.advance(1e-6 + period / 4)
    deepest = run.contacts.touching().overlap  # type: ignore[union-attr]
    assert deepest == pytest.approx(np.sqrt(mass / 2 / stiffness), rel=1e-4)
    run.advance(period / 4)
    velocity = [body.velocity.mean(axis=0)[0] for body in run.bodies]
    np.testing.assert_allclose(velocity, [0, 1], atol=1e-4)
    # it lets go within a step: an error of the order of (omega dt)^2
    assert total(run) == pytest.approx(mass / 2, rel=(2 * np.pi / period * 1e-7) ** 2)


@pytest.mark.parametrize("model", ["spheres", pytest.param("surface", marks=pytest.mark.long)])
def test_collision_of_a_rigid_and_a_deformable_body(model: str) -> None:
    """Aslant: momentum, angular momentum and energy of both together are what they were."""
    contact = None if model == "spheres" else q.SurfaceContact(1e12, 0.0)
    run = collide((True, False), contact=contact, velocity=(1.0, 0.3, -0.2))
    run.bodies[0].velocity = run.bodies[0].velocity + np.cross(
        [0.0, 30, 20], run.bodies[0].nodes - SIDE / 2
    )
    (linear, angular), energy = momenta(run), total(run)
    run.advance(3e-4)
    after = momenta(run)
    mass = run.bodies[0].rigid_mass.mass
    assert abs(run.bodies[1].velocity.mean(axis=0)[0]) > 0.3
    np.testing.assert_allclose(after[0], linear, atol=1e-12 * mass)
    np.testing.assert_allclose(after[1], angular, atol=1e-12 * mass * SIDE)
    assert total(run) == pytest.approx(energy, rel=2e-2)


def bounce(kind: float | str, cells: int = 2, samples: int = 100) -> Floats:
    """Motion of a tilted brick that is thrown at a wall, spinning, (samples, 6) [m].

    ``kind``: Young's modulus [Pa] of a deformable brick, or ``"solid"`` or ``"lumped"`` of a rigid
    one.  The mean displacement, and the vector of rotation (best fit of all nodes) times 0.05 m.
    """
    mesh = make_box_mesh(BRICK, (cells,) * 3)
    nodes = Rotation.from_euler("xyz", [0.5, 0.3, 0.2]).apply(mesh.nodes)
    nodes[:, 2] += 0.006 + 1e-6 - nodes[:, 2].min()
    young = 30e9 if isinstance(kind, str) else float(kind)
    rigid: Any = False if not isinstance(kind, str) else (kind == "solid" or "lumped")
    body = q.Body((nodes, mesh.elements), q.Material(young, 0.2, 2700.0), rigid=rigid)
    spin = np.cross([20.0, 10.0, 30.0], nodes - body.rigid_mass.centre)
    body.velocity = np.array([0.3, 0.0, -1.0]) + spin
    wall = q.ContactPlane((0, 0, 0), (0, 0, 1))
    contact = q.SphereContact(0.006, 1e6, 0.3, planes=[wall])
    fastest = 2e-7 if rigid else None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", q.StepWarning)
        run = q.Simulation([body], contact=contact, threads=1, step=fastest)
        rows: list[Floats] = []
        for _ in range(samples):
            run.advance((len(rows) + 1) * 1.5e-3 / samples - run.time)
            rows.append(np.append(body.displacement.mean(axis=0), 0.05 * turn_of(body)))
    return np.array(rows)


def turn_of(body: q.Body) -> Floats:
    """Vector of the rotation that fits the nodes best [rad], (3,)."""
    arm, moved = body.nodes, body.nodes + body.displacement
    fit, _ = Rotation.align_vectors(moved - moved.mean(axis=0), arm - arm.mean(axis=0))
    return np.asarray(fit.as_rotvec())


def test_a_stiff_deformable_body_tends_to_the_rigid_one() -> None:
    """Bounced off a wall: the error falls as 1/E, and only with the inertia of its own mesh."""
    limit = bounce("lumped")
    errors = [np.linalg.norm(bounce(young) - limit) for young in (3e9, 12e9)]
    assert errors[1] < 0.02 * np.linalg.norm(limit)
    assert 0.8 < np.log2(errors[0] / errors[1]) / 2 < 1.4
    assert np.linalg.norm(bounce("solid") - limit) > 5 * errors[1]


# --- the step ------------------------------------------------------------------------------------


def test_bound_on_frequencies_holds_with_rigid_bodies() -> None:
    """Random springs between rigid bodies, nodes and walls: no eigenvalue is above it."""
    random = np.random.default_rng(3)
    for _ in range(5):
        bodies = [brick(str(i), random.uniform(0.01, 0.05, 3)) for i in range(3)]
        soft = brick("soft", rigid=False)
        run = q.Simulation([*bodies, soft], step=1e-6, contact=FAR, threads=1)
        contacts, rigid = run.contacts, run.rigid
        assert contacts is not None
        assert rigid is not None
        count = len(contacts.nodes)
        ends = random.integers(0, count, (40, 2))
        stiffness, wall = random.uniform(1, 9, 40), np.zeros(count)
        wall[random.integers(0, count, 10)] = random.uniform(1, 9, 10)
        inertia = np.zeros((18 + 3 * count, 18 + 3 * count))
        place = np.zeros((count, 3, len(inertia)))
        for i, node in enumerate(contacts.nodes):
            row = rigid.of_place[run.assembly.place[node]]
            if row < 0:
                at = slice(18 + 3 * i, 21 + 3 * i)
                place[i, :, at] = np.eye(3)
                continue
            at = slice(6 * rigid.body[row], 6 * rigid.body[row] + 6)
            place[i, :, at] = np.hstack([np.eye(3), -make_cross_matrix(rigid.arm[row])])
        for b, own in enumerate(rigid.own):
            at = slice(6 * b, 6 * b + 6)
            inertia[at, at] = np.diag([own.mass] * 3 + [0] * 3)
            inertia[6 * b + 3 : 6 * b + 6, 6 * b + 3 : 6 * b + 6] = own.tensor
        free = np.arange(18, len(inertia))
        inverse = np.repeat(contacts.inverse_mass, 3)
        inertia[free, free] = np.where(inverse > 0, 1 / np.where(inverse > 0, inverse, 1), 1.0)
        matrix = np.zeros_like(inertia)
        for (i, j), k in zip(ends, stiffness, strict=True):
            apart = place[i] - place[j]
            matrix += k * apart.T @ apart
        matrix += np.einsum("c,cki,ckj->ij", wall, place, place)
        highest = eigh(matrix, inertia, eigvals_only=True)[-1]
        bound = bound_spring_network(
            ends, stiffness, wall, contacts.inverse_mass, contacts.bound_rigid
        )
        assert highest <= bound * (1 + 1e-9)
        assert bound < 4 * highest  # and is of use


def test_critical_step_of_a_rigid_body_on_a_wall() -> None:
    """It follows from the six frequencies of the body on its springs: beyond them it shakes."""
    wall, deep = q.ContactPlane((0, 0, 0), (0, 0, 1)), 1e-4
    own = brick("block", (SIDE,) * 3).rigid_mass
    omega = np.sqrt(9 * 2e6 / own.mass)  # nine spheres on the wall; it rocks as fast: 6 a^2 k/I
    assert np.sqrt(6 * (SIDE / 2) ** 2 * 2e6 / own.inertia[0]) == pytest.approx(omega)

    def shaken(share: float) -> q.Simulation:
        contact = q.SphereContact(RADIUS, 1e6, 0.0, planes=[wall], skin=1.0)
        body = spun(brick("block", (SIDE,) * 3, (0, 0, RADIUS - deep)), [0, 0, 0], [0, 0, 1e-7])
        run = q.Simulation([body], step=share * 2 / omega, contact=contact, threads=1)
        run.load(body, body.nodes[:, 2] > -1, [0.0, 0, -9 * 2e6 * deep])
        assert run.contacts is not None
        run.contacts.refresh()
        assert omega**2 < run.contacts.bound_present_stiffness() < 4 * omega**2  # in all directions
        assert run.critical_step.value < 2 / omega  # which allows for every vertex at once
        run.advance(400 * run.step)
        return run

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", q.StepWarning)
        assert abs(shaken(0.99).bodies[0].displacement).max() < 1e-9
        with pytest.raises((Unstable, ContactTooDeep)):
            shaken(1.01)


# --- conditions, state, files --------------------------------------------------------------------


def test_held_and_driven_freedoms() -> None:
    """Fixed, sliding, turning about one axis, driven: what is held stays, the work is counted."""
    body = spun(brick(), [1.0, 2, 3], [1.0, 1, 1])
    run = q.Simulation([body], step=1e-4, contact=FAR, threads=1)
    low = body.nodes[:, 2] == 0
    started = total(run)
    held = run.fix(body, low, "z")
    run.advance(0.01)
    assert abs(body.displacement[:, 2]).max() < 1e-15
    spin = body.rigid_mass.inertia[0] * 3
    assert run.rigid is not None
    np.testing.assert_allclose(
        run.rigid.find_motion(run.find_acting()).spin, [[0, 0, spin]], rtol=1e-12, atol=1e-18
    )
    assert total(run) == pytest.approx(started, rel=1e-9)
    run.remove(held)
    run.fix(body, low)
    with pytest.raises(ConditionError, match="turned already"):
        run.advance(0.01)

    body = spun(brick(), [1.0, 2, 3], [1.0, 1, 1])
    run = q.Simulation([body], step=1e-4, contact=FAR, threads=1)
    started = total(run)
    run.fix(body, low)
    run.load(body, 0, [1.0, 2, 3])
    run.advance(0.01)
    assert not body.displacement.any()
    assert not body.velocity.any()
    assert run.energy().kinetic == 0.0
    assert run.energy().external == pytest.approx(-started, rel=1e-12)

    body = spun(brick(), [1.0, 2, 3], [1.0, 1, 1])
    run = q.Simulation([body], step=1e-4, contact=FAR, threads=1)
    run.fix(body, 13)  # its centre: it goes on turning
    run.advance(0.01)
    assert abs(body.displacement[13]).max() < 1e-16
    spin = (body.rigid_mass.tensor @ np.array([1.0, 2, 3])) @ [1.0, 2, 3]
    assert run.energy().kinetic == pytest.approx(spin / 2, rel=1e-6)

    body = brick()
    run = q.Simulation([body], step=1e-4, contact=FAR, threads=1)
    mass = body.rigid_mass.mass
    run.prescribe(body, body.nodes[:, 2] > -1, "x", lambda t: 3 * t**2)
    run.advance(0.1)
    np.testing.assert_allclose(body.displacement, np.tile([0.03, 0, 0], (27, 1)), atol=1e-12)
    assert run.energy().kinetic == pytest.approx(mass * 0.6**2 / 2, rel=1e-9)
    assert run.energy().external == pytest.approx(run.energy().kinetic, rel=1e-2)


@pytest.mark.parametrize(
    ("ask", "said"),
    [
        (lambda run, body: run.fix(body, 0), "leaves the rigid body a motion about its nodes"),
        (lambda run, body: run.fix(body, [0, 1]), "a hinge"),
        (lambda run, body: (run.fix(body, 13), run.fix(body, 4, "x")), "a hinge"),  # two turns
        (lambda run, body: run.roller(body, 0, [0, 0, 1]), "is rigid"),
        (lambda run, body: run.periodic(body, 0, 1), "is rigid"),
        (
            lambda run, body: run.prescribe(
                body, body.nodes[:, 2] == 0, "z", 1e-3, np.arange(27.0)
            ),
            "move apart along z",
        ),
        (lambda run, body: setattr(body, "velocity", body.nodes), "can not move so"),
        (lambda run, body: setattr(body, "displacement", body.nodes), "can not move so"),
        (lambda run, body: run.relax(), "no static answer"),
    ],
)
def test_what_a_rigid_body_can_not_do(ask: Any, said: str) -> None:
    """It is refused, in words."""
    body = brick()
    run = q.Simulation([body], step=1e-4, contact=None, threads=1)

    def asked() -> None:
        ask(run, body)
        run.pack_lists()

    with pytest.raises(ConditionError, match=said):
        asked()


def test_options_that_have_no_rigid_bodies() -> None:
    """Single precision, and a mark that is none."""
    with pytest.raises(ConditionError, match="double precision"):
        q.Simulation([brick()], precision="float32")
    with pytest.raises(ConditionError, match="rigid is 'stiff'"):
        brick(rigid="stiff")
    with pytest.raises(ConditionError, match="or rigid: no motion limits the step"):
        assert q.Simulation([brick()]).step


def test_state_set_and_seen() -> None:
    """A displacement and velocity that are given come back; half a step makes no difference."""
    body = brick()
    turn = Rotation.from_rotvec([0.5, -2.0, 1.0])
    moved = turn.apply(body.nodes) - body.nodes + np.array([1, 2, 3])
    body.displacement = moved
    run = q.Simulation([body], step=1e-6, contact=FAR, threads=1)
    arm = turn.apply(body.nodes - body.rigid_mass.centre)
    velocity = np.array([0.1, 0.2, 0.3]) + np.cross([3.0, 1, -2], arm)
    body.velocity = velocity
    np.testing.assert_allclose(body.displacement, moved, atol=1e-14)
    np.testing.assert_allclose(body.velocity, velocity, atol=1e-13)
    run.advance(1e-6)
    np.testing.assert_allclose(body.velocity, velocity, atol=1e-4)
    assert not body.von_mises().any()


def test_resume_goes_on_to_the_same_bits(tmp_path: Path) -> None:
    """Saved in the middle of a collision with friction; another rigid body is another run."""

    def made(rigid: Sequence[Any] = (True, False)) -> q.Simulation:
        contact = q.SphereContact(RADIUS, 1e8, 0.5)
        run = collide(rigid, contact=contact, velocity=(1.0, 0.2, 0))
        run.load(run.bodies[0], [3], q.make_ramp(1e-4, [5.0, 1, 2]))
        return run

    go_on(made, tmp_path / "state.npz", 4e-5, 4e-5)
    with pytest.raises(CheckpointError, match="rigid"):
        made(("lumped", False)).restore(tmp_path / "state.npz")


SCENE = """
[simulation]
duration = 1e-5
[[body]]
name = "stone"
rigid = true
mesh = { box = { size = [0.02, 0.03, 0.05], cells = [1, 1, 1] } }
material = { young = 3e10, poisson = 0.2, density = 2700, shear_viscosity = 1e4 }
[contact]
model = "spheres"
radius = 0.006
normal_stiffness = 1e8
friction = 0.5
[output]
modes = 0
[output.probes.top]
nearest = [0, 0, 0.05]
"""


def test_a_scene_names_its_rigid_bodies(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The key becomes the body's; its viscosity counts for nothing; what is refused has a key."""
    file = tmp_path / "scene.toml"
    file.write_text(SCENE, encoding="utf-8")
    prepared = load_scene(file)
    run, bodies = make_simulation(prepared)
    assert bodies["stone"].rigid is True
    assert not run.viscous
    left = prepared.scene.list_left_out()
    assert any("deformation" in text for text in left)
    assert any(text.startswith("viscosity") for text in left)
    assert command.main(["qdem", str(file), "--no-pictures"]) == 0
    assert "governed by contact" in capsys.readouterr().out
    alone = SCENE[: SCENE.index("[contact]")] + SCENE[SCENE.index("[output]") :]
    falls = "duration = 1e-5\nstep = 1e-6\ngravity = [0, 0, -9.81]"  # a loop compiled already
    file.write_text(alone.replace("duration = 1e-5", falls), encoding="utf-8")
    assert command.main(["qdem", str(file), "--force", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["critical_step"]["value"] is None
    file.write_text(SCENE, encoding="utf-8")
    lumped = load_scene(file, ['body.0.rigid="lumped"'])
    assert make_simulation(lumped)[1]["stone"].rigid == "lumped"
    with pytest.raises(SceneError, match="rigid"):
        load_scene(file, ['body.0.rigid="stiff"'])
    hinge = SCENE + '[[fix]]\nbody = "stone"\nnodes = { nearest = [0, 0, 0] }\n'
    file.write_text(hinge, encoding="utf-8")
    with pytest.raises(SceneError, match=r"body.0: what is held leaves the rigid body a motion"):
        make_simulation(load_scene(file))
