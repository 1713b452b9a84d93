"""The march in time: order, conservation, reversal, units, restarts, probes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest

import qdem_fem as q
from qdem_fem.bodies.assembly import Assembly
from qdem_fem.files.output import write_bodies_vtu
from qdem_fem.march import simulation
from qdem_fem.mesh.generation import make_box_mesh
from validation.bench.qdem.meshes import make_delaunay

YOUNG, POISSON, DENSITY = 1e6, 0.25, 1000.0
CORNERS = np.array([[0.0, 0, 0], [1, 0.1, 0], [0.2, 1, 0], [0.1, 0.3, 1.1]])


def stone(count: int = 60, seed: int = 1, **material: Any) -> q.Body:
    nodes, elements = make_delaunay(count, seed)
    values: dict[str, Any] = {"young": YOUNG, "poisson": POISSON, "density": DENSITY} | material
    return q.Body((nodes, elements), q.Material(**values))


def beam() -> q.Body:
    return q.Body(make_box_mesh((1.0, 0.5, 0.5), (4, 2, 2)), q.Material(YOUNG, POISSON, DENSITY))


def alone(body: q.Body, **options: Any) -> q.Simulation:
    return q.Simulation([body], threads=1, **options)


def random_field(body: q.Body, size: float, seed: int = 0) -> np.ndarray:
    return size * np.random.default_rng(seed).normal(size=body.nodes.shape)


# --- the scheme ----------------------------------------------------------------------------------


def oscillator(step: float) -> tuple[q.Body, q.Simulation, float]:
    """One element, one component of one node free: m u'' = -k u; and its omega [rad/s]."""
    body = q.Body((CORNERS, [[0, 1, 2, 3]]), q.Material(YOUNG, POISSON, DENSITY))
    run = alone(body, strain="small", step=step)
    run.fix(body, [0, 1, 2])
    run.fix(body, 3, "xy")
    gradients, volumes = body.gradients
    lam, mu = (float(m[0]) for m in (body.material.lame_first, body.material.lame_second))
    gx, gy, gz = gradients[0, 2]
    stiffness = volumes[0] * ((lam + 2 * mu) * gz**2 + mu * (gx**2 + gy**2))
    return body, run, float(np.sqrt(stiffness / (DENSITY * volumes[0] / 4)))


@pytest.mark.parametrize("share", [0.05, 0.5, 1.5])
def test_oscillator_follows_the_difference_equation(share: float) -> None:
    """u(k) = u0 cos(k t), v(k) = -u0 omega cos(t/2) sin(k t), with sin(t/2) = omega dt/2.

    The exact solution of velocity Verlet from rest; ``share`` is omega dt.
    """
    *_, omega = oscillator(1.0)
    body, run, _ = oscillator(share / omega)
    start = np.zeros((4, 3))
    start[3, 2] = 1e-3
    body.displacement = start
    history = run.advance(40 * run.step, {"node": 3}, run.step)
    angle = 2 * np.arcsin(share / 2)
    expected = 1e-3 * np.cos(angle * np.arange(41))
    np.testing.assert_allclose(history["node"][:, 2], expected, rtol=0, atol=1e-15)
    speed = -1e-3 * omega * np.cos(angle / 2) * np.sin(40 * angle)
    assert body.velocity[3, 2] == pytest.approx(speed, rel=1e-9)
    assert not history["node"][:, :2].any()


def test_second_order_in_the_step() -> None:
    """Error against cos(omega t) falls by four when the step is halved."""
    *_, omega = oscillator(1.0)
    errors = []
    for steps in (64, 128, 256):
        body, run, _ = oscillator(2 * np.pi * 3.2 / omega / steps)
        start = np.zeros((4, 3))
        start[3, 2] = 1e-3
        body.displacement = start
        run.advance(steps * run.step)
        errors.append(abs(body.displacement[3, 2] - 1e-3 * np.cos(2 * np.pi * 3.2)))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (abs(orders - 2) < 0.1).all()


def test_free_fall_is_exact() -> None:
    """u = g t^2/2 and v = g t at every step, without a strain, to round-off."""
    body = stone()
    run = alone(body, gravity=[1.0, -2.0, -9.81])
    run.advance(300 * run.step)
    used = np.unique(body.elements)
    gravity = np.array([1.0, -2.0, -9.81])
    np.testing.assert_allclose(
        body.displacement[used], np.tile(gravity * run.time**2 / 2, (len(used), 1)), rtol=1e-11
    )
    np.testing.assert_allclose(
        body.velocity[used], np.tile(gravity * run.time, (len(used), 1)), rtol=1e-11
    )
    energy = run.energy()
    assert energy.external == pytest.approx(energy.kinetic, rel=1e-10)


# --- conservation --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("strain", "viscosity"),
    [
        ("finger", 0.0), ("finger", 200.0), ("svk", 0.0),
        pytest.param("svk", 200.0, marks=pytest.mark.long),
    ],
)  # fmt: skip
def test_momenta_of_a_free_body(strain: Any, viscosity: float) -> None:
    """sum m v and sum m x times v are kept: forces of an element have no resultant nor moment.

    In leapfrog x(k) x (v(k+1/2) - v(k-1/2)) = dt x(k) x f(k)/m sums to zero, so both are exact.
    """
    body = stone(shear_viscosity=viscosity)
    run = alone(body, strain=strain, safety=0.3)
    body.velocity = random_field(body, 1.0) + np.cross([3.0, 1, 2], body.nodes)
    mass = run.assembly.mass[:, None]

    def momenta() -> tuple[np.ndarray, np.ndarray]:
        momentum = mass * body.velocity
        return momentum.sum(axis=0), np.cross(body.nodes + body.displacement, momentum).sum(axis=0)

    before = momenta()
    run.advance(200 * run.step)
    scale = float((mass * abs(body.velocity)).sum())
    for one, other in zip(before, momenta(), strict=True):
        assert abs(one - other).max() < 1e-13 * scale
    assert abs(body.displacement).max() > 1e-3


LOADS: dict[str, tuple[Any, Callable[[q.Simulation, q.Body], Any]]] = {
    "free": (None, lambda run, body: setattr(body, "velocity", random_field(body, 0.5))),
    "force": (
        None,
        lambda run, body: run.load(
            body, body.nodes[:, 0] > 0.99, q.make_ramp(0.05, [10.0, 0, 300])
        ),
    ),
    "pressure": (
        None,
        lambda run, body: run.pressure(
            body, body.nodes[:, 0] > 0.99, lambda t: 2e3 * np.sin(60 * t)
        ),
    ),
    "prescribed motion": (
        None,
        lambda run, body: run.prescribe(
            body, body.nodes[:, 0] > 0.99, "x", lambda t: 0.02 * (1 - np.cos(50 * t))
        ),
    ),
    "prescribed motion from a velocity": (
        None,
        lambda run, body: run.prescribe(
            body, body.nodes[:, 0] > 0.99, "x", lambda t: 0.02 * np.sin(50 * t)
        ),
    ),
    "gravity": ([0, 0, -9.81], lambda run, body: None),
}


@pytest.mark.parametrize("name", LOADS)
def test_work_is_energy(name: str) -> None:
    """Kinetic + elastic - external stays what it was, but for terms of second order in dt.

    The work of a force is the trapezoidal sum of its power, so the difference falls by four
    with half the step; a clamped beam, three periods of its fastest bending.
    """
    gravity, apply = LOADS[name]
    left = []
    for step in (3e-4, 1.5e-4, 7.5e-5):
        body = beam()
        run = alone(body, strain="svk", step=step, gravity=gravity)
        run.fix(body, body.nodes[:, 0] < 1e-9)
        apply(run, body)
        if name == "free":  # all others are counted from rest, what begins at speed as well
            run.advance(0.003)  # fixed nodes lose what they were given
        before = run.energy()
        run.advance(0.15)
        after = run.energy()
        left.append(
            after.kinetic + after.elastic - after.external
            - (before.kinetic + before.elastic - before.external)
        )  # fmt: skip
    size = after.kinetic + after.elastic
    assert abs(left[0]) < 0.02 * size
    assert abs(left[2]) < abs(left[0]) / 8


def test_time_reversal() -> None:
    """With the velocities turned round an elastic body goes back the way it came."""
    body = stone()
    run = alone(body, strain="svk")
    speed = random_field(body, 0.1)
    speed[np.setdiff1d(np.arange(60), body.elements)] = 0
    body.velocity = speed
    run.advance(150 * run.step)
    moved = abs(body.displacement).max()
    body.velocity = -body.velocity
    run.advance(150 * run.step)
    assert moved > 1e-3
    assert abs(body.displacement).max() < 1e-10 * moved
    np.testing.assert_allclose(body.velocity, -speed, rtol=0, atol=1e-10)


# --- units ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("precision", ["float64", "float32"])
def test_units_do_not_matter(precision: Any) -> None:
    """Metres, kilograms and seconds times powers of two: the same bits in the new units."""
    results = []
    for metre, kilogram, second in ((1.0, 1.0, 1.0), (2.0**3, 2.0**-5, 2.0**4)):
        nodes, elements = make_delaunay(60, 1)
        pascal = kilogram / metre / second**2
        material = q.Material(YOUNG * pascal, POISSON, DENSITY * kilogram / metre**3)
        body = q.Body((nodes * metre, elements), material)
        newton, gee = kilogram * metre / second**2, metre / second**2
        run = alone(
            body, precision=precision, step=1e-3 * second, gravity=np.array([0, 0, -9.81]) * gee
        )
        run.fix(body, nodes[:, 2] < 0.2)
        run.load(
            body, nodes[:, 2] > 0.8, q.make_ramp(0.03 * second, np.array([900.0, 0, 0]) * newton)
        )
        body.velocity = random_field(body, 0.1) * metre / second
        run.advance(0.05 * second)
        results.append(body.displacement / metre)
    np.testing.assert_array_equal(*results)
    assert abs(results[0]).max() > 1e-3


# --- stops and starts ----------------------------------------------------------------------------


def loaded(**options: Any) -> tuple[q.Body, q.Simulation]:
    body = beam()
    run = alone(body, step=2e-4, **options)
    run.fix(body, body.nodes[:, 0] < 1e-9)
    run.prescribe(body, (body.nodes[:, 0] > 0.99) & (body.nodes[:, 1] < 0.1), "y", lambda t: t * t)
    run.load(body, body.nodes[:, 0] > 0.99, lambda t: [0, 0, 300 * np.sin(40 * t)])
    return body, run


def test_a_stop_on_the_way_changes_no_bit() -> None:
    """advance(a + b) is advance(a), advance(b), whatever was read in between."""
    body, run = loaded()
    run.advance(0.06)
    other, parts = loaded()
    parts.advance(0.0)
    parts.advance(0.0138)
    assert parts.energy().kinetic > 0
    assert other.velocity.any()
    assert other.von_mises().any()
    parts.advance(0.0462)
    assert parts.steps_done == run.steps_done == 300
    np.testing.assert_array_equal(other.displacement, body.displacement)
    np.testing.assert_array_equal(other.velocity, body.velocity)
    assert parts.energy() == run.energy()


def test_duration_is_rounded_up_to_whole_steps() -> None:
    _, run = loaded()
    run.advance(0.0)
    assert run.steps_done == 0
    run.advance(2.5 * run.step)
    assert run.steps_done == 3
    run.advance(3 * run.step)  # 3 dt / dt is 3, whatever the rounding
    assert run.steps_done == 6
    assert run.time == 6 * run.step


def test_several_bodies_do_not_know_of_each_other() -> None:
    """Two in one simulation move as each alone, to the same bits."""
    pair = [stone(60, 1), stone(40, 2)]
    run = q.Simulation(pair, step=2e-4, threads=1, gravity=[0, 0, -9.81])
    for body in pair:
        run.fix(body, body.nodes[:, 2] < 0.3)
    history = run.advance(0.02, {"one": (pair[0], [5, 6]), "two": (pair[1], 7)}, 1e-3)
    for body, (count, seed), name, nodes in zip(
        pair, ((60, 1), (40, 2)), ("one", "two"), ([5, 6], 7), strict=True
    ):
        single = stone(count, seed)
        own = alone(single, step=2e-4, gravity=[0, 0, -9.81])
        own.fix(single, single.nodes[:, 2] < 0.3)
        recorded = own.advance(0.02, {"here": nodes}, 1e-3)
        np.testing.assert_allclose(body.displacement, single.displacement, rtol=0, atol=1e-15)
        np.testing.assert_allclose(history[name], recorded["here"], rtol=0, atol=1e-15)


# --- probes --------------------------------------------------------------------------------------


def test_probes_sample_at_multiples_of_the_interval() -> None:
    """Samples of one advance, of two, and of every step agree where their times do."""
    body, run = loaded()
    tip = body.nodes[:, 0] > 0.99
    every = run.advance(0.03, {"tip": tip}, run.step)
    np.testing.assert_allclose(every.time, run.step * np.arange(151), rtol=1e-14)

    body, run = loaded()
    seventh = run.advance(0.03, {"tip": tip, "corner": 3}, 7 * run.step)
    np.testing.assert_allclose(seventh.time, 7 * run.step * np.arange(22), rtol=1e-14)
    np.testing.assert_array_equal(seventh["tip"], every["tip"][::7])

    body, run = loaded()
    parts = [run.advance(t, {"tip": tip}, 7 * run.step) for t in (0.0042, 0.0, 0.0118, 0.014)]
    np.testing.assert_allclose(np.concatenate([p.time for p in parts]), seventh.time, rtol=1e-13)
    np.testing.assert_array_equal(np.concatenate([p["tip"] for p in parts]), seventh["tip"])

    np.testing.assert_allclose(every["tip"][-1], body.displacement[tip].mean(axis=0), rtol=1e-14)


def test_without_an_interval_there_are_a_thousand_samples_at_most() -> None:
    _, run = loaded()
    assert len(run.advance(0.4, {"tip": 3})["tip"]) == 1001
    assert len(run.advance(0.01, {"tip": 3})["tip"]) == 50


def test_progress_gets_the_time() -> None:
    _, run = loaded()
    times: list[float] = []
    run.advance(1.0, progress=times.append)
    assert times == sorted(times)
    assert times[-1] == pytest.approx(1.0)
    assert len(times) > 1


# --- the state of a body -------------------------------------------------------------------------


@pytest.mark.parametrize("after", [False, True], ids=["before", "between advances"])
@pytest.mark.parametrize("field", ["displacement", "velocity"])
def test_state_can_be_set(field: str, after: bool) -> None:
    """What is set is what is read, a copy; the other field is as it was."""
    body = stone(seed=3)
    run = alone(body)
    if after:
        body.velocity = random_field(body, 0.1, 5)
        run.advance(10 * run.step)
    other = {"displacement": "velocity", "velocity": "displacement"}[field]
    before = getattr(body, other)
    values = random_field(body, 1e-3, 7)
    setattr(body, field, values)
    np.testing.assert_array_equal(getattr(body, field), values)
    np.testing.assert_allclose(getattr(body, other), before, rtol=0, atol=1e-15)
    getattr(body, field)[:] = 99.0
    np.testing.assert_array_equal(getattr(body, field), values)


def test_bodies_set_and_written_in_one_go(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Work on one body is that of its own nodes: of n bodies in turn it was of the order n^2."""
    bodies = [stone(seed=seed) for seed in (1, 2, 3)]
    run = q.Simulation(bodies, threads=1)
    run.advance(3 * run.step)
    for body in bodies:
        body.velocity = random_field(body, 1e-3)
    run.advance(2 * run.step)
    asked = []
    now = simulation.find_velocity
    monkeypatch.setattr(simulation, "find_velocity", lambda run: asked.append(1) or now(run))
    write_bodies_vtu(tmp_path / "a.vtu", bodies)
    assert len(asked) == 1
    read = meshio.read(tmp_path / "a.vtu").point_data["velocity"]
    assert (read == np.concatenate([body.velocity for body in bodies])).all()
    bodies[0].displacement = random_field(bodies[0], 1e-4)  # the first brings velocities level
    monkeypatch.setattr(Assembly, "_read", None)  # what is not set is not read either
    bodies[1].displacement = random_field(bodies[1], 1e-4)
    monkeypatch.undo()
    assert (bodies[1].displacement == random_field(bodies[1], 1e-4)).all()


def test_state_set_before_the_simulation_is_its_start() -> None:
    body, twin = stone(), stone()
    u, v = random_field(body, 1e-3), random_field(body, 0.1, 1)
    body.displacement, body.velocity = u, v
    run = alone(body)
    same = alone(twin)
    twin.displacement, twin.velocity = u, v
    for each in (run, same):
        each.advance(20 * each.step)
    np.testing.assert_array_equal(body.displacement, twin.displacement)
