"""Forces of the supports against equilibrium and Newton's second law."""

from __future__ import annotations

import numpy as np
import pytest

import qdem_fem as q
from qdem_fem.files.errors import ConditionError
from qdem_fem.mesh.generation import make_box_mesh

MESH = make_box_mesh((1.0, 0.5, 0.5), (4, 2, 2), "kuhn")
X = MESH.nodes
LEFT, RIGHT, BOTTOM = X[:, 0] == 0, X[:, 0] == 1, X[:, 2] == 0
MASS = 1500.0 * 0.25


def block() -> q.Body:
    return q.Body(MESH, q.Material(2e7, 0.3, 1500.0, shear_viscosity=1e3))


def test_equilibrium() -> None:
    """Load, weight and the forces of clamp and rollers sum to nothing, to the residual."""
    body = block()
    gravity = np.array([0, 0, -9.81])
    run = q.Simulation([body], threads=1, gravity=gravity)
    clamp = run.fix(body, LEFT)
    slope = run.roller(body, RIGHT, [1.0, 0, 1.0])
    run.load(body, RIGHT, [30.0, -20.0, 10.0])
    run.relax(1e-10)
    forces = run.reaction(clamp) + run.reaction(slope)
    np.testing.assert_allclose(forces, -(MASS * gravity + [30.0, -20.0, 10.0]), atol=1e-6)
    along = run.reaction(slope)
    assert along[0] == pytest.approx(along[2])
    assert along[1] == 0


def test_newton() -> None:
    """A body whose nodes all follow ``z = a t^2/2``: m a, gravity apart."""
    body = block()
    run = q.Simulation([body], threads=1, step=1e-4, gravity=[0, 0, -9.81])
    said = run.prescribe(body, np.arange(len(X)), "z", lambda t: 0.5 * 3.0 * t**2)
    run.advance(5e-3)
    expected = MASS * (3.0 + 9.81)
    np.testing.assert_allclose(run.reaction(said), [0, 0, expected], rtol=1e-9, atol=1e-6)


def test_momentum_of_a_march() -> None:
    """The impulse of the clamp and the load is the change of momentum.

    To first order in dt: the viscous force of a step takes the velocity half a step behind.
    """
    errors = []
    for share in (0.4, 0.2):
        body = block()
        run = q.Simulation([body], threads=1, safety=share)
        clamp = run.fix(body, LEFT)
        run.load(body, RIGHT, [0, 0, -50.0])
        impulse, steps = np.zeros(3), 200 if share == 0.4 else 400
        for _ in range(steps):
            before = run.reaction(clamp)
            run.advance(run.step)
            impulse += 0.5 * run.step * (before + run.reaction(clamp))
        impulse += run.time * np.array([0, 0, -50.0])
        momentum = (run.assembly.mass[:, None] * body.velocity).sum(axis=0)
        errors.append(abs(impulse - momentum).max() / abs(50.0 * run.time))
    assert errors[0] < 1e-3
    assert errors[1] < errors[0] / 1.8


def test_what_holds_nothing_is_refused() -> None:
    body = block()
    run = q.Simulation([body], threads=1)
    held = run.fix(body, LEFT)
    run.remove(held)
    with pytest.raises(ConditionError, match="holds nothing"):
        run.reaction(held)
