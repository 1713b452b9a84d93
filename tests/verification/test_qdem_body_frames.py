"""Frames of free bodies in single precision: rigid motions cost no digit of the strain."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import qdem_fem as q
from qdem_fem.bodies.frames import BodyFrames
from qdem_fem.element.kinematics import find_displacement_gradient
from qdem_fem.files import Floats
from qdem_fem.mesh.generation import make_box_mesh
from tests.qdem_restored import go_on

STONE = q.Material(30e9, 0.2, 2600.0)
MESH = make_box_mesh((0.05, 0.04, 0.03), (4, 3, 3), "kuhn")
EPS = float(np.finfo(np.float32).eps)


def green_strain(body: q.Body) -> Floats:
    """``(F^T F - I)/2``: what no rotation changes."""
    f = np.eye(3) + find_displacement_gradient(body.gradients[0], body.elements, body.displacement)
    return 0.5 * (f.transpose(0, 2, 1) @ f - np.eye(3))


def thrown(
    precision: Any, velocity: Any, spin: Any = (0, 0, 0), **options: Any
) -> tuple[q.Body, q.Simulation]:
    """A stone with a velocity [m/s], a spin [rad/s] and a vibration, strains of 1e-6."""
    body = q.Body(MESH, STONE, name="stone")
    run = q.Simulation([body], precision=precision, threads=1, step=1e-6, **options)
    arm = body.nodes - body.nodes.mean(axis=0)
    body.displacement = 1e-6 * arm[:, [1, 2, 0]]
    body.velocity = np.cross(spin, arm) + np.asarray(velocity, dtype=float)
    return body, run


def frames_of(run: q.Simulation) -> BodyFrames:
    """Its frames; the simulation has them."""
    run.pack_lists()
    frames = run.assembly.frames
    assert frames is not None
    return frames


# --- the transformation --------------------------------------------------------------------------


@settings(max_examples=50)
@given(st.integers(0, 2**32 - 1))
def test_there_and_back_and_the_best_rigid_motion(seed: int) -> None:
    """`fit` finds a rigid motion exactly; world and own fields are inverse to each other."""
    random = np.random.default_rng(seed)
    sizes = random.integers(4, 9, size=3)
    first = np.concatenate([[0], np.cumsum(sizes)])
    nodes, mass = random.normal(size=(first[-1], 3)), random.uniform(0.1, 1, size=first[-1])
    frames = BodyFrames(nodes, mass, first, np.ones(3), turning=True)
    frames.choose(np.zeros(len(nodes), bool), gravity=False)
    turn = Rotation.random(3, rng=random).as_matrix()
    shift, velocity = random.normal(size=(2, 3, 3))
    x = np.einsum("nij,nj->ni", turn[frames.body], nodes) + shift[frames.body]
    frames.fit(x - nodes, velocity[frames.body])
    np.testing.assert_allclose(frames.rotation[:-1], turn, atol=1e-13)
    np.testing.assert_allclose(frames.displacement_own(x - nodes), 0, atol=1e-13)
    np.testing.assert_allclose(frames.velocity_own(velocity[frames.body]), 0, atol=1e-13)
    for there, back in (
        (frames.displacement_world, frames.displacement_own),
        (frames.velocity_world, frames.velocity_own),
    ):
        field = random.normal(size=nodes.shape)
        np.testing.assert_allclose(back(there(field)), field, atol=1e-13)


def test_double_precision_and_held_bodies_have_none() -> None:
    _, run = thrown("float64", (1, 0, 0))
    run.advance(1e-5)
    assert run.assembly.frames is None
    body, run = thrown("float32", (1, 0, 0))
    run.fix(body, body.nodes[:, 0] == 0)
    run.advance(1e-5)
    assert run.assembly.frames is None


# --- what they are for ---------------------------------------------------------------------------


@pytest.mark.long
@pytest.mark.parametrize("strain", ["finger", "small", "svk"])
def test_a_flight_of_ten_metres_costs_no_strain(strain: Any) -> None:
    """Its vibration is that of the stone at rest in double precision.

    Bound: one rounding of the displacement, 6e-8 of 1e-6, a step, adding up at worst.  From the
    laboratory the same displacement rounds to 5e-7 m, strains of 1e-4, a hundred times the
    stone's own.
    """
    flying, run = thrown("float32", (2e4, -1e4, 5e3), strain=strain)
    resting, rest = thrown("float64", (0, 0, 0), strain=strain)
    for each in (run, rest):
        each.advance(5e-4)
    assert np.linalg.norm(flying.displacement.mean(axis=0)) > 10
    error = abs(green_strain(flying) - green_strain(resting)).max()
    assert abs(green_strain(resting)).max() > 3e-7
    assert error < rest.steps_done * EPS * 1e-6


def test_a_turning_stone_keeps_its_strain() -> None:
    """A third of a turn; each step rounds a displacement of `FAR` element sizes.

    These errors are independent kicks, so their sum grows as the root of the steps; bound: three
    times that.  In the laboratory's frame the strain would be wrong by 1e-4.
    """
    spin = (200.0, 300.0, -100.0)
    body, run = thrown("float32", (10, -3, 2), spin)
    twin, reference = thrown("float64", (10, -3, 2), spin)
    for each in (run, reference):
        each.advance(6e-3)
    assert Rotation.from_matrix(frames_of(run).rotation[0]).magnitude() > 2
    error = abs(green_strain(body) - green_strain(twin)).max()
    assert error < 3 * EPS / 2 * frames_of(run).far[0] / 0.01 * np.sqrt(run.steps_done)


def test_fall_and_throw_have_their_closed_form() -> None:
    """``u = v t + g t^2/2``, which the scheme meets exactly, to double precision.

    The stone itself rests: frames fall, and nothing in them is rounded.  Bound on the velocity:
    round-off of the place, 1e-17 m, strains elements of a centimetre, times the speed of sound.
    """
    body = q.Body(MESH, STONE)
    gravity = np.array([1.0, 2.0, -9.81])
    run = q.Simulation([body], precision="float32", threads=1, step=1e-6, gravity=gravity)
    body.velocity = np.tile([3.0, 0, 1.0], (len(body.nodes), 1))
    history = run.advance(0.02, {"corner": 0}, sampling=1e-3)
    t = history.time[:, None]
    expected = t * [3.0, 0, 1.0] + 0.5 * t**2 * gravity
    np.testing.assert_allclose(history["corner"], expected, rtol=0, atol=1e-12)
    speed = np.tile([3.0, 0, 1.0] + 0.02 * gravity, (len(body.nodes), 1))
    np.testing.assert_allclose(body.velocity, speed, rtol=0, atol=1e-10)
    energy = run.energy()
    mass = run.assembly.mass.sum()
    moved = body.velocity[0] @ body.velocity[0] - 10
    assert energy.external == pytest.approx(0.5 * mass * moved, rel=1e-10)


# --- beside double precision, under everything that acts on a free body ---------------------------

SCENES: dict[str, Any] = {
    "load": lambda run, body: run.load(body, body.nodes[:, 0] > 0.049, [3e3, -1e3, 2e3]),
    "load in time": lambda run, body: run.load(
        body, body.nodes[:, 2] == 0, lambda t: (2e3 * np.cos(2e3 * t), 1e3, -2e3)
    ),
    "pressure": lambda run, body: run.pressure(body, body.nodes[:, 1] == 0, 1e7),
    "two loads on a node": lambda run, body: [
        run.load(body, 0, [300.0, 0, 0]), run.load(body, 0, [0, 200.0, 100.0]),
    ],
}  # fmt: skip


@pytest.mark.parametrize("gravity", [None, [0.0, 0.0, -9.81]])
@pytest.mark.parametrize("scene", SCENES)
def test_loads_act_as_they_do_in_double_precision(scene: str, gravity: Any) -> None:
    """Place, velocity and work after the loads have turned the stone.

    Bounds: velocities of some metres a second, rounded in each of a thousand steps.
    """
    results = []
    for precision in ("float64", "float32"):
        body, run = thrown(precision, (1, 2, 3), (300, 0, 400), gravity=gravity)
        SCENES[scene](run, body)
        history = run.advance(1e-3, {"one": 7}, sampling=5e-5)
        results.append((body.displacement, history["one"], run.motion.work[0], run.energy()))
    (u, path, work, energy), (u2, path2, work2, energy2) = results
    np.testing.assert_allclose(u2, u, rtol=0, atol=20 * EPS * abs(u).max())
    np.testing.assert_allclose(path2, path, rtol=0, atol=20 * EPS * abs(u).max())
    assert work2 == pytest.approx(work, rel=1e-5)
    assert energy2.kinetic == pytest.approx(energy.kinetic, rel=1e-5)


def test_free_and_held_bodies_under_gravity() -> None:
    """One hangs, one falls: the frame goes on without turning, and gravity acts within it."""
    results = []
    for precision in ("float64", "float32"):
        hung, free = (q.Body(MESH, STONE, name=name) for name in ("hung", "free"))
        run = q.Simulation(
            [hung, free], precision=precision, threads=1, step=1e-6, gravity=[0, 0, -9.81]
        )  # type: ignore[arg-type]
        run.fix(hung, hung.nodes[:, 2] == 0.03)
        run.advance(3e-3)
        results.append((hung.displacement, free.displacement))
    (hung_u, free_u), (hung_u2, free_u2) = results
    np.testing.assert_allclose(free_u[:, 2], -0.5 * 9.81 * 9e-6, rtol=1e-9)
    np.testing.assert_allclose(free_u2, free_u, rtol=0, atol=1e-4 * abs(free_u).max())
    np.testing.assert_allclose(hung_u2, hung_u, rtol=0, atol=1e-3 * abs(hung_u).max())


def test_a_body_that_is_caught_loses_its_frame_and_not_its_place() -> None:
    """Held nodes stay where the flight has brought them but for one rounding: no jump."""
    body, run = thrown("float32", (10, 0, 0), (100, 0, 0))
    run.advance(5e-4)
    place, speed = body.displacement, body.velocity
    held = run.roller(body, body.nodes[:, 0] == 0, [0, 1, 0])
    run.pack_lists()
    assert run.assembly.frames is None
    np.testing.assert_allclose(body.displacement, place, rtol=0, atol=2 * EPS * abs(place).max())
    np.testing.assert_allclose(body.velocity, speed, rtol=0, atol=2 * EPS * abs(speed).max())
    run.remove(held)
    run.advance(1e-5)
    np.testing.assert_allclose(body.displacement, place + 1e-5 * speed, rtol=0, atol=1e-7)
    assert run.assembly.frames is not None


def test_a_saved_flight_goes_on_to_the_same_bits(tmp_path: Path) -> None:
    def made() -> q.Simulation:
        body, run = thrown("float32", (10, 0, 0), (100, 50, 0), gravity=[0, 0, -9.81])
        run.load(body, 3, [100.0, 0, 0])
        return run

    go_on(made, tmp_path / "state.npz", 4e-4, 3e-4)


@pytest.mark.parametrize("precision", ["float64", "float32"])
def test_a_bodys_field_is_its_part_of_all_and_reads_no_more(precision: Any, monkeypatch) -> None:
    mesh = make_box_mesh((0.1, 0.1, 0.1), (1, 1, 1))
    bodies = [q.Body(mesh, q.Material(1e9, 0.2, 2e3), name=name) for name in "abc"]
    run = q.Simulation(bodies, precision=precision, threads=1)
    for number, body in enumerate(bodies):
        body.velocity = np.full((8, 3), 1.0 + number)
    run.advance(20 * run.step)
    every = run.assembly.field("displacement")
    read, counts = type(run.assembly)._read, []

    def spy(assembly: Any, flat: Any, *nodes: slice) -> Any:
        found = read(assembly, flat, *nodes)
        counts.append(len(found))
        return found

    monkeypatch.setattr(type(run.assembly), "_read", spy)
    assert (bodies[1].displacement == every[8:16]).all()
    assert counts == [8]
