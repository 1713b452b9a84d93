"""What users do by mistake: steps that no longer fit, states against conditions, wrong types."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import qdem_fem as q
from qdem_fem.files.errors import ConditionError, ElementInverted, QdemError, StepWarning, Unstable
from qdem_fem.mesh.generation import make_box_mesh

MESH = make_box_mesh((1.0, 0.5, 0.5), (4, 2, 2), "kuhn")
X = MESH.nodes
LEFT, RIGHT = X[:, 0] == 0, X[:, 0] == 1


def block(name: str = "block") -> q.Body:
    return q.Body(MESH, q.Material(2e7, 0.3, 1500.0), name=name)


def test_a_condition_taken_back_leaves_a_step_too_long_and_it_is_said() -> None:
    """The critical step follows the conditions; the step stays, as time is counted in it."""
    body = block()
    run = q.Simulation([body], threads=1)
    almost_all = np.ones(len(X), bool)
    almost_all[0] = False
    held = run.fix(body, almost_all)
    run.advance(10 * run.step)
    step, before = run.step, run.critical_step.value
    run.remove(held)
    assert run.step == step
    assert run.critical_step.value < step < before
    body.velocity = 1e-3 * np.random.default_rng(0).normal(size=X.shape)
    with pytest.warns(StepWarning, match="times the critical one"), pytest.raises(Unstable):
        run.advance(0.2)


def test_a_state_against_the_conditions_gives_way() -> None:
    """Held nodes are put to their places before the first step: nothing is shot off."""
    body = block()
    run = q.Simulation([body], threads=1)
    run.fix(body, LEFT)
    run.roller(body, RIGHT, [1, 1, 0])
    body.displacement = np.full(X.shape, 1e-3)
    run.advance(0.0)
    run.advance(run.step)
    assert not body.displacement[LEFT].any()
    assert abs(body.displacement[RIGHT, :2].sum(axis=1)).max() < 1e-12
    assert (
        abs(run.motion.work).sum() < 1e-12 * run.energy().elastic
    )  # no jump that conditions forced


def test_all_held() -> None:
    """No motion limits the step: it has to be given, and the march goes on with it."""
    body = block()
    run = q.Simulation([body], threads=1)
    run.fix(body, np.ones(len(X), bool))
    with pytest.raises(ConditionError, match="every component of every node is held"):
        run.advance(1e-3)
    body = block()
    run = q.Simulation([body], threads=1, step=1e-5)
    for axis, stretch in zip("xyz", (1e-3, -2e-4, 0.0), strict=True):
        run.prescribe(body, range(len(X)), axis, stretch, profile=X[:, "xyz".index(axis)])
    run.advance(1e-4)
    expected = X * [1e-3, -2e-4, 0.0]
    np.testing.assert_allclose(body.displacement, expected, rtol=0, atol=1e-15)


def test_an_element_inverted_by_a_given_displacement_is_named() -> None:
    """In a static answer: the one whose volume is most negative."""
    turned, corner = np.zeros(X.shape), int(np.argmax(X.sum(axis=1)))
    turned[corner] = -1.5 * np.array([0.25, 0.25, 0.25])
    body = block()
    corners = (X + turned)[body.elements]
    worst = int(np.argmin(np.linalg.det(corners[:, 1:] - corners[:, :1]) / body.gradients[1]))
    run = q.Simulation([body], threads=1)
    run.fix(body, LEFT)
    for axis, value in zip("xyz", turned[corner], strict=True):
        run.prescribe(body, corner, axis, float(value))
    with pytest.raises(ElementInverted, match=f"element {worst} of block") as raised:
        run.relax()
    assert raised.value.element == worst


def test_added_mass() -> None:
    """``sum rho f V / sum rho V - 1``, with f from the step asked for."""
    body = block()
    run = q.Simulation([body], threads=1)
    plain = run.critical_step.value
    assert run.added_mass == {"block": 0.0}
    body = block()
    run = q.Simulation([body], threads=1, mass_scaling=2 * plain)
    assert run.added_mass["block"] > 0.5
    total = run.assembly.mass.sum()
    own = 1500 * 0.25
    assert run.added_mass["block"] == pytest.approx(total / own - 1, rel=1e-12)


def test_bodies_of_one_name_are_numbered() -> None:
    bodies = [block("stone"), block("sleeper"), block("stone")]
    q.Simulation(bodies)
    assert [body.name for body in bodies] == ["stone 0", "sleeper", "stone 2"]


def test_a_force_by_node() -> None:
    """A profile that grows along y, over a face: the body turns as its resultant tells."""
    body = block()
    run = q.Simulation([body], threads=1)
    shares = np.where(RIGHT, X[:, 1], 0.0)
    run.load(body, RIGHT, [100.0, 0, 0], profile=shares)
    run.advance(20 * run.step)
    mass = run.assembly.mass
    momentum = mass @ body.velocity
    np.testing.assert_allclose(momentum, [100 * shares.sum() * run.time, 0, 0], atol=1e-9)
    spin = (mass[:, None] * np.cross(X + body.displacement, body.velocity)).sum(axis=0)
    # the arm moves with the nodes, by 1e-6 of it
    expected = run.time * np.cross(X, 100 * shares[:, None] * [1.0, 0, 0]).sum(axis=0)
    np.testing.assert_allclose(spin, expected, atol=1e-4 * abs(expected).max())


MISUSE: dict[str, tuple[str, Callable[[q.Simulation, q.Body], Any]]] = {
    "components by number": ("of 'xyz'", lambda r, b: r.fix(b, LEFT, 2)),  # type: ignore[arg-type]
    "ragged nodes": ("no selection", lambda r, b: r.fix(b, [[1, 2], [3]])),
    "probes by mask": ("names", lambda r, b: r.advance(1e-3, probes=LEFT)),  # type: ignore[arg-type]
    "tolerance": ("tolerance of 'a'", lambda r, b: r.relax("a")),  # type: ignore[arg-type]
    "most steps": ("max_steps", lambda r, b: r.relax(1e-8, max_steps=None)),  # type: ignore[arg-type]
    "swapped": ("first argument", lambda r, b: r.fix(LEFT, b)),  # type: ignore[arg-type]
    "one face": ("both faces", lambda r, b: r.periodic(b, LEFT, LEFT)),
    "NaN tolerance": ("tolerance", lambda r, b: r.periodic(b, LEFT, RIGHT, np.nan)),
    "material": ("no material", lambda r, b: q.Body(MESH, "steel")),  # type: ignore[arg-type]
    "name": ("no name", lambda r, b: q.Body(MESH, b.material, name=5)),  # type: ignore[arg-type]
    "profile": ("one finite number", lambda r, b: r.load(b, LEFT, [1.0, 0, 0], profile=[1.0])),
    "NaN profile": (
        "one finite number",
        lambda r, b: r.prescribe(b, LEFT, "x", 1.0, profile=np.full(len(X), np.nan)),
    ),
    "safety": ("not stable", lambda r, b: q.Simulation([block()], safety=2)),
    "threads": ("threads", lambda r, b: q.Simulation([block()], threads=1.5)),  # type: ignore[arg-type]
}


@pytest.mark.parametrize("name", MISUSE)
def test_wrong_types_get_a_sentence(name: str) -> None:
    word, call = MISUSE[name]
    body = block()
    run = q.Simulation([body], threads=1)
    with pytest.raises(QdemError) as raised:
        call(run, body)
    assert word in str(raised.value)
    assert run.steps_done == 0
